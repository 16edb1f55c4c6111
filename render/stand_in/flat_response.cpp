#include "render/stand_in/flat_response.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fibers/math/random.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/tile_trace.h"

namespace heddle {
namespace {

/// Adds what a path brings back from every light, by shadow rays at each of its vertices.
void add_path(const TileTrace& trace, std::span<const BcsdfTable> materials,
              const TileTrace::Vertex& hit, const FlatResponse& response, const Vec3& wo,
              RandomStream& random, std::span<Rgbd> sums) {
  walk_path(trace, materials, hit, wo, Rgb(1, 1, 1), random, WalkLimits{},
            [&](const TileTrace::Vertex& vertex, const Mat3& frame, const Vec3& out,
                const Rgb& throughput, int) {
              const Vec3 local_out = frame.transpose() * out;
              for (std::size_t l = 0; l < response.lights.size(); ++l) {
                const Vec3& light = response.lights[l];
                if (!trace.escapes(vertex, light)) continue;
                const Vec3 local_in = frame.transpose() * light;
                const float cosine = std::sqrt(std::max(0.0F, 1 - local_in.x() * local_in.x()));
                sums[l] +=
                    (throughput * cosine * materials[vertex.material].evaluate(local_in, local_out))
                        .cast<double>();
              }
              return true;
            });
}

}  // namespace

FlatResponse trace_flat_response(const TileScene& scene, std::span<const BcsdfTable> materials,
                                 std::vector<Vec3> views, std::vector<Vec3> lights, int rays,
                                 std::uint64_t seed, const std::function<void(double)>& progress) {
  FlatResponse response{std::move(views), std::move(lights), {}};
  const std::size_t per_view = response.lights.size();
  response.radiance.resize(response.views.size() * per_view, {Rgbd::Zero(), Rgbd::Zero()});
  const Exemplar& exemplar = scene.exemplar();
  const TileTrace trace(scene);
  const int strata = std::max(1, static_cast<int>(std::lround(std::sqrt(rays / 2.0))));
  constexpr std::size_t kViewsPerReport = 4;
  for (std::size_t first = 0; first < response.views.size(); first += kViewsPerReport) {
    progress(static_cast<double>(first) / static_cast<double>(response.views.size()));
    const std::size_t end = std::min(response.views.size(), first + kViewsPerReport);
    tbb::parallel_for(2 * first, 2 * end, [&](std::size_t item) {
      const std::size_t view = item / 2;
      const Vec3& wo = response.views[view];
      std::vector<Rgbd> sums(per_view, Rgbd::Zero());
      for (int i = 0; i < strata * strata; ++i) {
        RandomStream random(seed, RandomStage::kFlatResponse, item, static_cast<std::uint64_t>(i));
        const float x =
            (static_cast<float>(i % strata) + random.uniform()) / static_cast<float>(strata);
        const float y =
            (static_cast<float>(i / strata) + random.uniform()) / static_cast<float>(strata);
        const Vec3 origin(x * exemplar.width_mm, y * exemplar.height_mm, exemplar.z_max);
        if (const auto hit = trace.first(origin, -wo))
          add_path(trace, materials, *hit, response, wo, random, sums);
      }
      for (std::size_t l = 0; l < per_view; ++l)
        response.radiance[view * per_view + l][item % 2] = sums[l] / (strata * strata);
    });
  }
  progress(1);
  return response;
}

std::vector<Vec3> cap_directions(int count, double most_degrees, double turn) {
  std::vector<Vec3> directions;
  const double lowest = std::cos(radians(most_degrees));
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (1 - lowest) * (k + 0.5) / count;
    const double across = std::sqrt(1 - z * z);
    const double azimuth = kPi * (3 - std::sqrt(5.0)) * k + turn;
    directions.push_back(
        Vec3d(across * std::cos(azimuth), across * std::sin(azimuth), z).cast<float>());
  }
  return directions;
}

}  // namespace heddle
