#include "fibers/math/direction_grid.h"

#include <gtest/gtest.h>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

TEST(DirectionGridTest, TheMiddleOfACellIsThatCell) {
  const DirectionGrid grid(9);
  for (std::uint32_t cell = 0; cell < grid.count(); ++cell) {
    const Vec3 middle = grid.direction(cell);
    EXPECT_NEAR(middle.norm(), 1, 1e-6);
    const DirectionGrid::Place place = grid.place(middle);
    float own = 0;
    for (std::size_t i = 0; i < 4; ++i) own += place.cells[i] == cell ? place.shares[i] : 0.0F;
    EXPECT_NEAR(own, 1, 2e-4) << cell;
  }
}

TEST(DirectionGridTest, CellsAreEquallyLarge) {
  // Directions drawn uniformly fall into every cell equally often: chi-square of 127 degrees of
  // freedom lies below 190 with probability 0.9998.
  const DirectionGrid grid(8);
  std::vector<int> counts(grid.count());
  constexpr int kDraws = 128000;
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int draw = 0; draw < kDraws; ++draw) {
    const DirectionGrid::Place place = grid.place(sample_sphere(random));
    const auto largest = std::max_element(place.shares.begin(), place.shares.end());
    ++counts[place.cells[static_cast<std::size_t>(largest - place.shares.begin())]];
  }
  const double expected = static_cast<double>(kDraws) / grid.count();
  double chi_square = 0;
  for (const int count : counts) chi_square += (count - expected) * (count - expected) / expected;
  EXPECT_LT(chi_square, 190);
}

TEST(DirectionGridTest, SharesAreContinuousAndAddUp) {
  // A smooth function of the direction, interpolated, differs little between directions close by,
  // and little from its own value.
  const DirectionGrid grid(16);
  const auto value = [](const Vec3& w) { return w.x() + 0.5F * w.y() * w.z() + w.z() * w.z(); };
  const auto interpolated = [&](const Vec3& w) {
    const DirectionGrid::Place place = grid.place(w);
    float sum = 0;
    float shares = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      sum += place.shares[i] * value(grid.direction(place.cells[i]));
      shares += place.shares[i];
    }
    EXPECT_NEAR(shares, 1, 1e-5);
    return sum;
  };
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (int draw = 0; draw < 2000; ++draw) {
    const Vec3 w = sample_sphere(random);
    if (std::abs(w.z()) < 1e-3F) continue;
    EXPECT_NEAR(interpolated(w), value(w), 0.1);
    const Vec3 close = (w + 1e-4F * sample_sphere(random)).normalized();
    if (close.z() * w.z() > 0) {
      EXPECT_NEAR(interpolated(close), interpolated(w), 2e-3);
    }
  }
}

}  // namespace
}  // namespace heddle
