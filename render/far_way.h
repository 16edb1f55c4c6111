#ifndef HEDDLE_RENDER_FAR_WAY_H_
#define HEDDLE_RENDER_FAR_WAY_H_
// The way of a ray that sees cloth by its far form. Where it passes the mean height of the fibers
// that it would see, a part of it stays there, and the rest goes on through the gaps. Tested in
// tests/render/precomputed_renderer_test.cpp.

#include <span>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/g_buffer.h"

namespace heddle {

/// Where the eye is (fabric space), seen from a place that shows its far form. to_eye: world.
Vec3 far_direction(const ClothScene& scene, const ShellHit& hit, const Vec3& to_eye);

class FarWay {
 public:
  /// far_from: repeats of a fabric in the footprint of the ray from which nothing but its far form
  /// is seen; 0: it always is. Of less than half as many nothing of it is seen; between, it is
  /// where `draw`, from 0 to 1, says so. packs: [part of the scene], with far forms. All that is
  /// passed outlives the object.
  FarWay(const ClothScene& scene, std::span<const FabricPack* const> packs, float far_from,
         const EyeRay& ray, float draw)
      : scene_(&scene), packs_(packs), far_from_(far_from), ray_(&ray), draw_(draw) {}

  /// For ClothScene::first_hit.
  ClothScene::Passing pass(std::uint32_t cloth, const ShellInterval& interval);

  struct Stop {
    ShellHit hit;  // of no segment
    Vec3 wo;       // fabric space
    float weight;  // share of the ray
  };
  const std::vector<Stop>& stops() const { return stops_; }
  /// Share of the ray that has not stopped.
  float left() const { return left_; }

 private:
  bool sees_far(const FarTable& table, const Vec3& wo, double t) const;

  const ClothScene* scene_;
  std::span<const FabricPack* const> packs_;
  float far_from_;
  const EyeRay* ray_;
  float draw_;
  float left_ = 1;
  std::vector<Stop> stops_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_FAR_WAY_H_
