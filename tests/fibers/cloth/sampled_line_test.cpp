#include "fibers/cloth/sampled_line.h"

#include <gtest/gtest.h>

#include <cmath>

namespace heddle {
namespace {

// A helix about the x axis, `turns` over a length of 3; its points crowd towards its end.
std::vector<Vec3d> helix(double radius, double turns) {
  std::vector<Vec3d> points;
  for (int k = 0; k <= 2000; ++k) {
    const double share = std::pow(k / 2000.0, 1.5);
    const double angle = 2 * kPi * turns * share;
    points.emplace_back(3 * share, radius * std::cos(angle), radius * std::sin(angle));
  }
  return points;
}

TEST(SampledLineLaw, SharesAreOfItsLength) {
  const CentreLine line =
      sampled_line(helix(0.5, 2), steady_ups(helix(0.5, 2), false), 0.2, 0.1, false);
  EXPECT_NEAR(line.length_mm, std::hypot(3, 2 * kPi * 0.5 * 2), 1e-4);
  for (double share = 0; share <= 1; share += 0.0937)
    EXPECT_NEAR(line.at(share).position.x(), 3 * share, 1e-5);
  EXPECT_EQ(line.at(0.3).half_width_mm, 0.1);
  EXPECT_EQ(line.at(0.3).half_height_mm, 0.05);
}

TEST(SampledLineLaw, SideAndUpAreAcrossAndAgreeAtBothEnds) {
  const std::vector<Vec3d> points = helix(0.5, 2);
  const CentreLine line = sampled_line(points, steady_ups(points, false), 0.2, 0.1, false);
  for (double share = 0; share <= 1; share += 0.01) {
    const YarnPlace place = line.at(share);
    const Vec3d along = (line.at(std::min(1.0, share + 1e-4)).position -
                         line.at(std::max(0.0, share - 1e-4)).position)
                            .normalized();
    EXPECT_NEAR(place.side.norm(), 1, 1e-12);
    EXPECT_NEAR(place.side.dot(place.up), 0, 1e-12);
    EXPECT_GT(place.side.cross(place.up).dot(along), 0.999);
  }
  EXPECT_NEAR(line.at(0).up.dot(line.at(1).up), 1, 1e-9);
}

// The frame that turns least about a helix turns against the helix's own by its torsion: over one
// turn of radius r and pitch p, 2 pi sin(climb) with tan(climb) = p / (2 pi r).
TEST(SampledLineLaw, SteadyUpsTurnByTheTorsionOfAHelix) {
  const double radius = 0.5;
  const std::vector<Vec3d> points = helix(radius, 1);
  const std::vector<Vec3d> ups = steady_ups(points, true);
  const std::vector<Vec3d> tangents = tangents_of(points, true);
  const auto angle_to_axis = [&](std::size_t k) {
    const Vec3d outwards = Vec3d(0, points[k].y(), points[k].z()).normalized();
    return std::atan2(tangents[k].dot(outwards.cross(ups[k])), outwards.dot(ups[k]));
  };
  const double climb = std::atan2(3.0, 2 * kPi * radius);
  const double turned = angle_to_axis(points.size() - 2) - angle_to_axis(1);
  EXPECT_NEAR(std::remainder(turned + 2 * kPi * std::sin(climb), 2 * kPi), 0, 0.02);
}

}  // namespace
}  // namespace heddle
