#ifndef HEDDLE_RENDER_CLOTH_TRACE_H_
#define HEDDLE_RENDER_CLOTH_TRACE_H_
// Shell-mapped cloth as a Trace for walk_path. Directions and tangents are in world space.
//
// A scattered ray ignores its own fiber until it has left the shell it starts in. Then it may enter
// this shell again or another. A path that may not go on ends at a vertex with `is_end` set: on a
// mesh, or (local) where it would meet cloth again after leaving its shell. So a path escapes
// exactly if its last ray is not occluded. Light found by escaping and light found by shadow rays
// are then the same integral. Tested in tests/render/cloth_trace_test.cpp.

#include <cstdint>
#include <limits>
#include <optional>

#include "render/cloth_scene.h"

namespace heddle {

class ClothTrace {
 public:
  struct Vertex {
    ShellHit hit;
    Vec3 tangent;            // unit, world
    std::uint16_t material;  // index into ClothScene::materials()
    Rgb tint;                // of the yarn
    bool is_end = false;
  };

  /// With `local`, paths end where they leave the shell that they are in.
  ClothTrace(const ClothScene& scene, bool local) : scene_(&scene), local_(local) {}

  Vertex vertex(const ShellHit& hit) const {
    const Exemplar& exemplar = scene_->exemplar(hit.part);
    return {hit, scene_->world_tangent(hit),
            static_cast<std::uint16_t>(scene_->material_offset(hit.part) +
                                       exemplar.segment_material(hit.segment)),
            scene_->tint(hit)};
  }

  std::optional<Vertex> next(const Vertex& from, const Vec3& direction) const {
    const SceneRay ray{from.hit.position, direction, &from.hit};
    const std::optional<ShellHit> hit =
        scene_->first_fiber(ray, local_ ? RayReach::kOwnShell : RayReach::kEverything);
    // The cloth first: most hits are near, and leave little to search for meshes.
    if (!scene_->meets_mesh(ray.origin, direction, hit ? hit->t : ray.t_max)) {
      if (hit) return vertex(*hit);
      if (!local_ || !scene_->occluded(ray)) return {};
    }
    Vertex end = from;
    end.is_end = true;
    return end;
  }

  Vec3d position(const Vertex& vertex) const { return vertex.hit.position; }
  /// Does a ray meet neither fibers nor meshes within `distance`?
  bool escapes(const Vertex& from, const Vec3& direction,
               double distance = std::numeric_limits<double>::infinity()) const {
    return !scene_->occluded({from.hit.position, direction, &from.hit, distance});
  }

 private:
  const ClothScene* scene_;
  bool local_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_CLOTH_TRACE_H_
