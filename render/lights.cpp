#include "render/lights.h"

#include <algorithm>

#include "fibers/math/sampling.h"
#include "render/environment_map.h"
#include "render/environment_sgs.h"

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
  switch (light.type) {
    case LightType::kDirectional:
      return 0;
    case LightType::kEnvironment:
      return light.map->pdf(picture_from_world(light, direction));
    case LightType::kSphericalGaussian:
      break;
  }
  return spherical_gaussian_pdf(light.axis, light.sharpness, direction);
}

Rgb light_radiance(const Light& light, const Vec3& direction) {
  if (light.type == LightType::kEnvironment) {
    return light.irradiance * light.map->radiance(picture_from_world(light, direction));
  }
  // The density of sampling is the shape of the light: G / M for both.
  return light.irradiance * light_pdf(light, direction);
}

LightSample sample_light(const Light& light, RandomStream& random) {
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

FittedLights fit_environments(std::span<const Light> lights) {
  FittedLights result;
  for (const Light& light : lights) {
    if (light.type != LightType::kEnvironment) {
      result.lights.push_back(light);
      continue;
    }
    const EnvironmentSgs fit = fit_environment_sgs(*light.map, light.gaussians);
    for (Light gaussian : fit.lights) {
      gaussian.axis = world_from_picture(light, gaussian.axis);
      gaussian.irradiance *= light.irradiance;
      result.lights.push_back(gaussian);
    }
    result.relative_error = std::max(result.relative_error, fit.relative_error);
  }
  return result;
}

}  // namespace heddle
