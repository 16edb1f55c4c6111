#include "render/lights.h"

#include <algorithm>

#include "fibers/math/sampling.h"
#include "render/environment_map.h"
#include "render/environment_sgs.h"
#include "render/near_lights.h"

namespace heddle {
namespace {

/// An environment's picture is turned by the angle of its axis about z.
Vec3 world_from_picture(const Light& light, const Vec3& d) {
  return {light.axis.x() * d.x() - light.axis.y() * d.y(),
          light.axis.y() * d.x() + light.axis.x() * d.y(), d.z()};
}
Vec3 picture_from_world(const Light& light, const Vec3& d) {
  return {light.axis.x() * d.x() + light.axis.y() * d.y(),
          light.axis.x() * d.y() - light.axis.y() * d.x(), d.z()};
}

}  // namespace

float light_pdf(const Light& light, const Vec3& direction) {
  if (light.is_directional() || light.is_near()) return 0;
  if (light.type == LightType::kEnvironment)
    return light.map->pdf(picture_from_world(light, direction));
  return spherical_gaussian_pdf(light.axis, light.sharpness, direction);
}

Rgb light_radiance(const Light& light, const Vec3& direction) {
  if (light.type == LightType::kEnvironment) {
    return light.irradiance * light.map->radiance(picture_from_world(light, direction));
  }
  // The density of sampling is the shape of the light: G / M for both.
  return light.irradiance * light_pdf(light, direction);
}

LightSample sample_light(const Light& light, const Vec3d& point, RandomStream& random) {
  if (light.is_near()) return sample_near_light(light, point, random);
  if (light.is_directional()) return {light.axis, light.irradiance, 0.0F};
  if (light.type == LightType::kEnvironment) {
    LightSample sample = light.map->sample(random);
    sample.direction = world_from_picture(light, sample.direction);
    sample.weight *= light.irradiance;
    return sample;
  }
  const Vec3 direction = sample_spherical_gaussian(light.axis, light.sharpness, random);
  return {direction, light.irradiance, light_pdf(light, direction)};
}

std::optional<MetLight> meet_light(const Light& light, const Vec3d& point, const Vec3& direction) {
  if (!light.is_near()) return {};
  return meet_near_light(light, point, direction);
}

SeenLight seen_from(const Light& light, const Vec3d& point) {
  if (light.is_near()) return near_light_from(light, point);
  return {light.axis, light.sharpness, light.irradiance, light.is_directional()};
}

FittedLights fit_environments(std::span<const Light> lights) {
  FittedLights result;
  for (const Light& light : lights) {
    if (light.type != LightType::kEnvironment) {
      result.lights.push_back(light);
      continue;
    }
    const EnvironmentSgs fit =
        fit_environment_sgs(*light.map, light.gaussians, light.bright_sources);
    for (Light gaussian : fit.lights) {
      gaussian.axis = world_from_picture(light, gaussian.axis);
      gaussian.irradiance *= light.irradiance;
      result.lights.push_back(gaussian);
    }
    result.relative_error = std::max(result.relative_error, fit.relative_error);
    result.irradiance_error = std::max(result.irradiance_error, fit.irradiance_error);
    result.energy_error = std::max(result.energy_error, fit.energy_error);
    result.bright_sources += fit.bright_sources;
  }
  return result;
}

}  // namespace heddle
