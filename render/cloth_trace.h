#ifndef HEDDLE_RENDER_CLOTH_TRACE_H_
#define HEDDLE_RENDER_CLOTH_TRACE_H_
// Shell-mapped cloth as a Trace for walk_path. Directions and tangents are in world space.
//
// A scattered ray ignores its own fiber until it has left the shell it starts in. Then it may enter
// this shell again or another, or meet a coloured mesh, from which it goes on. A path that may not
// go on ends at a vertex with `is_end` set: on any other mesh, or (local) on a coloured one too,
// and where it would meet cloth again after leaving its shell. So a path escapes exactly if its
// last ray is not occluded. Light found by escaping and light found by shadow rays are then the
// same integral. Tested in tests/render/cloth_trace_test.cpp.

#include <cstdint>
#include <limits>
#include <optional>

#include "fibers/math/random.h"
#include "fibers/tracing/path_walk.h"
#include "render/cloth_scene.h"

namespace heddle {

class ClothTrace {
 public:
  struct Vertex {
    ShellHit hit;            // of a fiber
    Vec3 tangent;            // unit, world
    std::uint16_t material;  // index into ClothScene::materials()
    Rgb tint;                // of the yarn
    bool is_end = false;
    std::optional<SurfaceHit> surface = {};  // on a coloured mesh instead
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
  static Vertex vertex(const SurfaceHit& hit) {
    return {{}, Vec3(1, 0, 0), 0, Rgb::Ones(), false, hit};
  }

  std::optional<Vertex> next(const Vertex& from, const Vec3& direction) const {
    const SceneRay ray = ray_from(from, direction);
    const std::optional<ShellHit> hit =
        scene_->first_fiber(ray, local_ ? RayReach::kOwnShell : RayReach::kEverything);
    const double reach = hit ? hit->t : ray.t_max;
    // The cloth first: most hits are near, and leave little to search for meshes.
    if (scene_->has_solids() && !local_) {
      const std::optional<MeshHit> mesh = scene_->first_mesh(ray.origin, direction, reach);
      if (!mesh) return hit ? std::optional(vertex(*hit)) : std::nullopt;
      if (mesh->surface != nullptr && mesh->surface->is_solid())
        return vertex(mesh->surface->hit(mesh->triangle, mesh->u, mesh->v, direction, 0));
    } else if (!scene_->meets_mesh(ray.origin, direction, reach)) {
      if (hit) return vertex(*hit);
      if (!local_ || !scene_->occluded(ray)) return {};
    }
    Vertex end = from;
    end.is_end = true;
    return end;
  }

  /// At a coloured mesh.
  static std::optional<WalkStep> scatter(const Vertex& from, const Vec3& wo, RandomStream& random) {
    const SurfaceHit& at = *from.surface;
    const Vec3d local_out = at.world_from_patch.transpose() * wo.cast<double>();
    const std::optional<SurfaceSample> sample =
        at.model->sample(at.point, local_out.cast<float>(), random);
    if (!sample) return {};
    const Vec3d wi = at.world_from_patch * sample->wi.cast<double>();
    return WalkStep{wi.cast<float>(), sample->weight, sample->pdf};
  }

  Vec3d position(const Vertex& vertex) const {
    return vertex.surface ? vertex.surface->position : vertex.hit.position;
  }
  /// Does a ray meet neither fibers nor meshes within `distance`?
  bool escapes(const Vertex& from, const Vec3& direction,
               double distance = std::numeric_limits<double>::infinity()) const {
    return !scene_->occluded(ray_from(from, direction, distance));
  }

 private:
  static SceneRay ray_from(const Vertex& from, const Vec3& direction,
                           double distance = std::numeric_limits<double>::infinity()) {
    if (from.surface)
      return ClothScene::ray_from({from.surface->position, from.surface->normal}, direction,
                                  distance);
    return {from.hit.position, direction, &from.hit, distance};
  }

  const ClothScene* scene_;
  bool local_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_CLOTH_TRACE_H_
