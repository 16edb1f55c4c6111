#ifndef HEDDLE_FIBERS_MATH_VECTOR_H_
#define HEDDLE_FIBERS_MATH_VECTOR_H_
// The small vector types used everywhere. Positions are millimetres, directions unit vectors that
// point away from the point being shaded, colours linear Rec.709.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace heddle {

using Vec2 = Eigen::Vector2f;
using Vec3 = Eigen::Vector3f;
using Vec3d = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3f;
using Mat3d = Eigen::Matrix3d;
using Rgb = Eigen::Array3f;
using Rgbd = Eigen::Array3d;

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kHalfPi = 0.5 * kPi;
inline constexpr float kPif = 3.14159265358979323846F;

constexpr double radians(double degrees) {
  return degrees * (kPi / 180.0);
}
constexpr double degrees(double radians) {
  return radians * (180.0 / kPi);
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_VECTOR_H_
