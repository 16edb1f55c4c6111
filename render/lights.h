#ifndef HEDDLE_RENDER_LIGHTS_H_
#define HEDDLE_RENDER_LIGHTS_H_
// Lights at infinity: directional ones, and spherical Gaussians L(w) = irradiance G(w; axis,
// sharpness) / M(sharpness). `irradiance` is the integral of L over all directions, measured
// perpendicular to the axis. Sharpness 0 is constant light from everywhere with L = irradiance / 4
// pi. An environment is a picture of the light from all around (environment_map.h), turned about
// the z axis.
//
// Near lights, at a finite distance in the scene (near_lights.h): points, spheres and rectangles.
// What they send depends on the point that they light. Nothing is hidden by them, and the eye does
// not see them. Tested in tests/render/lights_test.cpp and tests/render/near_lights_test.cpp.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"

namespace heddle {

class EnvironmentMap;
struct RadiancePicture;

enum class LightType : std::uint8_t {
  kDirectional,
  kSphericalGaussian,
  kEnvironment,
  kPoint,
  kSphere,
  kRectangle
};

struct Light {
  LightType type = LightType::kDirectional;
  // unit, towards the light; of an environment, horizontal: where its picture's middle lies; of a
  // rectangle, the normal of the side that shines
  Vec3 axis = Vec3(0, 0, 1);
  float sharpness = 0;  // spherical Gaussians only, >= 0
  // of an environment: factor of the picture's radiance; of a point: irradiance at 1 m; of a sphere
  // or rectangle: radiance, which a texture multiplies
  Rgb irradiance = Rgb(1, 1, 1);
  std::shared_ptr<const EnvironmentMap> map = {};  // environments only
  // what stands for it in precomputed methods: of an environment, the number of spherical
  // Gaussians; of a rectangle, the most parts that it is split into
  int gaussians = 0;
  int bright_sources = 0;  // environments only: at most as many are split off before that

  // Near lights only; world space, mm.
  Vec3d position_mm = Vec3d(0, 0, 0);  // the middle
  double radius_mm = 0;                // spheres only
  // Rectangles only: from the middle to the middle of the right and of the upper side of what one
  // sees from the side that shines.
  Vec3d half_right_mm = Vec3d(0, 0, 0);
  Vec3d half_up_mm = Vec3d(0, 0, 0);
  std::shared_ptr<const RadiancePicture> texture = {};  // rectangles only; may be null

  std::uint16_t group = 0;  // of those whose light is kept apart (SceneConfig::light_groups)

  bool is_directional() const { return type == LightType::kDirectional; }
  bool is_near() const {
    return type == LightType::kPoint || type == LightType::kSphere || type == LightType::kRectangle;
  }
  /// Does it shine from a single direction, which no direction drawn otherwise can meet?
  bool is_delta() const { return is_directional() || type == LightType::kPoint; }
};

/// How light is found: by shadow rays alone, by directions drawn from the scattering alone, or by
/// both, weighted by the power heuristic. Drawn directions never meet a directional or point light.
enum class LightEstimator : std::uint8_t { kShadowRays, kEscapes, kCombined };

/// Radiance from `direction` at infinity; 0 for directional and near lights.
Rgb light_radiance(const Light& light, const Vec3& direction);

struct LightSample {
  Vec3 direction;
  Rgb weight;  // radiance / pdf; the irradiance for a directional or point light
  float pdf;   // 1/sr; 0 for a directional or point light
  // mm to the light; a shadow ray ends there
  double distance = std::numeric_limits<double>::infinity();
};
/// Light that arrives at `point` (world, mm).
LightSample sample_light(const Light& light, const Vec3d& point, RandomStream& random);

/// Density (1/sr) with which sample_light draws `direction`; 0 for directional and near lights.
float light_pdf(const Light& light, const Vec3& direction);

/// A ray that meets a sphere or rectangle.
struct MetLight {
  Rgb radiance;
  float pdf;        // of the direction in sample_light, 1/sr
  double distance;  // mm
};
/// Nothing for lights at infinity and points, and where the light is not met.
std::optional<MetLight> meet_light(const Light& light, const Vec3d& point, const Vec3& direction);

/// The directional or Gaussian light that stands for a light at a point: for near lights, the one
/// of the same irradiance, mean direction and mean cosine to it. Environments have none.
struct SeenLight {
  Vec3 axis;        // unit, towards the light
  float sharpness;  // of a Gaussian
  Rgb irradiance;   // 0 where the light does not shine on the point
  bool is_directional;
};
SeenLight seen_from(const Light& light, const Vec3d& point);

/// Lights for methods that know only directional and Gaussian ones: every environment as the bright
/// sources split off from it and the Gaussians fitted to the rest.
struct FittedLights {
  std::vector<Light> lights;
  // Of the worst environment; 0 without environments (environment_sgs.h).
  double relative_error = 0;    // of the fit to the blurred radiance
  double irradiance_error = 0;  // relative RMS of the irradiance over all normals
  double energy_error = 0;      // relative, of all its light
  int bright_sources = 0;       // split off from all environments
};
FittedLights fit_environments(std::span<const Light> lights);

}  // namespace heddle

#endif  // HEDDLE_RENDER_LIGHTS_H_
