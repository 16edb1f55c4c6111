#include "fibers/math/spherical_map.h"

#include <gtest/gtest.h>

namespace heddle {
namespace {

TEST(LatLongGrid, CentreLiesInItsCell) {
  for (int n : {4, 7, 128}) {
    const LatLongGrid grid(n);
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column) {
        const LatLongGrid::Cell cell = grid.cell_of(grid.centre(row, column));
        ASSERT_EQ(cell.row, row);
        ASSERT_EQ(cell.column, column);
      }
    }
  }
}

TEST(LatLongGrid, PolesAxesAndWrap) {
  const LatLongGrid grid(8);
  EXPECT_EQ(grid.cell_of({0, 0, 1}).row, 0);
  EXPECT_EQ(grid.cell_of({0, 0, -1}).row, 7);
  EXPECT_EQ(grid.cell_of({1, 0, 0.001}).row, 3);
  EXPECT_EQ(grid.cell_of({1, 0, -0.001}).row, 4);
  EXPECT_EQ(grid.cell_of({1, 0, 0}).column, 0);
  EXPECT_EQ(grid.cell_of({1, 1e-9, 0}).column, 0);
  EXPECT_EQ(grid.cell_of({1, -1e-9, 0}).column, 7);
  EXPECT_EQ(grid.cell_of({1, -1e-300, 0}).column, 7);  // azimuth rounds to 2 pi
  EXPECT_EQ(grid.cell_of({0, 1, 0}).column, 2);
  EXPECT_EQ(grid.cell_of({-1, 0.1, 0}).column, 3);
  EXPECT_EQ(grid.cell_of({-1, -0.1, 0}).column, 4);
  EXPECT_EQ(grid.cell_of({0.1, -3, 0}).column, 6);  // any length
}

TEST(LatLongGridLaw, SolidAnglesFillTheSphere) {
  for (int n : {4, 7, 128}) {
    const LatLongGrid grid(n);
    double sum = 0;
    for (int row = 0; row < n; ++row) sum += n * grid.solid_angle(row);
    EXPECT_NEAR(sum, 4 * kPi, 1e-13 * n);
  }
}

TEST(SphericalMap, BitsAreRowMajorLeastSignificantFirst) {
  SphericalMap map(8);
  EXPECT_TRUE(map.all_closed());
  map.set(0, 3, true);
  map.set(7, 7, true);
  ASSERT_EQ(map.words().size(), 1U);
  EXPECT_EQ(map.words()[0], (std::uint64_t{1} << 3) | (std::uint64_t{1} << 63));
  EXPECT_TRUE(map.open(0, 3));
  EXPECT_FALSE(map.open(3, 0));
  map.set(0, 3, false);
  EXPECT_FALSE(map.open(0, 3));
  EXPECT_FALSE(map.all_closed());
  EXPECT_TRUE(SphericalMap(8, map.words()).open(7, 7));
}

}  // namespace
}  // namespace heddle
