// Single scattering by the stored forms of visibility, against rays: per segment of a real weave.

#include <algorithm>
#include <cmath>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/scattering/fiber_bcsdf.h"
#include "fibers/tracing/segment_origins.h"
#include "fibers/tracing/tile_scene.h"
#include "pipeline/warnings.h"
#include "precompute/sg_fit.h"
#include "precompute/ssdf_fit.h"
#include "precompute/visibility_maps.h"
#include "render/single_scattering.h"
#include "tests/stability/stability_curve.h"
#include "tests/support/fabrics.h"

namespace heddle::stability {
namespace {

/// Light that is drawn from a Gaussian, hidden by rays from the segment's origin, and scattered by
/// the BCSDF's definition.
Rgbd traced(const TileScene& tile, const SegmentOrigins& origins, const FiberScattering& fiber,
            std::uint32_t segment, const Vec3& wo, const Vec3& axis, float sharpness,
            bool both_sides, int rays, RandomStream& random) {
  const Exemplar& exemplar = tile.exemplar();
  const Mat3 to_fiber = frame_about(exemplar.segment_tangent(segment)).transpose();
  Rgbd sum = Rgbd::Zero();
  for (int k = 0; k < rays; ++k) {
    const Vec3 wi = sample_spherical_gaussian(axis, sharpness, random);
    if (!both_sides && wi.z() <= 0) continue;
    if (tile.occluded({origins.position[segment], wi}, exemplar.segment_fiber[segment])) continue;
    const Vec3d local = (to_fiber * wi).cast<double>();
    sum += std::sqrt(std::max(0.0, 1 - local.x() * local.x())) *
           evaluate_bcsdf(fiber, local, (to_fiber * wo).cast<double>());
  }
  return sum / rays;
}

Curve visibility_errors(Effort effort, bool both_sides) {
  Curve curve{.title = both_sides ? "Forms of visibility, light from both sides"
                                  : "Forms of visibility, light from the face",
              .driver = "sharpness of the light",
              .measure = "sum of |error| / sum of values, single scattering of segments",
              .is_log = true,
              .drivers = effort == Effort::kFull
                             ? std::vector<double>{1, 3, 6, 10, 13, 16, 20, 50, 100, 200, 400, 1000,
                                                   3000, 1e4}
                             : std::vector<double>{2, 14, 20, 50, 200, 1000},
              .series = {{"sum of Gaussians", {}},
                         {"signed distance", {}},
                         {"blended (shipped)", {}},
                         {"blended, mean", {}}},
              .warning_from = {}};
  const TileScene tile(synthesize(test::small_fabric()));
  const Exemplar& exemplar = tile.exemplar();
  const SegmentOrigins origins = find_segment_origins(tile, both_sides, OriginChoice::kExposed, 1);
  const auto segments = static_cast<std::uint32_t>(exemplar.segment_count());
  const VisibilityMaps maps = bake_visibility_maps(tile, origins, both_sides, 0, segments);
  const TomlTable section = TomlTable::parse("", "visibility");
  const VisibilitySettings settings = read_visibility_settings(section, both_sides);
  const SsdfVisibility ssdf = fit_ssdf(maps, settings);
  const SgVisibility lobes = fit_sgs(maps, settings);
  std::vector<BcsdfTable> materials;
  for (const FiberScattering& fiber : exemplar.scattering) materials.emplace_back(fiber);
  const SingleScattering soft(nullptr, &lobes, materials, kLobesOnly);
  const SingleScattering sharp(&ssdf, nullptr, materials, kSignedDistanceOnly);
  const SingleScattering shipped(&ssdf, &lobes, materials);
  std::vector<std::uint32_t> seeing;
  for (std::uint32_t s = 0; s < segments; ++s) {
    if (maps.sees_nothing[s] == 0 && origins.openness[s] > 0.05F) seeing.push_back(s);
  }
  const int cases = effort == Effort::kFull ? 1600 : 600;
  const int rays = effort == Effort::kFull ? 800 : 250;
  for (const double driver : curve.drivers) {
    const auto sharpness = static_cast<float>(driver);
    double total = 0;
    std::array<double, 4> error{};
    for (int k = 0; k < cases; ++k) {
      // the same cases for every light
      RandomStream random(3, RandomStage::kTest, 0, static_cast<std::uint64_t>(k));
      const std::uint32_t segment =
          seeing[static_cast<std::size_t>(random.uniform() * static_cast<float>(seeing.size()))];
      const Vec3 wo = sample_hemisphere(Vec3::UnitZ(), random);
      const Vec3 axis =
          both_sides ? sample_sphere(random) : sample_hemisphere(Vec3::UnitZ(), random);
      const Vec3 tangent = exemplar.segment_tangent(segment);
      const std::uint16_t material = exemplar.segment_material(segment);
      const ShadingPoint point = {segment, 0, material, {tangent, tangent}, {wo, wo}};
      const DirectionPair light = {axis, axis};
      const double exact = traced(tile, origins, exemplar.scattering[material], segment, wo, axis,
                                  sharpness, both_sides, rays, random)
                               .sum();
      total += exact;
      const std::array<const SingleScattering*, 3> forms = {&soft, &sharp, &shipped};
      for (std::size_t f = 0; f < forms.size(); ++f) {
        const double difference =
            static_cast<double>(forms[f]->spherical_gaussian(point, light, sharpness).sum()) -
            exact;
        error[f] += std::abs(difference);
        if (f == 2) error[3] += difference;
      }
    }
    for (std::size_t f = 0; f < error.size(); ++f)
      curve.series[f].values.push_back(std::abs(error[f]) / total);
  }
  return curve;
}

}  // namespace

Curve visibility_curve(Effort effort) {
  return visibility_errors(effort, false);
}

Curve sphere_visibility_curve(Effort effort) {
  return visibility_errors(effort, true);
}

}  // namespace heddle::stability
