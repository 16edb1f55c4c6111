#include "render/surface/distance_maps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "formats/tensor_file.h"
#include "tests/formats/file_fixture.h"
#include "tests/support/directions.h"

namespace heddle {
namespace {

// Hidden beyond a plane through the point: w.m > 0.
DistanceMaps wall_map(const Vec3& m, const Mat3& frame, int resolution = 64) {
  DistanceMapSettings settings;
  settings.resolution = resolution;
  const std::vector<Mat3> frames = {frame};
  return {frames, [m](std::uint32_t, const Vec3& w) { return w.dot(m) < 0; }, settings};
}

TEST(DistanceMaps, HorizonOfAnOpenSurface) {
  // nothing above the horizon is hidden
  const DistanceMaps maps = wall_map(Vec3(0, 0, -1), Mat3::Identity());
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 500; ++k) {
    const Vec3d w = test::upper_direction(random);
    const SignedDistance at = maps.evaluate(maps.coefficients(0), w);
    const double elevation = std::asin(w.z());
    // The map's horizon is a line between cells here, so the distances are exact but for
    // interpolation.
    EXPECT_NEAR(at.distance, elevation, radians(2));
    // the ridge above, the poles of the map
    if (elevation > radians(80) || std::abs(w.x()) > 0.95) continue;
    const Vec3d up = (Vec3d(0, 0, 1) - w.z() * w).normalized();
    EXPECT_GT(at.gradient.dot(up), std::cos(radians(12))) << w.transpose();
    EXPECT_NEAR(at.gradient.norm(), 1, 1e-9);
    EXPECT_NEAR(at.gradient.dot(w), 0, 1e-9);
  }
}

TEST(DistanceMapsLaw, DistanceToAWallIsGeodesic) {
  const Vec3 m = Vec3(0.6F, 0.3F, -0.4F).normalized();
  const DistanceMaps maps = wall_map(m, Mat3::Identity(), 128);
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 500; ++k) {
    const Vec3d w = test::upper_direction(random);
    const double to_wall = std::asin(-w.dot(m.cast<double>()));
    const double to_horizon = std::asin(w.z());
    if (std::abs(w.x()) > 0.95) continue;
    // The visible part is a lune: away from its corners the nearest of its two sides is the nearest
    // border. Half a cell's diagonal is 2 degrees.
    const SignedDistance at = maps.evaluate(maps.coefficients(0), w);
    if (to_wall > 0) {
      EXPECT_NEAR(at.distance, std::min(to_wall, to_horizon), radians(2.5)) << w.transpose();
    } else {
      EXPECT_LT(at.distance, radians(2.5));
    }
  }
}

TEST(DistanceMapsLaw, OnlyTheFrameCounts) {
  const Vec3 m = Vec3(0.6F, 0.3F, -0.4F).normalized();
  const Mat3 turn = frame_about(Vec3(0.2F, -0.9F, 0.5F).normalized());
  const DistanceMaps here = wall_map(m, Mat3::Identity());
  const DistanceMaps there = wall_map(turn * m, turn);
  RandomStream random(3, RandomStage::kTest, 0, 0);
  int different = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3d w = test::upper_direction(random);
    different += std::abs(here.evaluate(here.coefficients(0), w).distance -
                          there.evaluate(there.coefficients(0), w).distance) > 1e-4;
  }
  EXPECT_LT(different, 20) << "rounding may turn over a cell on the border";
}

// Walls all around one direction: smooth in the angle, so few components hold them.
TEST(DistanceMaps, ComponentsCompress) {
  constexpr int kVertices = 120;
  const std::vector<Mat3> frames(kVertices, Mat3::Identity());
  const auto visible = [](std::uint32_t v, const Vec3& w) {
    const float angle = 2 * kPif * static_cast<float>(v) / kVertices;
    return w.dot(Vec3(0.8F * std::cos(angle), 0.8F * std::sin(angle), -0.6F)) < 0;
  };
  DistanceMapSettings settings;
  settings.resolution = 32;
  double before = 1;
  for (const int terms : {0, 2, 8, 24, kVertices}) {
    settings.terms = terms;
    const DistanceMaps maps(frames, visible, settings);
    EXPECT_EQ(maps.stride() % 8, 0U);
    EXPECT_LT(maps.compression_error(), before) << terms;
    before = maps.compression_error();
    // Between vertices: the interpolated coefficients give the interpolated distance.
    std::vector<float> middle(maps.stride());
    for (std::size_t k = 0; k < middle.size(); ++k) {
      middle[k] = 0.5F * (maps.coefficients(3)[k] + maps.coefficients(4)[k]);
    }
    const Vec3d w = Vec3d(0.1, 0.4, 0.9).normalized();
    EXPECT_NEAR(maps.evaluate(middle, w).distance,
                0.5 * (maps.evaluate(maps.coefficients(3), w).distance +
                       maps.evaluate(maps.coefficients(4), w).distance),
                1e-5);
  }
  EXPECT_LT(before, 1e-4) << "as many components as vertices leave nothing";
}

// In the theta and phi of any thread frame the line lies where the border is, near the direction.
TEST(DistanceMapsLaw, LinesFollowTheBorder) {
  const Vec3d m = Vec3d(0.6, 0.3, -0.7).normalized();
  RandomStream random(4, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 200; ++k) {
    // columns tangent, binormal, normal
    const Mat3d frame = frame_about(sample_sphere(random)).cast<double>();
    const double theta = 1.2 * (2 * random.uniform_double() - 1);
    const double phi = 1.5 * (2 * random.uniform_double() - 1);
    const auto direction = [&](double t, double p) {
      return Vec3d(frame *
                   Vec3d(std::sin(t), std::cos(t) * std::sin(p), std::cos(t) * std::cos(p)));
    };
    const Vec3d w = direction(theta, phi);
    const double distance = std::asin(-w.dot(m));
    if (std::abs(distance) > 0.05) continue;
    const SignedDistance at{distance, -(m - w * w.dot(m)).normalized()};
    const VisibilityLine line =
        visibility_line(at, std::cos(theta),
                        frame * Vec3d(std::cos(theta), -std::sin(theta) * std::sin(phi),
                                      -std::sin(theta) * std::cos(phi)),
                        frame * Vec3d(0, std::cos(phi), -std::sin(phi)));
    EXPECT_NEAR(std::hypot(line.theta_gradient, line.phi_gradient), 1, 1e-12);
    // The foot of the perpendicular in (theta, phi) is on the border, up to its curvature there.
    const Vec3d foot = direction(theta - line.distance * line.theta_gradient,
                                 phi - line.distance * line.phi_gradient);
    EXPECT_NEAR(foot.dot(m), 0, 2 * line.distance * line.distance + 1e-9);
  }
  EXPECT_GT(visibility_line({1, Vec3d::Zero()}, 1, Vec3d(1, 0, 0), Vec3d(0, 1, 0)).distance, 10);
  EXPECT_LT(visibility_line({-1, Vec3d::Zero()}, 1, Vec3d(1, 0, 0), Vec3d(0, 1, 0)).distance, -10);
}

TEST(DistanceMapsAgreement, EightAtATime) {
  const Vec3 m = Vec3(0.6F, 0.3F, -0.4F).normalized();
  const DistanceMaps maps = wall_map(m, Mat3::Identity());
  const auto vector_of = [](const Vec8& v, int lane) {
    return Vec3d(static_cast<double>(v.x[lane]), static_cast<double>(v.y[lane]),
                 static_cast<double>(v.z[lane]));
  };
  RandomStream random(4, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 500; ++k) {
    Vec8 directions;
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3 w =
          lane == k % 8 ? Vec3(Vec3::Unit(k % 3) * (k % 2 == 0 ? 1 : -1)) : sample_sphere(random);
      directions.x[lane] = w.x();
      directions.y[lane] = w.y();
      directions.z[lane] = w.z();
    }
    const SignedDistance8 eight = maps.evaluate(maps.coefficients(0), directions);
    const Vec3d a(0.6, 0, 0.8);
    const Vec3d b(0, 1, 0);
    const auto lanes_of = [](const Vec3d& v) {
      return Vec8{splat8(static_cast<float>(v.x())), splat8(static_cast<float>(v.y())),
                  splat8(static_cast<float>(v.z()))};
    };
    const VisibilityLine8 lines = visibility_line(eight, splat8(0.5F), lanes_of(a), lanes_of(b));
    for (int lane = 0; lane < 8; ++lane) {
      const SignedDistance one = maps.evaluate(maps.coefficients(0), vector_of(directions, lane));
      EXPECT_NEAR(static_cast<double>(eight.distance[lane]), one.distance, 1e-5);
      if (std::abs(directions.x[lane]) > 0.999F) continue;  // the poles of the map have no gradient
      EXPECT_LT((vector_of(eight.gradient, lane) - one.gradient).norm(), 2e-2);
      const VisibilityLine line = visibility_line(one, 0.5, a, b);
      if (std::hypot(one.gradient.dot(a), 0.5 * one.gradient.dot(b)) < 0.1) continue;
      EXPECT_NEAR(static_cast<double>(lines.theta_gradient[lane]), line.theta_gradient, 0.1);
      EXPECT_NEAR(static_cast<double>(lines.distance[lane]), line.distance,
                  0.1 * std::abs(line.distance) + 1e-3);
    }
  }
}

class DistanceMapsFormat : public FileFixture {};

TEST_F(DistanceMapsFormat, ReadsWhatItWrote) {
  const DistanceMaps maps = wall_map(Vec3(0.6F, 0.3F, -0.4F).normalized(), Mat3::Identity(), 16);
  maps.write(folder_ / "maps.safetensors", {{"key", "abc"}});
  EXPECT_EQ(TensorFile::read(folder_ / "maps.safetensors").metadata_value("key"), "abc");
  const DistanceMaps read = DistanceMaps::read(folder_ / "maps.safetensors", 1);
  EXPECT_EQ(read.vertex_count(), 1U);
  EXPECT_NE(
      error_of([&] { DistanceMaps::read(folder_ / "maps.safetensors", 2); }).find("coefficients"),
      std::string::npos)
      << "of another mesh";
  EXPECT_EQ(read.compression_error(), maps.compression_error());
  RandomStream random(9, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 100; ++k) {
    const Vec3d w = test::upper_direction(random);
    EXPECT_EQ(read.evaluate(read.coefficients(0), w).distance,
              maps.evaluate(maps.coefficients(0), w).distance);
  }
}

TEST_F(DistanceMapsFormat, SizesThatDoNotFitAreNamed) {
  const auto message = [&](std::uint64_t rows, std::uint64_t columns, std::uint64_t stride,
                           std::uint64_t other_stride) {
    TensorFileWriter file;
    file.add<float>("basis", {rows, columns, stride}, std::vector<float>(rows * columns * stride));
    file.add<float>("coefficients", {2, other_stride}, std::vector<float>(2 * other_stride));
    file.add<double>("compression_error", {1}, std::vector<double>(1));
    file.write(folder_ / "bad.safetensors");
    return error_of([&] { DistanceMaps::read(folder_ / "bad.safetensors", 2); });
  };
  EXPECT_EQ(message(4, 4, 8, 8), "no error");
  for (const auto& [rows, columns, stride] :
       {std::array<std::uint64_t, 3>{4, 5, 8}, {3, 3, 8}, {4, 4, 9}, {4, 4, 0}}) {
    EXPECT_NE(message(rows, columns, stride, stride).find("bad.safetensors: 'basis'"),
              std::string::npos);
  }
  EXPECT_NE(message(4, 4, 8, 16).find("coefficients"), std::string::npos);
}

}  // namespace
}  // namespace heddle
