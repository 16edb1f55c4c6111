#include "render/light_visibility.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace heddle {
namespace {

/// Draws after which a light counts as wholly behind the cloth. Of a light with a tenth of its mass
/// in front, 3 % of the draws find none of it.
constexpr int kFaceDraws = 32;

/// Does any of a near light lie above the plane through `point` across `normal` (any length)?
bool rises_above(const Light& light, const Vec3d& point, const Vec3d& normal) {
  const double reach = std::abs(normal.dot(light.half_right_mm)) +
                       std::abs(normal.dot(light.half_up_mm)) + light.radius_mm * normal.norm();
  return normal.dot(light.position_mm - point) + reach > 0;
}

/// Draws kept for each light, so that those of one light are the same ones in every sample: of its
/// direction, of the place along the cloth, and of the direction that a method takes it from.
constexpr std::uint64_t kDrawsPerLight = 6;

Vec2 sample_gaussian2(RandomStream& random) {
  const float radius = std::sqrt(-2 * std::log(1 - random.uniform()));
  const float angle = 2 * kPif * random.uniform();
  return radius * Vec2(std::cos(angle), std::sin(angle));
}

}  // namespace

std::string visibility_text(std::span<const Light> lights) {
  std::string text;
  for (const Light& light : lights) {
    text +=
        fmt::format("{} {:a} {:a}", static_cast<int>(light.type), light.sharpness, light.radius_mm);
    for (const Vec3d& v : {light.axis.cast<double>().eval(), light.position_mm, light.half_right_mm,
                           light.half_up_mm})
      text += fmt::format(" {:a},{:a},{:a}", v.x(), v.y(), v.z());
    // A near light without radiance counts as seen from its dark side.
    text += (light.irradiance == 0).all() ? " dark\n" : "\n";
  }
  return text;
}

LightVisibilityPass::LightVisibilityPass(const ClothScene& scene, std::vector<Part> parts,
                                         std::span<const Light> lights, bool draw_directions,
                                         std::uint64_t seed)
    : scene_(&scene),
      parts_(std::move(parts)),
      lights_(lights),
      draw_directions_(draw_directions),
      seed_(seed) {}

LightVisibility LightVisibilityPass::run(const GBuffer& g_buffer) const {
  const std::size_t count = (g_buffer.fibers.size() + g_buffer.far.size()) * lights_.size();
  LightVisibility result;
  result.lights = lights_.size();
  result.visible.reserve(count);
  if (draw_directions_) result.direction.reserve(count);
  for (const SeenFiber& fiber : g_buffer.fibers) look(g_buffer, fiber.sample, fiber.hit, result);
  for (const SeenFar& far : g_buffer.far) look(g_buffer, far.sample, far.hit, result);
  return result;
}

void LightVisibilityPass::look(const GBuffer& g_buffer, std::uint32_t sample, const ShellHit& hit,
                               LightVisibility& result) const {
  const RandomStream draws = g_buffer.random(seed_, RandomStage::kLightVisibility, sample);
  RandomStream redraw = g_buffer.random(seed_, RandomStage::kLightRedraw, sample);
  for (std::size_t l = 0; l < lights_.size(); ++l) {
    const Light& light = lights_[l];
    RandomStream random = draws;
    random.skip(kDrawsPerLight * l);
    const LightVisibility::OfLight visible = find(hit, light, random, redraw);
    result.visible.push_back(visible);
    if (!draw_directions_) continue;
    result.direction.push_back(
        visible.at_point ? sample_light(light, hit.position, random).direction : Vec3(0, 0, 0));
  }
}

void LightVisibilityPass::at(const ShellHit& hit, RandomStream& random,
                             std::span<LightVisibility::OfLight> visible) const {
  for (std::size_t l = 0; l < lights_.size(); ++l)
    visible[l] = find(hit, lights_[l], random, random);
}

LightVisibility::OfLight LightVisibilityPass::find(const ShellHit& hit, const Light& light,
                                                   RandomStream& random,
                                                   RandomStream& redraw) const {
  const Part& part = parts_[hit.part];
  if (light.is_near() && !part.light_from_both_sides) {
    const Vec3d up = scene_->shell(hit.cloth).fabric_from_world(hit.tet).row(2).cast<double>();
    if (!rises_above(light, hit.position, up)) return {};
  }
  Vec3 direction = light.axis;
  double distance = std::numeric_limits<double>::infinity();
  float height = 0;
  for (int draw = 0; draw < kFaceDraws; ++draw) {
    if (!light.is_directional()) {
      const LightSample sample = sample_light(light, hit.position, draw == 0 ? random : redraw);
      if (light.is_near() && (sample.weight == 0).all()) return {};  // on its dark side
      direction = sample.direction;
      distance = sample.distance;
    }
    height = scene_->fabric_direction(hit, direction).z();
    if (part.light_from_both_sides || height > 0 || light.is_delta()) break;
  }
  if (!part.light_from_both_sides && !(height > 0)) return {};
  const ClothSide side = height > 0 ? ClothSide::kFace : ClothSide::kBack;

  // Rays to near lights end at the point that was drawn there, wherever they start.
  const auto open = [&](const Shell::SurfacePoint& from) {
    if (!light.is_near()) return scene_->globally_visible(from, direction);
    const Vec3d way = hit.position + distance * direction.cast<double>() - from.position;
    return scene_->globally_visible(from, way.normalized().cast<float>(), way.norm());
  };
  LightVisibility::OfLight result;
  result.at_point = open(scene_->surface_point(hit, side));
  const Eigen::Vector2d moved =
      hit.fabric.head<2>() + part.shadow_sigma_mm * sample_gaussian2(random).cast<double>();
  const std::optional<Shell::SurfacePoint> nearby = scene_->surface_point(hit, moved, side);
  // Beyond a rim there is no cloth to take light from.
  result.nearby = nearby ? open(*nearby) : result.at_point;
  return result;
}

}  // namespace heddle
