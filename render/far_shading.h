#ifndef HEDDLE_RENDER_FAR_SHADING_H_
#define HEDDLE_RENDER_FAR_SHADING_H_
// Light that far forms send to the eye under the lights of a scene. Tested in
// tests/render/precomputed_renderer_test.cpp.

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "render/cloth_scene.h"
#include "render/far_form.h"
#include "render/light_visibility.h"
#include "render/lights.h"
#include "render/multiple_scattering.h"

namespace heddle {

class FarShading {
 public:
  /// forms: [part of the scene]. shapes: [light] of those at infinity. What is passed by reference
  /// or as a span outlives the object.
  FarShading(const ClothScene& scene, std::vector<std::shared_ptr<const FarForm>> forms,
             std::span<const Light> lights, std::span<const MultipleScattering::LightShape> shapes,
             const LightShapes& near_shapes)
      : scene_(&scene),
        forms_(std::move(forms)),
        lights_(lights),
        shapes_(shapes),
        near_shapes_(&near_shapes) {}

  struct Radiance {
    Rgb single = Rgb::Zero();
    Rgb multiple = Rgb::Zero();
  };
  /// Towards wo (fabric space) from a place on the cloth that these of the lights reach: [light].
  Radiance under_lights(const ShellHit& hit, const Vec3& wo,
                        std::span<const LightVisibility::OfLight> visible) const;
  /// The same under one light at infinity, which reaches it.
  Radiance under(const ShellHit& hit, const Vec3& wo, const SeenLight& light) const;

 private:
  struct Seen;
  void add(const Seen& seen, const SeenLight& light, const MultipleScattering::LightShape* shape,
           const LightVisibility::OfLight& visible, Radiance& sum) const;

  const ClothScene* scene_;
  std::vector<std::shared_ptr<const FarForm>> forms_;
  std::span<const Light> lights_;
  std::span<const MultipleScattering::LightShape> shapes_;
  const LightShapes* near_shapes_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_FAR_SHADING_H_
