#include "render/camera.h"

#include <fmt/format.h>

#include <cmath>

namespace heddle {

Camera::Camera(const CameraConfig& config)
    : position_(config.position), width_(config.width), height_(config.height) {
  forward_ = (config.look_at - config.position).normalized();
  right_ = forward_.cross(config.up).normalized();
  up_ = right_.cross(forward_);
  const double tan_half = std::tan(0.5 * config.fov);
  const double aspect = static_cast<double>(width_) / height_;
  const bool horizontal = config.fov_axis == FovAxis::kHorizontal;
  tan_x_ = horizontal ? tan_half : tan_half * aspect;
  tan_y_ = horizontal ? tan_half / aspect : tan_half;
}

EyeRay Camera::ray(double x, double y) const {
  const double across = (2.0 * x / width_ - 1.0) * tan_x_;
  const double above = (1.0 - 2.0 * y / height_) * tan_y_;
  const Vec3d direction = (forward_ + across * right_ + above * up_).normalized();
  return {position_, direction.cast<float>(), pixel_size(direction.dot(forward_))};
}

bool Camera::may_see(const Vec3d& middle, double radius) const {
  const Vec3d offset = middle - position_;
  const double z = offset.dot(forward_);
  const auto reaches = [&](const Vec3d& axis, double tangent) {
    return std::abs(offset.dot(axis)) - z * tangent <= radius * std::hypot(1.0, tangent);
  };
  return z >= -radius && reaches(right_, tan_x_) && reaches(up_, tan_y_);
}

std::string Camera::world_to_camera_text() const {
  std::string text;
  for (const Vec3d& axis : {right_, up_, Vec3d(-forward_)}) {
    text += fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} ", axis.x(), axis.y(), axis.z(),
                        -axis.dot(position_));
  }
  return text + "0 0 0 1";
}

}  // namespace heddle
