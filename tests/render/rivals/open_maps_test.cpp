#include "render/rivals/open_maps.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/render/rivals/visibility_for_tests.h"

namespace heddle {
namespace {

TEST(OpenMapsLaw, CellsCoverTheSphereOrItsUpperHalf) {
  const SsdfVisibility ssdf = uniform_visibility({upper_half_space});
  for (const bool both_sides : {false, true}) {
    const OpenMaps maps(ssdf, both_sides);
    const auto& areas = maps.solid_angles();
    EXPECT_NEAR(std::accumulate(areas.begin(), areas.end(), 0.0), both_sides ? 4 * kPi : 2 * kPi,
                1e-9);
    for (const Vec3d& w : maps.directions()) EXPECT_NEAR(w.norm(), 1, 1e-12);
  }
}

TEST(OpenMapsAgreement, OpenIsWhereTheSignedDistanceIsPositive) {
  // Two segments with distances of their own, and one that sees nothing.
  const auto slanted = [](const Vec3d& w) { return w.dot(Vec3d(0.6, 0, 0.8)) - 0.3; };
  SsdfVisibility ssdf = uniform_visibility({upper_half_space, slanted});
  ssdf.sees_nothing.push_back(1);
  ssdf.coefficients.resize(ssdf.coefficients.size() + static_cast<std::size_t>(ssdf.components));
  const OpenMaps maps(ssdf, true);
  const Eigen::MatrixXf open = maps.open(0, 3);
  for (std::size_t cell = 0; cell < maps.directions().size(); ++cell) {
    const auto row = static_cast<Eigen::Index>(cell);
    for (std::uint32_t s = 0; s < 3; ++s) {
      const float distance = ssdf.signed_distance(s, maps.directions()[cell].cast<float>());
      if (std::abs(distance) < 1e-3F) continue;  // a half float's error
      EXPECT_EQ(open(row, s), distance > 0 ? 1.0F : 0.0F);
    }
  }
  // A run that starts later holds the same columns.
  EXPECT_TRUE(maps.open(1, 2).col(0).isApprox(open.col(1)));
}

}  // namespace
}  // namespace heddle
