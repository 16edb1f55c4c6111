#ifndef HEDDLE_RENDER_CAMERA_H_
#define HEDDLE_RENDER_CAMERA_H_
// A pinhole camera in world space (millimetres). Pixel (0, 0) is at the top left; (x, y) = (0.5,
// 0.5) is its centre. Tested in tests/render/camera_test.cpp.

#include <cstdint>
#include <string>

#include "fibers/math/vector.h"

namespace heddle {

enum class FovAxis : std::uint8_t { kHorizontal, kVertical };

struct CameraConfig {
  Vec3d position = Vec3d(0, 0, 1);  // mm
  Vec3d look_at = Vec3d(0, 0, 0);   // mm, different from position
  Vec3d up = Vec3d(0, 1, 0);        // not parallel to the view direction
  double fov = 0.5;                 // radians, full angle along fov_axis
  FovAxis fov_axis = FovAxis::kHorizontal;
  int width = 1;  // pixels
  int height = 1;
};

/// A rectangle of pixels: columns x0 .. x0 + width - 1, rows y0 .. y0 + height - 1.
struct PixelRect {
  int x0 = 0;
  int y0 = 0;
  int width = 0;
  int height = 0;
};

struct EyeRay {
  Vec3d origin;
  Vec3 direction;     // unit
  double spread = 0;  // edge of the pixel's footprint, mm per mm along the ray
};

class Camera {
 public:
  explicit Camera(const CameraConfig& config);

  int width() const { return width_; }
  int height() const { return height_; }
  PixelRect full_frame() const { return {0, 0, width_, height_}; }

  /// The ray through the point (x, y) of the picture, in pixels.
  EyeRay ray(double x, double y) const;
  /// Distance along the view direction (mm): the Z layer.
  double depth(const Vec3d& position) const { return forward_.dot(position - position_); }
  /// Edge of one pixel's footprint (mm) at that depth.
  double pixel_size(double depth) const { return 2.0 * tan_x_ * depth / width_; }
  double distance(const Vec3d& position) const { return (position - position_).norm(); }
  /// Could a part of that ball lie in the picture? Never false where it does.
  bool may_see(const Vec3d& middle, double radius) const;
  /// Row-major 4 x 4 matrix (x right, y up, z backward) as 16 numbers separated by spaces.
  std::string world_to_camera_text() const;

 private:
  Vec3d position_;
  Vec3d right_;
  Vec3d up_;
  Vec3d forward_;
  double tan_x_;  // tangent of half the horizontal / vertical field of view
  double tan_y_;
  int width_;
  int height_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_CAMERA_H_
