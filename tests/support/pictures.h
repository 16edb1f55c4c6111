#ifndef HEDDLE_TESTS_SUPPORT_PICTURES_H_
#define HEDDLE_TESTS_SUPPORT_PICTURES_H_
// Lights and cameras of small pictures.

#include <cmath>

#include "render/camera.h"
#include "render/lights.h"

namespace heddle::test {

inline Light sg_light(const Vec3& axis, float sharpness, const Rgb& irradiance = Rgb(1, 1, 1)) {
  return {LightType::kSphericalGaussian, axis.normalized(), sharpness, irradiance};
}

/// Looks at the origin, where the square picture is `wide` mm; up is y.
inline Camera camera_from(const Vec3d& position, double wide, int pixels) {
  CameraConfig config;
  config.position = position;
  config.up = Vec3d(0, 1, 0);
  config.fov = 2 * std::atan(0.5 * wide / position.norm());
  config.width = config.height = pixels;
  return Camera(config);
}

/// For renderers that report their progress.
inline void no_progress(double) {}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_SUPPORT_PICTURES_H_
