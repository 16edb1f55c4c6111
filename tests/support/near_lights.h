#ifndef HEDDLE_TESTS_SUPPORT_NEAR_LIGHTS_H_
#define HEDDLE_TESTS_SUPPORT_NEAR_LIGHTS_H_
// Lights at a finite distance.

#include "render/lights.h"

namespace heddle::test {

inline Light point_light(const Vec3d& position, const Rgb& irradiance_at_1_m) {
  Light light;
  light.type = LightType::kPoint;
  light.position_mm = position;
  light.irradiance = irradiance_at_1_m;
  return light;
}

inline Light sphere_light(const Vec3d& position, double radius, const Rgb& radiance) {
  Light light = point_light(position, radiance);
  light.type = LightType::kSphere;
  light.radius_mm = radius;
  return light;
}

/// Shines along `normal`.
inline Light rectangle_light(const Vec3d& position, const Vec3d& normal, const Vec3d& up,
                             double width, double height, const Rgb& radiance) {
  Light light = point_light(position, radiance);
  light.type = LightType::kRectangle;
  light.axis = normal.normalized().cast<float>();
  const Vec3d right = up.cross(normal).normalized();
  light.half_right_mm = 0.5 * width * right;
  light.half_up_mm = 0.5 * height * normal.normalized().cross(right);
  light.gaussians = 16;
  return light;
}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_SUPPORT_NEAR_LIGHTS_H_
