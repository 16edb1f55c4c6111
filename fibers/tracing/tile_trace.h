#ifndef HEDDLE_FIBERS_TRACING_TILE_TRACE_H_
#define HEDDLE_FIBERS_TRACING_TILE_TRACE_H_
// The flat, endless cloth as a Trace for walk_path (fabric space is the space of directions).

#include <cstdint>
#include <limits>
#include <optional>

#include "fibers/tracing/tile_scene.h"

namespace heddle {

class TileTrace {
 public:
  struct Vertex {
    Vec3 position;
    Vec3 tangent;
    std::uint32_t segment;
    std::uint32_t fiber;
    std::uint16_t material;
  };

  explicit TileTrace(const TileScene& scene) : scene_(&scene) {}

  /// First hit of a ray that comes from outside.
  std::optional<Vertex> first(const Vec3& origin, const Vec3& direction) const {
    return query(origin, direction, kNoFiber);
  }
  std::optional<Vertex> next(const Vertex& from, const Vec3& direction) const {
    return query(from.position, direction, from.fiber);
  }
  Vec3d position(const Vertex& vertex) const { return vertex.position.cast<double>(); }
  /// Does a ray meet no fiber within `distance`?
  bool escapes(const Vertex& from, const Vec3& direction,
               double distance = std::numeric_limits<double>::infinity()) const {
    return !scene_->occluded({from.position, direction, 0, static_cast<float>(distance)},
                             from.fiber);
  }
  /// A vertex on a given segment.
  Vertex at(const Vec3& position, std::uint32_t segment) const {
    const Exemplar& exemplar = scene_->exemplar();
    const std::uint32_t fiber = exemplar.segment_fiber[segment];
    return {position, exemplar.segment_tangent(segment), segment, fiber, exemplar.material[fiber]};
  }

 private:
  std::optional<Vertex> query(const Vec3& origin, const Vec3& direction,
                              std::uint32_t own_fiber) const {
    const std::optional<FiberHit> hit = scene_->intersect({origin, direction}, own_fiber);
    if (!hit) return {};
    return at(origin + hit->t * direction, hit->segment);
  }
  const TileScene* scene_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_TILE_TRACE_H_
