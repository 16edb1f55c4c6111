#include "render/fold_light.h"

#include <vector>

#include "fibers/math/sampling.h"
#include "render/far_way.h"

namespace heddle {

std::optional<SeenLight> FoldLight::at(const ShellHit& hit, int bounces,
                                       RandomStream& random) const {
  const bool both_sides = packs_[hit.part]->light_from_both_sides;
  Vec3 direction = sample_sphere(random);
  ClothSide side = ClothSide::kFace;
  if (!(scene_->fabric_direction(hit, direction).z() > 0)) {
    if (both_sides) {
      side = ClothSide::kBack;
    } else {
      direction = -direction;
    }
  }
  const float density = (both_sides ? 0.25F : 0.5F) / kPif;
  SceneRay scene_ray = ClothScene::ray_from(scene_->surface_point(hit, side), direction);
  const EyeRay ray{scene_ray.origin, direction};
  if (const std::optional<MeshHit> mesh = scene_->first_mesh(ray.origin, direction))
    scene_ray.t_max = mesh->t;
  FarWay way(*scene_, packs_, 0, ray, 0);
  scene_->first_hit(
      scene_ray, RayReach::kEverything,
      [](std::uint32_t, const Ray&, std::uint32_t) { return std::optional<FiberHit>(); },
      [&way](std::uint32_t cloth, const ShellInterval& interval) {
        return way.pass(cloth, interval);
      });
  if (way.stops().empty()) return {};
  Rgb radiance = Rgb::Zero();
  std::vector<LightVisibility::OfLight> visible(light_count_);
  for (const FarWay::Stop& stop : way.stops()) {
    visibility_->at(stop.hit, random, visible);
    const FarShading::Radiance direct = shading_->under_lights(stop.hit, stop.wo, visible);
    radiance += stop.weight * (direct.single + direct.multiple);
    if (bounces == 1) continue;
    const std::optional<SeenLight> further = at(stop.hit, bounces - 1, random);
    if (!further) continue;
    const FarShading::Radiance indirect = shading_->under(stop.hit, stop.wo, *further);
    radiance += stop.weight * (indirect.single + indirect.multiple);
  }
  return SeenLight{direction, kSharpness, radiance / density, false};
}

}  // namespace heddle
