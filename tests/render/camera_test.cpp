#include "render/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

namespace heddle {
namespace {

CameraConfig oblique() {
  CameraConfig config;
  config.position = {30, -80, 50};
  config.look_at = {1, 2, 3};
  config.up = {0, 0, 1};
  config.fov = radians(40);
  config.width = 200;
  config.height = 100;
  return config;
}

TEST(Camera, CentreLooksAtTheTarget) {
  const CameraConfig config = oblique();
  const Camera camera(config);
  const EyeRay ray = camera.ray(100, 50);
  EXPECT_LT((ray.direction.cast<double>() - (config.look_at - config.position).normalized()).norm(),
            1e-6);
  EXPECT_NEAR(camera.depth(config.look_at), (config.look_at - config.position).norm(), 1e-9);
}

double angle(const EyeRay& a, const EyeRay& b) {
  return std::acos(
      a.direction.cast<double>().normalized().dot(b.direction.cast<double>().normalized()));
}

TEST(Camera, FootprintsGrowAlongARayAsWithDepth) {
  const Camera camera(oblique());
  for (const double x : {3.0, 100.0}) {
    const EyeRay ray = camera.ray(x, 20);
    const double depth = camera.depth(ray.origin + 70 * ray.direction.cast<double>());
    EXPECT_NEAR(70 * ray.spread, camera.pixel_size(depth), 1e-6);
  }
}

TEST(Camera, FieldOfViewSpansTheNamedAxis) {
  CameraConfig config = oblique();
  EXPECT_NEAR(angle(Camera(config).ray(0, 50), Camera(config).ray(200, 50)), config.fov, 1e-6);
  config.fov_axis = FovAxis::kVertical;
  EXPECT_NEAR(angle(Camera(config).ray(100, 0), Camera(config).ray(100, 100)), config.fov, 1e-6);
}

TEST(Camera, PixelsAreSquareAndRowZeroIsUp) {
  const Camera camera(oblique());
  EXPECT_GT(camera.ray(100, 0).direction.z(), camera.ray(100, 100).direction.z());
  const auto tangent = [&](double x, double y) {
    return std::tan(angle(camera.ray(100, 50), camera.ray(x, y)));
  };
  EXPECT_NEAR(tangent(140, 50), tangent(100, 10), 1e-6);
}

TEST(Camera, WorldToCameraTextMapsTheTargetOntoTheAxis) {
  const CameraConfig config = oblique();
  std::istringstream text(Camera(config).world_to_camera_text());
  Eigen::Matrix4d matrix;
  for (int k = 0; k < 16; ++k) ASSERT_TRUE(text >> matrix(k / 4, k % 4));
  const Eigen::Vector4d seen = matrix * config.look_at.homogeneous();
  EXPECT_NEAR(seen.x(), 0, 1e-6);
  EXPECT_NEAR(seen.y(), 0, 1e-6);
  EXPECT_NEAR(seen.z(), -(config.look_at - config.position).norm(), 1e-6);
}

TEST(Camera, SeesBallsThatReachIntoThePicture) {
  const Camera camera(oblique());
  for (const double x : {0.0, 60.0, 200.0}) {
    for (const double y : {0.0, 100.0}) {
      const EyeRay ray = camera.ray(x, y);
      const Vec3d point = ray.origin + 70 * ray.direction.cast<double>();
      EXPECT_TRUE(camera.may_see(point, 0.01));
      EXPECT_NEAR(camera.distance(point), 70, 1e-4);
    }
  }
  // A ball beside the picture is seen once it reaches in.
  const EyeRay aside = camera.ray(-100, 50);
  const Vec3d point = aside.origin + 70 * aside.direction.cast<double>();
  const double gap = 70 * std::sin(angle(aside, camera.ray(0, 50)));
  EXPECT_FALSE(camera.may_see(point, 0.98 * gap));
  EXPECT_TRUE(camera.may_see(point, 1.02 * gap));
  const Vec3d behind = aside.origin - 10 * camera.ray(100, 50).direction.cast<double>();
  EXPECT_FALSE(camera.may_see(behind, 9));
  EXPECT_TRUE(camera.may_see(behind, 11));
}

}  // namespace
}  // namespace heddle
