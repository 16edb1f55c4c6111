#include "pipeline/plan/view_facts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/accuracy/enclosure.h"
#include "pipeline/plan/policy.h"
#include "render/lights.h"
#include "render/near_lights.h"

namespace heddle {
namespace {

bool sends_light_about(const SceneConfig& scene) {
  return scene.cloths.size() > 1 || !scene.meshes.empty() || scene.cloths[0].mesh;
}

/// Sums over the pixels of one cloth.
struct ClothSums {
  double pixels = 0;
  double light = 0;
  double log_footprint = 0;
  double enclosure_square = 0;
  std::vector<double> facing;  // [light] cosine to the normal, 0 from behind
  std::vector<PixelLight> pixel_lights;
};

/// Adds the lights on the cloth at `hit`, seen along `direction`.
void add_lights(const ClothScene& fibers, const ShellHit& hit, const Vec3& direction,
                const std::vector<Light>& lights, ClothSums& sums) {
  PixelLight& on_pixel = sums.pixel_lights.emplace_back();
  const bool sees_face = fibers.fabric_direction(hit, -direction).z() > 0;
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const SeenLight light = seen_from(lights[l], hit.position);
    const double height = static_cast<double>(fibers.fabric_direction(hit, light.axis).z());
    sums.facing[l] += std::max(0.0, height);
    const bool on_face = height > 0;
    const Shell::SurfacePoint lit =
        fibers.surface_point(hit, on_face ? ClothSide::kFace : ClothSide::kBack);
    const double distance = lights[l].is_near() ? distance_to_light(lights[l], hit.position)
                                                : std::numeric_limits<double>::infinity();
    if (!fibers.globally_visible(lit, light.axis, distance)) continue;
    PixelLight::OnSide& side = on_face ? on_pixel.face : on_pixel.back;
    (on_face == sees_face ? side.seen : side.across) +=
        static_cast<double>(light.irradiance.mean()) * std::abs(height);
  }
}

/// Lights at infinity in place of near ones, as seen from a point.
std::vector<Light> lights_at(const std::vector<Light>& lights, const Vec3d& point) {
  std::vector<Light> result = lights;
  for (Light& light : result) {
    if (!light.is_near()) continue;
    const SeenLight seen = seen_from(light, point);
    light = Light{};
    light.type = seen.is_directional ? LightType::kDirectional : LightType::kSphericalGaussian;
    light.axis = seen.axis;
    light.sharpness = seen.sharpness;
    light.irradiance = seen.irradiance;
  }
  return result;
}

SeenCloth seen_cloth(const ClothSums& sums, const std::vector<Light>& lights, double pilot_pixels,
                     double all_light) {
  SeenCloth seen;
  if (!(sums.pixels > 0)) return seen;
  seen.share = sums.pixels / pilot_pixels;
  seen.light_share = all_light > 0 ? sums.light / all_light : 0;
  seen.footprint_mm = std::exp(sums.log_footprint / sums.pixels);
  seen.enclosure_square = sums.enclosure_square / sums.pixels;
  seen.pixel_lights = sums.pixel_lights;
  double all = 0;
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const double cosine = sums.facing[l] / sums.pixels;
    const double weight =
        static_cast<double>(lights[l].irradiance.mean()) * std::max(kPolicy.least_cosine, cosine);
    const double sharpness = lights[l].is_directional() ? kDirectionalSharpness
                                                        : static_cast<double>(lights[l].sharpness);
    seen.lights.push_back({sharpness, weight, cosine});
    all += weight;
  }
  for (LightShare& light : seen.lights) light.weight = all > 0 ? light.weight / all : 0;
  return seen;
}

}  // namespace

ViewFacts look_at_view(PilotRenderer& renderer, const Pilot& paths) {
  const SceneConfig& scene = renderer.scene();
  ViewFacts view;
  const std::vector<Light> lights = fit_environments(scene.lights).lights;
  view.sends_light_about = sends_light_about(scene);
  std::vector<std::size_t> cloth_of_fibers;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    if (!scene.cloths[k].surface) cloth_of_fibers.push_back(k);
  }
  std::vector<ClothSums> sums(scene.cloths.size());
  for (ClothSums& of_cloth : sums) of_cloth.facing.resize(lights.size());
  const ClothScene& fibers = renderer.fibers_scene();
  const Camera camera(renderer.request().camera);
  double all_light = 0;
  Vec3d middle = Vec3d::Zero();
  double hits = 0;
  for (std::size_t b = 0; b < paths.frames.size(); ++b) {
    const PixelRect& block = renderer.blocks()[b];
    for (int k = 0; k < block.width * block.height; ++k) {
      const double light =
          static_cast<double>(paths.frames[b].beauty[static_cast<std::size_t>(k)].mean());
      all_light += light;
      const EyeRay ray =
          camera.ray(block.x0 + k % block.width + 0.5, block.y0 + k / block.width + 0.5);
      const std::optional<ShellHit> hit = fibers.first_fiber({ray.origin, ray.direction});
      if (!hit || fibers.meets_mesh(ray.origin, ray.direction, hit->t)) continue;
      ClothSums& of_cloth = sums[cloth_of_fibers[hit->cloth]];
      middle += hit->position;
      hits += 1;
      of_cloth.pixels += 1;
      of_cloth.light += light;
      of_cloth.log_footprint += std::log(ray.spread * hit->t);
      const double enclosed = view.sends_light_about ? enclosure(fibers, *hit, ray.direction) : 0;
      of_cloth.enclosure_square += enclosed * enclosed;
      add_lights(fibers, *hit, ray.direction, lights, of_cloth);
    }
  }
  view.lights = lights_at(lights, middle / std::max(1.0, hits));
  for (const ClothSums& of_cloth : sums)
    view.cloths.push_back(seen_cloth(of_cloth, view.lights, paths.pixels, all_light));
  return view;
}

}  // namespace heddle
