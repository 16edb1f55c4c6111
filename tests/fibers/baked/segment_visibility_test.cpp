#include "fibers/baked/segment_visibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "fibers/math/sampling.h"
#include "formats/input_error.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

SsdfVisibility empty_ssdf(int resolution, int components, std::size_t segments) {
  SsdfVisibility ssdf;
  ssdf.resolution = resolution;
  ssdf.components = components;
  const auto cells = static_cast<std::size_t>(resolution) * static_cast<std::size_t>(resolution);
  ssdf.mean.assign(cells, 0);
  ssdf.basis.assign(cells * static_cast<std::size_t>(components), 0);
  ssdf.coefficients.resize(segments * static_cast<std::size_t>(components));
  ssdf.sees_nothing.assign(segments, 0);
  return ssdf;
}

Vec3 centre(int resolution, int row, int column) {
  const double polar = (row + 0.5) * kPi / resolution;
  const double azimuth = (column + 0.5) * 2 * kPi / resolution;
  return Vec3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
               std::cos(polar))
      .cast<float>();
}

TEST(SsdfVisibility, MeanAndComponentsAtCellCentres) {
  const int n = 8;
  SsdfVisibility ssdf = empty_ssdf(n, 3, 2);
  for (int i = 0; i < n * n; ++i) {
    ssdf.mean[static_cast<std::size_t>(i)] = 0.01F * static_cast<float>(i);
    for (int k = 0; k < 3; ++k)
      ssdf.basis[static_cast<std::size_t>(3 * i + k)] = static_cast<float>((i * (k + 2)) % 7) - 3;
  }
  ssdf.coefficients = {half_from_float(9),    half_from_float(9),      half_from_float(9),
                       half_from_float(0.5F), half_from_float(-0.25F), half_from_float(2)};
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const auto i = static_cast<std::size_t>(row * n + column);
      const float expected = ssdf.mean[i] + 0.5F * ssdf.basis[3 * i] -
                             0.25F * ssdf.basis[3 * i + 1] + 2 * ssdf.basis[3 * i + 2];
      EXPECT_NEAR(ssdf.signed_distance(1, centre(n, row, column)), expected, 2e-4)
          << row << " " << column;
    }
  }
}

TEST(SsdfVisibility, EveryFiniteHalfIsACoefficient) {
  std::vector<Half> finite;
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    if ((bits & 0x7c00U) != 0x7c00U) finite.push_back({static_cast<std::uint16_t>(bits)});
  }
  SsdfVisibility ssdf = empty_ssdf(4, 1, finite.size());
  ssdf.basis.assign(16, 1);
  ssdf.coefficients = finite;
  for (std::uint32_t s = 0; s < finite.size(); ++s) {
    const float expected = float_from_half(finite[s]);
    ASSERT_NEAR(ssdf.signed_distance(s, Vec3(0, 1, 0)), expected, 1e-6F * std::abs(expected))
        << finite[s].bits;
  }
}

// A smooth function comes back with the error of bilinear interpolation: at most (step^2 / 8) times
// its second derivative per axis; z has no more than 1 along the polar angle, x no more than 1
// along either. Poles and wrap included.
TEST(SsdfVisibilityLaw, InterpolatesSmoothFunctions) {
  const int n = 32;
  const double bound = (kPi / n) * (kPi / n) / 8 + (2 * kPi / n) * (2 * kPi / n) / 8;
  for (int axis = 0; axis < 3; ++axis) {
    SsdfVisibility ssdf = empty_ssdf(n, 1, 1);
    for (int i = 0; i < n * n; ++i)
      ssdf.mean[static_cast<std::size_t>(i)] = centre(n, i / n, i % n)[axis];
    for (std::uint64_t i = 0; i < 5000; ++i) {
      RandomStream random(1, RandomStage::kTest, 0, i);
      Vec3 w = sample_sphere(random);
      if (i % 3 == 0) w = Vec3(0.02F * w.x(), 0.02F * w.y(), w.z() > 0 ? 1.0F : -1.0F).normalized();
      if (i % 3 == 1) w = Vec3(1, 0.02F * w.y(), w.z()).normalized();
      ASSERT_NEAR(ssdf.signed_distance(0, w), w[axis], bound) << w.transpose();
    }
  }
}

TEST(SsdfVisibility, MinusPiWhereNothingIsSeen) {
  SsdfVisibility ssdf = empty_ssdf(4, 1, 2);
  ssdf.mean.assign(16, 1);
  ssdf.sees_nothing[0] = 1;
  EXPECT_EQ(ssdf.signed_distance(0, Vec3(0, 0, 1)), -kPif);
  EXPECT_FLOAT_EQ(ssdf.signed_distance(1, Vec3(0, 0, 1)), 1);
}

class SegmentVisibilityFormat : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "visibility.safetensors";

  static SgVisibility some_sgs() {
    SgVisibility sgs;
    sgs.sharpness = 40;
    sgs.axes = {Vec3(0, 0, 1), Vec3(0.6F, 0, 0.8F)};
    sgs.weights = {half_from_float(0.5F), half_from_float(0), half_from_float(1),
                   half_from_float(0.25F)};
    sgs.rotation = {half_from_float(1), half_from_float(2)};
    sgs.sees_nothing = {0, 1};
    return sgs;
  }
};

bool same(const std::vector<Half>& a, const std::vector<Half>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Half)) == 0;
}

TEST_F(SegmentVisibilityFormat, SsdfRoundTrip) {
  SsdfVisibility ssdf = empty_ssdf(8, 5, 3);
  for (std::size_t i = 0; i < ssdf.basis.size(); ++i) ssdf.basis[i] = static_cast<float>(i);
  ssdf.mean[7] = -2;
  ssdf.coefficients[4] = half_from_float(0.1F);
  ssdf.sees_nothing[2] = 1;
  write_ssdf(path_, ssdf, {{"key", "k"}});
  const SsdfVisibility read = read_ssdf(path_);
  EXPECT_EQ(read.resolution, 8);
  EXPECT_EQ(read.components, 5);
  EXPECT_EQ(read.mean, ssdf.mean);
  EXPECT_EQ(read.basis, ssdf.basis);
  EXPECT_TRUE(same(read.coefficients, ssdf.coefficients));
  EXPECT_EQ(read.sees_nothing, ssdf.sees_nothing);
}

TEST_F(SegmentVisibilityFormat, SgRoundTrip) {
  const SgVisibility sgs = some_sgs();
  write_sg_visibility(path_, sgs, {});
  const SgVisibility read = read_sg_visibility(path_);
  EXPECT_EQ(read.sharpness, 40);
  EXPECT_EQ(read.axes, sgs.axes);
  EXPECT_TRUE(same(read.weights, sgs.weights));
  EXPECT_TRUE(same(read.rotation, sgs.rotation));
  EXPECT_EQ(read.sees_nothing, sgs.sees_nothing);
}

TEST_F(SegmentVisibilityFormat, SsdfThatDoesNotFitTogetherIsRefused) {
  const SsdfVisibility good = empty_ssdf(8, 5, 3);
  auto refused = [&](auto&& change) {
    SsdfVisibility bad = good;
    change(bad);
    write_ssdf(path_, bad, {});
    EXPECT_THROW(read_ssdf(path_), FileError);
  };
  refused([](SsdfVisibility& s) { s.sees_nothing[1] = 2; });
  refused([](SsdfVisibility& s) { s.mean[3] = NAN; });
  refused([](SsdfVisibility& s) { s = empty_ssdf(2, 5, 3); });
  refused([](SsdfVisibility& s) { s = empty_ssdf(8, 129, 3); });
  write_sg_visibility(path_, some_sgs(), {});
  EXPECT_THROW(read_ssdf(path_), FileError);
}

TEST_F(SegmentVisibilityFormat, GaussiansThatMeanNothingAreRefused) {
  auto refused = [&](auto&& change) {
    SgVisibility bad = some_sgs();
    change(bad);
    write_sg_visibility(path_, bad, {});
    EXPECT_THROW(read_sg_visibility(path_), FileError);
  };
  refused([](SgVisibility& s) { s.weights[1] = half_from_float(-0.5F); });
  refused([](SgVisibility& s) { s.axes[0] *= 1.1F; });
  refused([](SgVisibility& s) { s.sharpness = 0; });
  refused([](SgVisibility& s) { s.sees_nothing[0] = 7; });
  refused([](SgVisibility& s) { s.rotation[0] = {0x7c00}; });
}

}  // namespace
}  // namespace heddle
