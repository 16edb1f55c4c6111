#ifndef HEDDLE_RENDER_FOLD_LIGHT_H_
#define HEDDLE_RENDER_FOLD_LIGHT_H_
// Light between folds: what other cloth, or other folds of the same one, send to a point. One
// direction is drawn there, uniformly over the side from which the fabric takes light. A ray that
// way meets cloth, whose far form under the scene's lights says what it sends back; what reaches
// that cloth from further cloth is found in the same way, up to a number of bounces. What arrives
// then acts as a narrow Gaussian light about that direction. Black meshes send nothing. Tested in
// tests/render/precomputed_renderer_test.cpp.

#include <optional>
#include <span>

#include "fibers/baked/fabric_pack.h"
#include "fibers/math/random.h"
#include "render/cloth_scene.h"
#include "render/far_shading.h"
#include "render/light_visibility.h"
#include "render/lights.h"

namespace heddle {

class FoldLight {
 public:
  /// packs: [part of the scene], with far forms. What is passed outlives the object.
  FoldLight(const ClothScene& scene, std::span<const FabricPack* const> packs,
            const FarShading& shading, const LightVisibilityPass& visibility,
            std::size_t light_count)
      : scene_(&scene),
        packs_(packs),
        shading_(&shading),
        visibility_(&visibility),
        light_count_(light_count) {}

  /// Sharpness of the Gaussian that stands for a ray's direction: 10 degrees. Fibers scatter into
  /// narrow lobes, and a single direction would be seen as sparks.
  static constexpr float kSharpness = 32;

  /// Light that arrives at a hit from one direction drawn there: an estimate of all of it. Nothing
  /// where the ray meets no cloth. bounces >= 1.
  std::optional<SeenLight> at(const ShellHit& hit, int bounces, RandomStream& random) const;

 private:
  const ClothScene* scene_;
  std::span<const FabricPack* const> packs_;
  const FarShading* shading_;
  const LightVisibilityPass* visibility_;
  std::size_t light_count_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_FOLD_LIGHT_H_
