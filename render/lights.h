#ifndef HEDDLE_RENDER_LIGHTS_H_
#define HEDDLE_RENDER_LIGHTS_H_
// Lights at infinity: directional ones, and spherical Gaussians L(w) = irradiance G(w; axis,
// sharpness) / M(sharpness). `irradiance` is the integral of L over all directions, measured
// perpendicular to the axis. Sharpness 0 is constant light from everywhere with L = irradiance / 4
// pi. An environment is a picture of the light from all around (environment_map.h), turned about
// the z axis. Tested in tests/render/lights_test.cpp.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"

namespace heddle {

class EnvironmentMap;

enum class LightType : std::uint8_t { kDirectional, kSphericalGaussian, kEnvironment };

struct Light {
  LightType type = LightType::kDirectional;
  // unit, towards the light; of an environment, horizontal: where its picture's middle lies
  Vec3 axis = Vec3(0, 0, 1);
  float sharpness = 0;            // spherical Gaussians only, >= 0
  Rgb irradiance = Rgb(1, 1, 1);  // of an environment: factor of the picture's radiance
  std::shared_ptr<const EnvironmentMap> map = {};  // environments only
  // environments only: spherical Gaussians that stand for it in precomputed methods
  int gaussians = 0;

  bool is_directional() const { return type == LightType::kDirectional; }
};

/// How light is found: by shadow rays alone, by directions drawn from the scattering alone, or by
/// both, weighted by the power heuristic. Drawn directions never meet a directional light.
enum class LightEstimator : std::uint8_t { kShadowRays, kEscapes, kCombined };

/// Radiance from `direction`; 0 for directional lights, which no direction drawn otherwise can
/// meet.
Rgb light_radiance(const Light& light, const Vec3& direction);

struct LightSample {
  Vec3 direction;
  Rgb weight;  // radiance / pdf; the irradiance for a directional light
  float pdf;   // 1/sr; 0 for a directional light
};
LightSample sample_light(const Light& light, RandomStream& random);

/// Density (1/sr) with which sample_light draws `direction`; 0 for directional lights.
float light_pdf(const Light& light, const Vec3& direction);

/// Lights for methods that know only directional and Gaussian ones: every environment as the
/// Gaussians fitted to it. relative_error is that of the worst fit (environment_sgs.h), 0 without
/// environments.
struct FittedLights {
  std::vector<Light> lights;
  double relative_error = 0;
};
FittedLights fit_environments(std::span<const Light> lights);

}  // namespace heddle

#endif  // HEDDLE_RENDER_LIGHTS_H_
