#include "fibers/baked/transfer.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "fibers/math/random.h"
#include "formats/input_error.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

Transfer random_transfer() {
  Transfer t;
  t.order = 2;
  t.cell_of_segment = {0, 1, 2, 3, 4, 5, 6, 7, 7, 0};
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
  EXPECT_EQ(a.cell_of_segment, b.cell_of_segment);
  EXPECT_EQ(b.order, 2);
  EXPECT_FALSE(b.both_sides);
}

TEST(TransferFormat, ACellThatIsNotThereIsAnError) {
  Transfer t = random_transfer();
  t.cell_of_segment[3] = 8;
  const TemporaryFolder folder;
  write_transfer(folder.path() / "transfer.safetensors", t, {});
  EXPECT_THROW(read_transfer(folder.path() / "transfer.safetensors"), FileError);
}

}  // namespace
}  // namespace heddle
