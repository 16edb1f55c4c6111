#include "precompute/segment_cells.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "fibers/cloth/synthesize.h"
#include "tests/support/fabrics.h"

namespace heddle {
namespace {

struct Cloth {
  Exemplar exemplar = synthesize(test::small_fabric());
  TileScene scene{exemplar};
  SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
};

/// Sum over segments of openness times the squared distance from the cell's openness-weighted mean.
double spread(const Cloth& cloth, const std::vector<std::uint32_t>& cell_of_segment) {
  struct Sums {
    double weight = 0;
    Vec3d first = Vec3d::Zero();
    double second = 0;
  };
  std::map<std::uint32_t, Sums> cells;
  for (std::uint32_t s = 0; s < cloth.exemplar.segment_count(); ++s) {
    Sums& sums = cells[cell_of_segment[s]];
    const Vec3d p = cloth.exemplar.segment_midpoint(s).cast<double>();
    const double w = cloth.origins.openness[s];
    sums.weight += w;
    sums.first += w * p;
    sums.second += w * p.squaredNorm();
  }
  double total = 0;
  for (const auto& [cell, sums] : cells) {
    if (sums.weight > 0) total += sums.second - sums.first.squaredNorm() / sums.weight;
  }
  return total;
}

constexpr float kEdgeMm = 0.1F;

/// The cubes that the cells take the place of.
std::vector<std::uint32_t> cubes(const Exemplar& exemplar, std::size_t& count) {
  const auto along = [](float length) { return std::max(1.0F, std::round(length / kEdgeMm)); };
  std::map<std::array<int, 3>, std::uint32_t> known;
  std::vector<std::uint32_t> result;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const Vec3 p = exemplar.segment_midpoint(s);
    const float thickness = exemplar.z_max - exemplar.z_min;
    const std::array<int, 3> cube = {
        static_cast<int>(std::floor(p.x() / exemplar.width_mm * along(exemplar.width_mm))),
        static_cast<int>(std::floor(p.y() / exemplar.height_mm * along(exemplar.height_mm))),
        static_cast<int>(std::floor((p.z() - exemplar.z_min) / thickness * along(thickness)))};
    result.push_back(known.try_emplace(cube, known.size()).first->second);
  }
  count = known.size();
  return result;
}

TEST(SegmentCellsLaw, EverySegmentHasACellAndEveryCellASegment) {
  const Cloth cloth;
  const SegmentCells cells = make_segment_cells(cloth.exemplar, cloth.origins, kEdgeMm);
  ASSERT_EQ(cells.cell_of_segment.size(), cloth.exemplar.segment_count());
  const std::set<std::uint32_t> used(cells.cell_of_segment.begin(), cells.cell_of_segment.end());
  EXPECT_EQ(used.size(), cells.count);
  EXPECT_EQ(*used.rbegin(), cells.count - 1);
}

// What they are for: the same number of cells, and less of what an eye sees is far from its cell's
// mean.
TEST(SegmentCellsLaw, SpreadLessThanCubesOfTheSameNumber) {
  const Cloth cloth;
  const SegmentCells cells = make_segment_cells(cloth.exemplar, cloth.origins, kEdgeMm);
  std::size_t count = 0;
  const std::vector<std::uint32_t> by_cube = cubes(cloth.exemplar, count);
  EXPECT_EQ(cells.count, count);
  const double own = spread(cloth, cells.cell_of_segment);
  const double of_cubes = spread(cloth, by_cube);
  std::printf("%u cells: spread %.4g, cubes %.4g mm^2\n", cells.count, own, of_cubes);
  EXPECT_LT(own, 0.7 * of_cubes);
}

TEST(SegmentCells, OneHugeCubeIsOneCell) {
  const Cloth cloth;
  EXPECT_EQ(make_segment_cells(cloth.exemplar, cloth.origins, 1e3F).count, 1U);
}

}  // namespace
}  // namespace heddle
