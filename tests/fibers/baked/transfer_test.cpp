#include "fibers/baked/transfer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
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
      for (std::size_t j0 = 0; j0 < 9; ++j0)
        sum += t.matrices[((5 * 9 + j0) * 9 + j1) * 3 + c] * light[j0];
      EXPECT_NEAR(result[3 * j1 + c], sum, 1e-5);
    }
  }
}

/// The same with cones of random numbers.
Transfer random_transfer_with_cones() {
  Transfer t = random_transfer();
  RandomStream random(1, RandomStage::kTest, 22, 0);
  t.cones.emplace();
  for (std::size_t i = 0; i < t.matrices.size(); ++i)
    t.cones->harmonics.push_back(random.uniform() - 0.5F);
  for (std::size_t i = 0; i < 8 * ConeTransfer::kWidths * 9 * ConeTransfer::kAzimuths * 3; ++i) {
    t.cones->moments.push_back(random.uniform() - 0.5F);
  }
  return t;
}

TEST(TransferLaw, LightInColoursIsSummedColourByColour) {
  const Transfer t = random_transfer_with_cones();
  std::vector<float> light(27);
  for (std::size_t k = 0; k < 27; ++k) light[k] = 0.3F * static_cast<float>(k % 7) - 0.5F;
  std::vector<float> whole(27, 1.0F);
  std::vector<float> less(27, 1.0F);
  t.add_incoming(5, light.data(), whole.data());
  t.subtract_incoming_of_cones(5, light.data(), less.data());
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float> one(9);
    for (std::size_t j = 0; j < 9; ++j) one[j] = light[3 * j + c];
    std::vector<float> expected(27);
    std::vector<float> without(27);
    t.incoming(5, one.data(), expected.data());
    t.incoming(5, one.data(), 1, without.data());
    for (std::size_t j = 0; j < 9; ++j) {
      EXPECT_NEAR(whole[3 * j + c], 1 + expected[3 * j + c], 1e-5);
      EXPECT_NEAR(less[3 * j + c], 1 + without[3 * j + c] - expected[3 * j + c], 1e-5);
    }
  }
}

TEST(TransferLaw, ConesLeaveTheHarmonicsByTheirShare) {
  const Transfer t = random_transfer_with_cones();
  std::vector<float> light(9);
  for (std::size_t j = 0; j < 9; ++j) light[j] = static_cast<float>(j) - 3.5F;
  std::vector<float> whole(27);
  std::vector<float> less(27);
  t.incoming(5, light.data(), whole.data());
  t.incoming(5, light.data(), 0.75F, less.data());
  std::vector<float> cones(ConeTransfer::kWidths * ConeTransfer::kAzimuths * 3);
  t.incoming_on_cones(5, light.data(), cones.data());
  for (std::size_t k = 0; k < 27; ++k) {
    double sum = 0;
    for (std::size_t j0 = 0; j0 < 9; ++j0)
      sum += t.cones->harmonics[(5 * 9 + j0) * 27 + k] * light[j0];
    EXPECT_NEAR(less[k], whole[k] - 0.75 * sum, 1e-5);
  }
  constexpr std::size_t kRow = ConeTransfer::kAzimuths * 3;
  for (std::size_t k = 0; k < cones.size(); ++k) {
    double sum = 0;
    for (std::size_t j0 = 0; j0 < 9; ++j0) {
      sum += t.cones->moments[((5 * ConeTransfer::kWidths + k / kRow) * 9 + j0) * kRow + k % kRow] *
             light[j0];
    }
    EXPECT_NEAR(cones[k], sum, 1e-5);
  }
}

TEST(ConeTransferLaw, WidthsFollowTheLimits) {
  const auto variance = [](double degrees) {
    return static_cast<float>(std::pow(degrees * kPi / 180, 2));
  };
  EXPECT_EQ(ConeTransfer::width_of(0), 0);
  for (int width = 0; width < ConeTransfer::kWidths; ++width) {
    const double limit = ConeTransfer::kLimitDegrees[static_cast<std::size_t>(width)];
    EXPECT_EQ(ConeTransfer::width_of(variance(limit * 0.999)), width);
    EXPECT_EQ(ConeTransfer::width_of(variance(limit * 1.001)), width + 1);
    EXPECT_NEAR(ConeTransfer::variance_of(width),
                variance(ConeTransfer::kDeviationDegrees[static_cast<std::size_t>(width)]), 1e-6);
  }
}

TEST(ConeTransferLaw, AzimuthHarmonicsAreOrthonormal) {
  constexpr int kPoints = 32;
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(ConeTransfer::kAzimuths, ConeTransfer::kAzimuths);
  for (int k = 0; k < kPoints; ++k) {
    const double azimuth = 2 * kPi * k / kPoints;
    const auto values = azimuth_harmonics(static_cast<float>(std::cos(azimuth)),
                                          static_cast<float>(std::sin(azimuth)));
    const Eigen::Map<const Eigen::VectorXf> row(values.data(), ConeTransfer::kAzimuths);
    gram += (row * row.transpose()).cast<double>() * (2 * kPi / kPoints);
  }
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff(),
            1e-6);
}

TEST(ConeTransferLaw, FramesAreRotationsAboutTheBundle) {
  RandomStream random(1, RandomStage::kTest, 23, 0);
  for (int i = 0; i < 200; ++i) {
    const Vec3 tangent = i == 0   ? Vec3(Vec3::UnitZ())
                         : i == 1 ? Vec3(-Vec3::UnitZ())
                                  : sample_sphere(random);
    const Mat3 axes = cone_frame(tangent);
    EXPECT_LT((axes * axes.transpose() - Mat3::Identity()).norm(), 1e-5F);
    EXPECT_NEAR(axes.determinant(), 1, 1e-5);
    EXPECT_LT((Vec3(axes.row(0)) - tangent).norm(), 1e-6F);
    EXPECT_GE(axes(1, 2), -1e-6F);  // y looks up
  }
}

TEST(TransferFormat, ConesRoundTrip) {
  const Transfer a = random_transfer_with_cones();
  const TemporaryFolder folder;
  write_transfer(folder.path() / "transfer.safetensors", a, {});
  const Transfer b = read_transfer(folder.path() / "transfer.safetensors");
  ASSERT_TRUE(b.cones.has_value());
  EXPECT_EQ(a.cones->harmonics, b.cones->harmonics);
  EXPECT_EQ(a.cones->moments, b.cones->moments);
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
  EXPECT_FALSE(b.cones.has_value());
}

TEST(TransferFormat, ACellThatIsNotThereIsAnError) {
  Transfer t = random_transfer();
  t.cell_of_segment[3] = 8;
  const TemporaryFolder folder;
  write_transfer(folder.path() / "transfer.safetensors", t, {});
  EXPECT_THROW(read_transfer(folder.path() / "transfer.safetensors"), FileError);
}

TEST(CutToOrder, KeepsTheLowBands) {
  Transfer transfer;
  transfer.order = 3;
  transfer.cell_of_segment = {0, 1};
  transfer.paths = {8, 9};
  for (int k = 0; k < 2 * 16 * 16 * 3; ++k) transfer.matrices.push_back(static_cast<float>(k % 97));
  transfer.standard_error.assign(2 * 4 * 3, 1);
  transfer.cones.emplace();
  constexpr std::size_t kOnCones = ConeTransfer::kWidths * ConeTransfer::kAzimuths * 3;
  transfer.cones->harmonics = transfer.matrices;
  for (std::size_t k = 0; k < 2 * 16 * kOnCones; ++k)
    transfer.cones->moments.push_back(static_cast<float>(k % 89));
  const Transfer cut = cut_to_order(transfer, 1);
  EXPECT_EQ(cut.order, 1);
  EXPECT_EQ(cut.matrices.size(), 2U * 4 * 4 * 3);
  EXPECT_EQ(cut.standard_error.size(), 2U * 2 * 3);
  // Light of the low bands only: the low bands of what arrives are the same.
  std::vector<float> light(16, 0);
  for (std::size_t j = 0; j < 4; ++j) light[j] = static_cast<float>(j + 1);
  std::vector<float> whole(16 * 3);
  std::vector<float> low(4 * 3);
  for (const std::uint32_t cell : {0U, 1U}) {
    transfer.incoming(cell, light.data(), whole.data());
    cut.incoming(cell, light.data(), low.data());
    for (std::size_t k = 0; k < low.size(); ++k) EXPECT_FLOAT_EQ(low[k], whole[k]) << cell;
    transfer.incoming(cell, light.data(), 0.5F, whole.data());
    cut.incoming(cell, light.data(), 0.5F, low.data());
    for (std::size_t k = 0; k < low.size(); ++k) EXPECT_FLOAT_EQ(low[k], whole[k]) << cell;
    std::vector<float> whole_cones(kOnCones);
    std::vector<float> low_cones(kOnCones);
    transfer.incoming_on_cones(cell, light.data(), whole_cones.data());
    cut.incoming_on_cones(cell, light.data(), low_cones.data());
    for (std::size_t k = 0; k < kOnCones; ++k)
      EXPECT_FLOAT_EQ(low_cones[k], whole_cones[k]) << cell;
  }
}

}  // namespace
}  // namespace heddle
