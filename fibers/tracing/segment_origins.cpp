#include "fibers/tracing/segment_origins.h"

#include <tbb/parallel_for.h>

#include <cmath>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

// Points on the surface of a segment, and rays from each: 288 rays, 2 % of a visibility map's.
constexpr int kStations = 3;
constexpr int kAzimuths = 12;
constexpr int kRays = 8;

}  // namespace

SegmentOrigins find_segment_origins(const TileScene& scene, bool both_sides, OriginChoice choice,
                                    std::uint64_t seed) {
  const Exemplar& exemplar = scene.exemplar();
  SegmentOrigins origins;
  origins.position.resize(exemplar.segment_count());
  origins.openness.resize(exemplar.segment_count());
  tbb::parallel_for(std::size_t{0}, exemplar.segment_count(), [&](std::size_t i) {
    const auto segment = static_cast<std::uint32_t>(i);
    const std::uint32_t fiber = exemplar.segment_fiber[segment];
    const float radius = exemplar.radius_mm[fiber];
    const Vec3 start = exemplar.points[exemplar.segment_point[segment]];
    const Vec3 along = exemplar.points[exemplar.segment_point[segment] + 1] - start;
    const Mat3 frame = frame_about(along.normalized());
    RandomStream random(seed, RandomStage::kOpenness, segment, 0);
    Vec3 exposed = Vec3::Zero();  // surface normals weighted by what open sky lies before them
    float seen = 0;
    float possible = 0;
    for (int station = 0; station < kStations; ++station) {
      for (int k = 0; k < kAzimuths; ++k) {
        const float azimuth = 2 * kPif * (static_cast<float>(k) + random.uniform()) / kAzimuths;
        const Vec3 normal = frame * Vec3(0, std::cos(azimuth), std::sin(azimuth));
        const Vec3 point = start +
                           (static_cast<float>(station) + random.uniform()) / kStations * along +
                           radius * normal;
        for (int ray = 0; ray < kRays; ++ray) {
          const Vec3 sky =
              both_sides ? sample_sphere(random) : sample_hemisphere(Vec3(0, 0, 1), random);
          const float cosine = normal.dot(sky);
          if (cosine <= 0) continue;
          possible += cosine;
          if (scene.occluded({point, sky}, fiber)) continue;
          seen += cosine;
          exposed += cosine * normal;
        }
      }
    }
    origins.openness[i] = possible > 0 ? seen / possible : 0;
    origins.position[i] = exemplar.segment_midpoint(segment);
    const Vec3 across = exposed - exposed.dot(frame.col(0)) * frame.col(0);
    if (choice == OriginChoice::kExposed && across.norm() > 0)
      origins.position[i] += kExposedDepth * radius * across.normalized();
  });
  return origins;
}

}  // namespace heddle
