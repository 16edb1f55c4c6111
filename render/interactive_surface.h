#ifndef HEDDLE_RENDER_INTERACTIVE_SURFACE_H_
#define HEDDLE_RENDER_INTERACTIVE_SURFACE_H_
// A surface cloth that is shaded without rays: the interactive microcylinder
// (surface/interactive_microcylinder.h) in a scene. What a point sees is interpolated between the
// vertices of its triangle, so shadows are as sharp as the mesh is fine. The model has one face,
// shown on both sides; each side has maps of its own. Tested in
// tests/render/interactive_surface_test.cpp.

#include <functional>
#include <memory>
#include <span>

#include "render/cloth_scene.h"
#include "render/lights.h"
#include "render/surface/distance_maps.h"
#include "render/surface/interactive_microcylinder.h"
#include "render/surface_cloth.h"

namespace heddle {

/// What the vertices of a scene's surface cloth see from one side, past all shells (as solids) and
/// meshes. vertex_done: see DistanceMaps.
DistanceMaps bake_distance_maps(const ClothScene& scene, const SurfaceCloth& surface,
                                ClothSide side, const std::function<void()>& vertex_done = {});

class InteractiveSurface {
 public:
  /// Maps of the same surface, [vertex] each.
  InteractiveSurface(std::shared_ptr<const InteractiveMicrocylinder> model,
                     std::shared_ptr<const DistanceMaps> face,
                     std::shared_ptr<const DistanceMaps> back);

  /// Radiance that leaves the hit towards `wo` (world) of light that arrives straight from
  /// directional and Gaussian lights.
  Rgb light(const SurfaceHit& hit, const Vec3& wo, std::span<const Light> lights) const;

 private:
  std::shared_ptr<const InteractiveMicrocylinder> model_;
  std::shared_ptr<const DistanceMaps> face_;
  std::shared_ptr<const DistanceMaps> back_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_INTERACTIVE_SURFACE_H_
