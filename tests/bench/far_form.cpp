// heddle_far_form PACK... [--rays N] [--resolution N]: how far a fabric's far form is from the mean
// of `exact` over many eye rays, on flat cloth. For every pack it makes the form, then compares 492
// pairs of 41 views and 12 lights (the pairs of heddle_flat_swatch): the relative RMSE over the
// pairs and the ratio of the means, of single scattering, multiple scattering and both, for lights
// of some widths. Views lie between the form's, so interpolation counts.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "fibers/math/random.h"
#include "pipeline/work_time.h"
#include "precompute/far_bake.h"
#include "render/far_form.h"
#include "render/multiple_scattering.h"
#include "render/single_scattering.h"
#include "tests/bench/flat_pairs.h"

namespace heddle {
namespace {

struct FarParts {
  Rgbd single = Rgbd::Zero();
  Rgbd multiple = Rgbd::Zero();
};

struct Pair {
  FarParts exact;
  FarParts far;
};

/// Sums over pairs of one part.
struct Comparison {
  double squares = 0;
  double reference_squares = 0;
  double sum = 0;
  double reference_sum = 0;

  void add(const Rgbd& value, const Rgbd& reference) {
    squares += (value - reference).square().sum();
    reference_squares += reference.square().sum();
    sum += value.sum();
    reference_sum += reference.sum();
  }
  std::string text() const {
    return fmt::format("{:5.2f} % {:+6.2f} %", 100 * std::sqrt(squares / reference_squares),
                       100 * (sum / reference_sum - 1));
  }
};

void compare(const FabricPack& pack, const TileScene& scene, const FarForm& form,
             std::optional<float> sharpness, int rays) {
  const SingleScattering single(&*pack.ssdf, pack.sgs ? &*pack.sgs : nullptr, pack.materials);
  const MultipleScattering multiple(*pack.transfer, pack.materials, pack.bundle_tangent);
  const MultipleScattering::LightShape shape(sharpness);
  std::array<Vec3, kLights> lights;
  for (int l = 0; l < kLights; ++l) lights[l] = direction_of(light_theta(l), light_azimuth(l));
  std::vector<std::array<Pair, kLights>> pairs(kViews);
  tbb::parallel_for(0, kViews, [&](int view) {
    std::array<Pair, kLights>& own = pairs[static_cast<std::size_t>(view)];
    const Vec3 wo = direction_of(view_degrees(view), 0);
    const Exemplar& exemplar = pack.exemplar;
    const int strata = std::max(1, static_cast<int>(std::sqrt(rays)));
    for (int ray = 0; ray < strata * strata; ++ray) {
      RandomStream random(1, RandomStage::kBench, static_cast<std::uint64_t>(view),
                          static_cast<std::uint64_t>(ray));
      const float x =
          (static_cast<float>(ray % strata) + random.uniform()) / static_cast<float>(strata);
      const float y =
          (static_cast<float>(ray / strata) + random.uniform()) / static_cast<float>(strata);
      const Vec3 origin(x * exemplar.width_mm, y * exemplar.height_mm, exemplar.z_max);
      const auto hit = scene.intersect({origin, -wo}, kNoFiber);
      if (!hit) continue;
      const Vec3 tangent = exemplar.segment_tangent(hit->segment);
      const ShadingPoint point{hit->segment,
                               pack.transfer->cell_of_segment[hit->segment],
                               exemplar.segment_material(hit->segment),
                               {tangent, tangent},
                               {wo, wo}};
      for (int l = 0; l < kLights; ++l) {
        const DirectionPair axis{lights[l], lights[l]};
        const Rgb one = sharpness ? single.spherical_gaussian(point, axis, *sharpness)
                                  : single.directional(point, axis);
        own[l].exact.single += one.cast<double>() / (strata * strata);
        own[l].exact.multiple +=
            multiple.radiance(shape, lights[l], hit->segment, point.material, tangent, wo)
                .cast<double>() /
            (strata * strata);
      }
    }
    const FarForm::View seen = form.view(wo);
    const FarTable& table = form.table();
    const float coverage = seen.place.mean(table.coverage);
    for (int l = 0; l < kLights; ++l) {
      std::array<float, sh_count(kMaxShOrder)> c_light;
      shape.project(table.order, table.both_sides, lights[l], c_light.data());
      own[l].far.single = (coverage * form.single(seen, lights[l], sharpness)).cast<double>();
      own[l].far.multiple =
          (coverage * form.multiple(seen, lights[l], sharpness, c_light.data())).cast<double>();
    }
  });
  Comparison of_single;
  Comparison of_multiple;
  Comparison of_both;
  for (const auto& view : pairs) {
    for (const Pair& pair : view) {
      of_single.add(pair.far.single, pair.exact.single);
      of_multiple.add(pair.far.multiple, pair.exact.multiple);
      of_both.add(pair.far.single + pair.far.multiple, pair.exact.single + pair.exact.multiple);
    }
  }
  fmt::print("  {:>12}  single {}  multiple {}  both {}\n",
             sharpness ? fmt::format("lambda {:g}", *sharpness) : "directional", of_single.text(),
             of_multiple.text(), of_both.text());
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  int rays = 4096;
  FarSettings settings;
  std::vector<std::string> packs;
  for (int k = 1; k < argc; ++k) {
    if (std::strcmp(argv[k], "--rays") == 0 && k + 1 < argc) {
      rays = std::atoi(argv[++k]);
    } else if (std::strcmp(argv[k], "--resolution") == 0 && k + 1 < argc) {
      settings.resolution = std::atoi(argv[++k]);
    } else {
      packs.emplace_back(argv[k]);
    }
  }
  fmt::print("relative RMSE over 492 pairs, and the means' difference\n");
  for (const std::string& folder : packs) {
    const FabricPack pack = load_pack(folder);
    const TileScene scene(pack.exemplar);
    const Stopwatch watch;
    const FarTable table =
        bake_far({&scene, &*pack.ssdf, &*pack.transfer, pack.bundle_tangent, pack.materials, 1.0},
                 settings, [](double) {});
    fmt::print("{}: baked in {:.1f} core-seconds\n", pack.name, watch.elapsed().core_seconds);
    const FarForm form(table);
    for (const std::optional<float> sharpness :
         {std::optional<float>(), std::optional<float>(150), std::optional<float>(40),
          std::optional<float>(10), std::optional<float>(2)}) {
      compare(pack, scene, form, sharpness, rays);
    }
  }
  return 0;
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  return heddle::run(argc, argv);
}
