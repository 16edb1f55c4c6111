#include "fibers/baked/transfer.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "fibers/baked/cell_grid.h"
#include "fibers/math/random.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

TEST(CellGridLaw, EveryPointHasTheCellItLiesIn) {
  const CellGrid grid = make_cell_grid(2, 1, -0.1F, 0.3F, 0.11F);
  EXPECT_EQ(grid.cells, (std::array<int, 3>{18, 9, 4}));
  for (int i = 0; i < 2000; ++i) {
    RandomStream random(1, RandomStage::kTest, 20, static_cast<std::uint64_t>(i));
    const int x = static_cast<int>(random.index(18));
    const int y = static_cast<int>(random.index(9));
    const int z = static_cast<int>(random.index(4));
    const Vec3 inside(2 * (static_cast<float>(x) + 0.1F + 0.8F * random.uniform()) / 18,
                      (static_cast<float>(y) + 0.1F + 0.8F * random.uniform()) / 9,
                      -0.1F + 0.4F * (static_cast<float>(z) + 0.1F + 0.8F * random.uniform()) / 4);
    const auto expected = static_cast<std::uint32_t>((z * 9 + y) * 18 + x);
    EXPECT_EQ(grid.cell_of(inside), expected);
    EXPECT_EQ(grid.cell_of(inside + Vec3(-6, 3, 0)), expected);
  }
  EXPECT_EQ(grid.cell_of(Vec3(0, 0, 9)), grid.cell_of(Vec3(0, 0, 0.299F)));
}

Transfer random_transfer() {
  Transfer t;
  t.order = 2;
  t.grid = make_cell_grid(1, 1, 0, 1, 0.5F);
  RandomStream random(1, RandomStage::kTest, 21, 0);
  for (std::size_t i = 0; i < 8 * 9 * 9 * 3; ++i) t.matrices.push_back(random.uniform() - 0.5F);
  t.standard_error.assign(8 * 3 * 3, 0.1F);
  t.paths.assign(8, 1024);
  return t;
}

// The index order of the design: result[j1] = sum over j0 of a[j0][j1] light[j0].
TEST(TransferLaw, IncomingSumsOverTheLightIndex) {
  const Transfer t = random_transfer();
  std::vector<float> light(9);
  std::vector<float> result(27);
  for (std::size_t j = 0; j < 9; ++j) light[j] = static_cast<float>(j) - 3.5F;
  t.incoming(5, light.data(), result.data());
  for (std::size_t j1 = 0; j1 < 9; ++j1) {
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0;
      for (std::size_t j0 = 0; j0 < 9; ++j0) sum += t.matrices[((5 * 9 + j0) * 9 + j1) * 3 + c] * light[j0];
      EXPECT_NEAR(result[3 * j1 + c], sum, 1e-5);
    }
  }
}

TEST(TransferFormat, RoundTrip) {
  const Transfer a = random_transfer();
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "transfer.safetensors";
  write_transfer(path, a, {});
  const Transfer b = read_transfer(path);
  EXPECT_EQ(a.matrices, b.matrices);
  EXPECT_EQ(a.standard_error, b.standard_error);
  EXPECT_EQ(a.grid.cells, b.grid.cells);
  EXPECT_EQ(b.order, 2);
  EXPECT_FALSE(b.both_sides);
}

}  // namespace
}  // namespace heddle
