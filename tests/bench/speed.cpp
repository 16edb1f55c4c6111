// How fast is each part, against limits measured in the same run and on the same tile? One thread
// throughout, so that a rate is per core; only the equal-error comparison at the end uses all
// threads (for both sides alike).
//
//   heddle_speed FABRIC.toml SCENE.toml [--cache DIR] [--picture 96x72] [--reference-spp N]
//
// Raw rates are Embree alone: one copy of the tile, no own fiber, no march from tile to tile.
// Shares are of those. Equal error: with the scene's first view at a small size, the samples that
// each method needs for 10 % relative RMSE per pixel follow from the variance it states and, for
// the fast method, from its bias against the local reference:
//   N_path = var_path / 0.1^2,   N_fast = var_fast / (0.1^2 - bias^2),
// bias^2 the mean of (F0 - R0)(F1 - R1) over pixels, all relative to the mean of the reference,
// pixels full of cloth only.

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/sampling.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/segment_origins.h"
#include "fibers/tracing/tile_trace.h"
#include "pipeline/job.h"
#include "pipeline/scene_job.h"
#include "pipeline/stages.h"
#include "precompute/sg_fit.h"
#include "precompute/ssdf_fit.h"
#include "precompute/transfer_bake.h"
#include "precompute/visibility_maps.h"
#include "render/cloth_scene.h"
#include "render/precomputed_renderer.h"

namespace heddle {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Runs f() and returns its seconds.
template <class F>
double timed(F&& f) {
  const Clock::time_point start = Clock::now();
  f();
  return seconds_since(start);
}

// The tile's segments alone in an Embree scene.
class RawTile {
 public:
  explicit RawTile(const Exemplar& exemplar)
      : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, exemplar.points.size()));
    for (std::uint32_t f = 0; f < exemplar.fiber_count(); ++f) {
      for (std::uint32_t p = exemplar.first_point[f]; p < exemplar.first_point[f + 1]; ++p) {
        for (int axis = 0; axis < 3; ++axis) vertices[4 * p + axis] = exemplar.points[p][axis];
        vertices[4 * p + 3] = exemplar.radius_mm[f];
      }
    }
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, 4,
                                            exemplar.segment_count());
    std::memcpy(indices, exemplar.segment_point.data(), 4 * exemplar.segment_count());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    rtcInitIntersectContext(&context_);
  }
  ~RawTile() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  RawTile(const RawTile&) = delete;
  RawTile& operator=(const RawTile&) = delete;

  bool occluded(const Ray& ray) {
    RTCRay r = embree_ray(ray);
    rtcOccluded1(scene_, &context_, &r);
    return r.tfar < 0;
  }
  bool intersect(const Ray& ray) {
    RTCRayHit r;
    r.ray = embree_ray(ray);
    r.hit.geomID = r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context_, &r);
    return r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }

 private:
  static RTCRay embree_ray(const Ray& ray) {
    return {ray.origin.x(),
            ray.origin.y(),
            ray.origin.z(),
            ray.t_min,
            ray.direction.x(),
            ray.direction.y(),
            ray.direction.z(),
            0,
            ray.t_max,
            0xffffffffU,
            0,
            0};
  }
  RTCDevice device_;
  RTCScene scene_;
  RTCIntersectContext context_;
};

struct Rates {
  double raw_occlusion = 0;  // rays/s, one core
  double raw_intersection = 0;
};

// Rays as the stages shoot them: from segment origins, uniform over the sky; and as an eye does,
// from above.
Rates ray_rates(const TileScene& tile, const SegmentOrigins& origins) {
  constexpr int kRays = 400000;
  const Exemplar& exemplar = tile.exemplar();
  std::vector<Ray> local;
  std::vector<Ray> eye;
  std::vector<std::uint32_t> fiber;
  for (int i = 0; i < kRays; ++i) {
    RandomStream random(1, RandomStage::kBench, 1, static_cast<std::uint64_t>(i));
    const std::uint32_t s = random.index(exemplar.segment_count());
    local.push_back({origins.position[s], sample_hemisphere(Vec3(0, 0, 1), random)});
    fiber.push_back(exemplar.segment_fiber[s]);
    const Vec3 target(random.uniform() * exemplar.width_mm, random.uniform() * exemplar.height_mm,
                      0);
    const Vec3 up = sample_hemisphere(Vec3(0, 0, 1), random);
    eye.push_back({target + up, -up});
  }
  RawTile raw(exemplar);
  int sink = 0;
  const auto rate = [&](auto&& query) {
    return kRays / timed([&] {
             for (std::size_t i = 0; i < kRays; ++i) sink += query(i) ? 1 : 0;
           });
  };
  Rates rates;
  rates.raw_occlusion = rate([&](std::size_t i) { return raw.occluded(local[i]); });
  rates.raw_intersection = rate([&](std::size_t i) { return raw.intersect(local[i]); });
  const double raw_eye = rate([&](std::size_t i) { return raw.intersect(eye[i]); });
  const double tile_occlusion =
      rate([&](std::size_t i) { return tile.occluded(local[i], fiber[i]); });
  const double tile_intersection =
      rate([&](std::size_t i) { return tile.intersect(local[i], fiber[i]).has_value(); });
  const double tile_eye =
      rate([&](std::size_t i) { return tile.intersect(eye[i], kNoFiber).has_value(); });
  fmt::print("rays, million per core-second             raw Embree   endless tile   share\n");
  const auto row = [](const char* name, double a, double b) {
    fmt::print("  {:38} {:10.2f} {:14.2f} {:6.0f} %\n", name, a / 1e6, b / 1e6, 100 * b / a);
  };
  row("occlusion, from segments to the sky", rates.raw_occlusion, tile_occlusion);
  row("intersection, from segments", rates.raw_intersection, tile_intersection);
  row("intersection, from the eye", raw_eye, tile_eye);
  if (sink == 0) fmt::print("no ray hit\n");
  return rates;
}

void visibility_cost(const TileScene& tile, const SegmentOrigins& origins,
                     const FabricDocument& fabric, const Rates& rates) {
  const auto segments = static_cast<std::uint32_t>(tile.exemplar().segment_count());
  const std::uint32_t count = std::min<std::uint32_t>(segments, 6000);
  VisibilityMaps maps;
  // A run from the middle of each yarn system's share of the segments.
  const double trace = timed([&] {
    maps = bake_visibility_maps(tile, origins, fabric.config.light_from_both_sides, 0, count);
  });
  const double origin = timed([&] {
    find_segment_origins(tile, fabric.config.light_from_both_sides, OriginChoice::kExposed, 1);
  });
  SsdfVisibility ssdf;
  SgVisibility sgs;
  const double ssdf_seconds = timed([&] { ssdf = fit_ssdf(maps, fabric.visibility); });
  const double sg_seconds = timed([&] { sgs = fit_sgs(maps, fabric.visibility); });
  std::size_t blind = 0;
  for (const std::uint8_t flag : maps.sees_nothing) blind += flag;
  const double n = count;
  const double total = 1e3 * ((trace + ssdf_seconds + sg_seconds) / n + origin / segments);
  const double rays = fabric.config.light_from_both_sides ? 16384 : 8192;
  fmt::print(
      "visibility, core-ms per segment: origins {:.2f}, maps {:.2f}, signed distances {:.2f} (with "
      "the components, "
      "once per fabric), Gaussians {:.2f}; total {:.2f} (target 14, paper about 1490)\n",
      1e3 * origin / segments, 1e3 * trace / n, 1e3 * ssdf_seconds / n, 1e3 * sg_seconds / n,
      total);
  fmt::print(
      "  {:.0f} cells per map at the raw occlusion rate would take {:.2f} core-ms: the maps run at "
      "{:.0f} % of it; "
      "{:.0f} % of segments see nothing\n",
      rays, 1e3 * rays / rates.raw_occlusion, 100 * (rays / rates.raw_occlusion) / (trace / n),
      100.0 * static_cast<double>(blind) / n);
}

void transfer_cost(const TileScene& tile, const SegmentOrigins& origins,
                   const FabricDocument& fabric, const Rates& rates) {
  std::vector<BcsdfTable> materials;
  for (const FiberScattering& fiber : tile.exemplar().scattering) materials.emplace_back(fiber);
  TransferSettings settings = fabric.transfer;
  settings.both_sides = fabric.config.light_from_both_sides;
  const auto edge = static_cast<float>(settings.cell_mean_free_paths *
                                       tile.mean_free_path(1, kMeanFreePathSamples));
  const Exemplar& exemplar = tile.exemplar();
  const SegmentCells cells = make_segment_cells(exemplar, origins, edge);
  const TransferBaker baker(tile, materials, origins, settings, cells);
  const std::uint32_t first = cells.count / 2;
  const std::uint32_t last = std::min(first + 40, cells.count);
  TransferChunk chunk;
  const double seconds = timed([&] { chunk = baker.bake(first, last); });
  double paths = 0;
  for (const std::uint32_t p : chunk.paths) paths += p;
  // Rays per path, from the same kind of paths.
  const TileTrace trace(tile);
  constexpr int kPaths = 20000;
  double queries = 0;
  for (int i = 0; i < kPaths; ++i) {
    RandomStream random(1, RandomStage::kBench, 2, static_cast<std::uint64_t>(i));
    const std::uint32_t s = random.index(exemplar.segment_count());
    const Vec3 direction = sample_sphere(random);
    ++queries;
    const auto hit = trace.next(trace.at(origins.position[s], s), direction);
    if (!hit) continue;
    walk_path(trace, materials, *hit, -direction, Rgb::Ones(), random, WalkLimits{},
              [&](auto&&...) {
                ++queries;
                return true;
              });
  }
  const double per_path = queries / kPaths;
  const double matrix_bytes = 4.0 * 3 * std::pow(settings.order + 1, 4);
  fmt::print(
      "transfer: {:.0f} paths per core-second at order {}, {:.1f} rays per path: {:.2f} million "
      "rays/s, {:.0f} % of raw "
      "intersection; {} cells, as many as cubes of {:.0f} um, {:.0f} bytes per matrix\n",
      paths / seconds, settings.order, per_path, per_path * paths / seconds / 1e6,
      100 * per_path * paths / seconds / rates.raw_intersection, cells.count, 1e3 * edge,
      matrix_bytes);
}

const std::vector<float>& channel(const Image& image, const std::string& name) {
  return image.channels.at(name).values;
}

struct PictureCost {
  double relative_variance = 0;  // of one sample
  double seconds_per_sample = 0;
};

void equal_error(const std::string& scene_file, StageContext& context, int width, int height,
                 int reference_spp) {
  SceneJob job(scene_file, context, {});
  PictureRequest request = job.request(job.config().views.front());
  request.camera.width = width;
  request.camera.height = height;
  request.crop = {0, 0, width, height};
  request.seed = 1;
  const auto picture = [&](RenderMethod method, int spp, double& seconds) {
    request.method = method;
    request.local = method == RenderMethod::kPath;
    request.spp = 2;
    job.render(request, "load");  // builds and loads what is missing
    request.spp = spp;
    Image image;
    seconds = timed([&] { image = job.render(request, render_method_name(method)).image; });
    return image;
  };
  const int fast_spp = std::max(64, reference_spp / 4 / 2 * 2);
  double path_seconds = 0;
  double fast_seconds = 0;
  const Image reference = picture(RenderMethod::kPath, reference_spp, path_seconds);
  const Image fast = picture(RenderMethod::kExact, fast_spp, fast_seconds);

  double mean = 0;
  double fast_mean = 0;
  double bias = 0;
  double values = 0;
  PictureCost path{0, path_seconds / (width * height * reference_spp)};
  PictureCost quick{0, fast_seconds / (width * height * fast_spp)};
  const std::vector<float>& alpha = channel(reference, "A");
  for (const char* c : {"R", "G", "B"}) {
    const std::string color = c;
    const auto& r0 = channel(reference, "half0." + color);
    const auto& r1 = channel(reference, "half1." + color);
    const auto& f0 = channel(fast, "half0." + color);
    const auto& f1 = channel(fast, "half1." + color);
    const auto& path_variance = channel(reference, "Variance." + color);
    const auto& fast_variance = channel(fast, "Variance." + color);
    for (std::size_t i = 0; i < alpha.size(); ++i) {
      if (alpha[i] < 0.999F) continue;
      ++values;
      mean += 0.5 * (r0[i] + r1[i]);
      fast_mean += 0.5 * (f0[i] + f1[i]);
      bias += static_cast<double>(f0[i] - r0[i]) * (f1[i] - r1[i]);
      path.relative_variance += static_cast<double>(path_variance[i]) * reference_spp;
      quick.relative_variance += static_cast<double>(fast_variance[i]) * fast_spp;
    }
  }
  mean /= values;
  fast_mean /= values;
  const double bias_squared = std::max(0.0, bias / values) / (mean * mean);
  path.relative_variance /= values * mean * mean;
  quick.relative_variance /= values * mean * mean;
  constexpr double kTarget = 0.1;
  fmt::print("equal error, {} at {} x {}, {} pixels full of cloth, all threads:\n", scene_file,
             width, height, values / 3);
  fmt::print("  path (local): {:.0f} thousand samples/s, relative variance of a sample {:.2f}\n",
             1e-3 / path.seconds_per_sample, path.relative_variance);
  fmt::print(
      "  exact:        {:.0f} thousand samples/s, relative variance of a sample {:.2f}, mean "
      "{:+.2f} % of the "
      "reference, bias floor {:.2f} % per pixel\n",
      1e-3 / quick.seconds_per_sample, quick.relative_variance, 100 * (fast_mean / mean - 1),
      100 * std::sqrt(bias_squared));
  if (bias_squared >= kTarget * kTarget) {
    fmt::print("  the bias floor is above 10 %: no number of samples reaches it\n");
    return;
  }
  const double path_samples = path.relative_variance / (kTarget * kTarget);
  const double fast_samples = quick.relative_variance / (kTarget * kTarget - bias_squared);
  fmt::print(
      "  10 % per pixel: path {:.0f} samples, {:.2f} ms per pixel; exact {:.0f} samples, {:.3f} ms "
      "per pixel: {:.1f} times "
      "faster (target 20)\n",
      path_samples, 1e3 * path_samples * path.seconds_per_sample, fast_samples,
      1e3 * fast_samples * quick.seconds_per_sample,
      path_samples * path.seconds_per_sample / (fast_samples * quick.seconds_per_sample));
}

void renderer_rates(const std::string& scene_file, StageContext& context) {
  SceneJob job(scene_file, context, {});
  PictureRequest request = job.request(job.config().views.front());
  request.camera.width = 160;
  request.camera.height = 120;
  request.crop = {0, 0, 160, 120};
  const SceneConfig& config = job.config();
  std::vector<ClothTiling> tilings;
  for (const ClothConfig& cloth : config.cloths) {
    if (!cloth.surface)
      tilings.push_back(
          std::make_shared<TileScene>(synthesize(read_fabric_document(cloth.fabric, {}).config)));
  }
  const ClothScene scene = make_cloth_scene(config, tilings);
  const Camera camera(request.camera);
  int hits = 0;
  constexpr int kRays = 160 * 120 * 8;
  const double eye = timed([&] {
    for (int i = 0; i < kRays; ++i) {
      RandomStream random(1, RandomStage::kBench, 3, static_cast<std::uint64_t>(i));
      const EyeRay ray =
          camera.ray(i % 160 + random.uniform_double(), i / 160 % 120 + random.uniform_double());
      hits += scene.first_fiber({ray.origin, ray.direction}).has_value() ? 1 : 0;
    }
  });
  fmt::print(
      "renderer, one core, {}: {:.2f} million eye rays/s through the shell ({:.0f} % meet cloth)",
      scene_file, kRays / eye / 1e6, 100.0 * hits / kRays);
  for (const RenderMethod method :
       {RenderMethod::kExact, RenderMethod::kVolume, RenderMethod::kPath}) {
    request.method = method;
    request.local = false;
    request.spp = 2;
    job.render(request, "load");
    request.spp = method == RenderMethod::kPath ? 8 : 32;
    const double seconds = timed([&] { job.render(request, render_method_name(method)); });
    fmt::print("; {} {:.3f} million samples/s", render_method_name(method),
               160.0 * 120 * request.spp / seconds / 1e6);
  }
  fmt::print("\n");
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  using namespace heddle;
  std::string fabric_file;
  std::string scene_file;
  CommonOptions options;
  options.quiet = true;
  int width = 96;
  int height = 72;
  int reference_spp = 256;
  CLI::App app{"rates of every part against limits of the same run"};
  app.add_option("fabric", fabric_file)->required();
  app.add_option("scene", scene_file)->required();
  app.add_option("--cache", options.cache);
  app.add_option("--width", width);
  app.add_option("--height", height);
  app.add_option("--reference-spp", reference_spp);
  CLI11_PARSE(app, argc, argv);
  try {
    Job job(options);
    {
      const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
      const FabricDocument fabric = read_fabric_document(fabric_file, {});
      const TileScene tile(synthesize(fabric.config));
      const SegmentOrigins origins = find_segment_origins(tile, fabric.config.light_from_both_sides,
                                                          OriginChoice::kExposed, 1);
      fmt::print("{}: {} segments\n", fabric_file, tile.exemplar().segment_count());
      const Rates rates = ray_rates(tile, origins);
      visibility_cost(tile, origins, fabric, rates);
      transfer_cost(tile, origins, fabric, rates);
      renderer_rates(scene_file, job.context());
    }
    equal_error(scene_file, job.context(), width, height, reference_spp);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
