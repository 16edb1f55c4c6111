#include "render/surface/weighting_table.h"

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

MicrocylinderThread thread_of(int direction, double share, std::vector<double> offsets_deg,
                              std::vector<double> lengths) {
  MicrocylinderThread thread;
  thread.direction = direction;
  thread.share = share;
  thread.scattering = {1.4, Rgbd(0.3, 0.2, 0.1), 0.3, radians(10), radians(20)};
  for (double& offset : offsets_deg) offset = radians(offset);
  thread.offsets = offsets_deg;
  thread.lengths = std::move(lengths);
  return thread;
}

MicrocylinderFabric plain(double share) {
  MicrocylinderFabric fabric;
  fabric.threads = {thread_of(1, share, {-25, 25}, {1}), thread_of(2, share, {-25, 25}, {1})};
  return fabric;
}

TEST(TangentSamples, StandForTheWholeCurve) {
  MicrocylinderFabric fabric;
  fabric.threads = {thread_of(1, 0.7, {-35, -35, 35, 35}, {1, 2, 1}),
                    thread_of(2, 0.3, {0, 0}, {1})};
  const std::vector<TangentSample> samples = tangent_samples(fabric, 20);
  std::vector<double> share(2, 0.0);
  for (const TangentSample& sample : samples) {
    share[static_cast<std::size_t>(sample.thread)] += sample.share;
    EXPECT_NEAR(std::hypot(sample.sine, sample.cosine), 1, 1e-14);
    const Mat3d frame = sample.frame();
    EXPECT_LT((frame * frame.transpose() - Mat3d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_NEAR(frame.determinant(), 1, 1e-14);
    EXPECT_NEAR(frame(2, 0), sample.sine, 1e-14) << "tangents rise along the thread";
    EXPECT_GT(frame(2, 2), 0) << "normals look up";
  }
  EXPECT_NEAR(share[0], 1, 1e-12);
  EXPECT_NEAR(share[1], 1, 1e-12);
  // Two flat segments, and 70 degrees in parts of at most 18; one flat segment.
  EXPECT_EQ(samples.size(), 2U + 4U + 1U);
  EXPECT_EQ(samples[0].deviation, 0);
  EXPECT_EQ(tangent_samples(fabric, 2).size(), 2U + 2U + 1U);
}

TEST(TangentSamplesLaw, ClassesOfWidthsShareTheirSamples) {
  MicrocylinderFabric fabric = plain(0.5);
  const auto count = [&](double gamma_s) {
    fabric.threads[0].scattering.gamma_s = radians(gamma_s);
    return tangent_samples(fabric, 100).size();
  };
  EXPECT_EQ(count(8.6), count(16.8));
  EXPECT_EQ(count(4.3), count(8.4));
  EXPECT_GT(count(8.4), count(8.6));
}

TEST(ThreadWeightsLaw, SharesOfOneAtMost) {
  const MicrocylinderFabric fabric = plain(0.5);
  const std::vector<TangentSample> tangents = tangent_samples(fabric, 16);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 500; ++k) {
    const Vec3d wi = test::upper_direction(random);
    const Vec3d wo = test::upper_direction(random);
    double sum = 0;
    for (const double weight : thread_weights(fabric, tangents, Weighting::kConsistent, wi, wo)) {
      EXPECT_GE(weight, 0);
      sum += weight;
    }
    EXPECT_LE(sum, 1 + 1e-12);
    // M = P = 1 in the middle.
    if (k > 0) continue;
    const Vec3d up(0, 0, 1);
    const MicrocylinderFabric flat = {
        {}, false, {thread_of(1, 0.5, {0, 0}, {1}), thread_of(2, 0.5, {0, 0}, {1})}};
    const std::vector<double> straight =
        thread_weights(flat, tangent_samples(flat, 4), Weighting::kConsistent, up, up);
    EXPECT_NEAR(straight[0] + straight[1], 1, 1e-12);
  }
  const std::vector<double> below =
      thread_weights(fabric, tangents, Weighting::kConsistent, Vec3d(0, 0.6, -0.8), Vec3d(0, 0, 1));
  for (const double weight : below) EXPECT_EQ(weight, 0);
}

// Two threads of one half with equally many samples, no gap: the printed weights are half of
// Sadeghi's.
TEST(ThreadWeightsLaw, PrintedWeightsAreHalf) {
  const MicrocylinderFabric fabric = plain(0.5);
  const std::vector<TangentSample> tangents = tangent_samples(fabric, 16);
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 200; ++k) {
    const Vec3d wi = test::upper_direction(random);
    const Vec3d wo = test::upper_direction(random);
    const std::vector<double> consistent =
        thread_weights(fabric, tangents, Weighting::kConsistent, wi, wo);
    const std::vector<double> printed =
        thread_weights(fabric, tangents, Weighting::kPrinted, wi, wo);
    for (std::size_t t = 0; t < tangents.size(); ++t)
      EXPECT_NEAR(printed[t], 0.5 * consistent[t], 1e-13);
  }
}

TEST(ThreadWeightsLaw, GapsTakeTheirShareOfTheConsistentWeights) {
  const std::vector<TangentSample> tangents = tangent_samples(plain(0.5), 16);
  const Vec3d up(0, 0, 1);
  double sum = 0;
  for (const double w : thread_weights(plain(0.25), tangents, Weighting::kConsistent, up, up))
    sum += w;
  double full = 0;
  for (const double w : thread_weights(plain(0.5), tangents, Weighting::kConsistent, up, up))
    full += w;
  // <M P> / (<P> + 1) against <M P> / <P>, P = cos of three tangents within +-25 degrees.
  const double p = (1 + 2 * std::cos(radians(50.0 / 3))) / 3;
  EXPECT_NEAR(sum / full, p / (p + 1), 1e-12);
}

double direct(const MicrocylinderFabric& fabric, const std::vector<TangentSample>& tangents,
              std::size_t tangent, const Vec3d& axis, double sharpness, const Vec3d& wo) {
  constexpr int kRows = 60;
  double sum = 0;
  double whole = 0;
  for (int i = 0; i < kRows; ++i) {
    const double polar = 0.5 * kPi * (i + 0.5) / kRows;
    for (int j = 0; j < 4 * kRows; ++j) {
      const double azimuth = 2 * kPi * (j + 0.5) / (4 * kRows);
      const Vec3d wi(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                     std::cos(polar));
      const double value = std::sin(polar) * std::exp(sharpness * (wi.dot(axis) - 1));
      whole += value;
      if (value < 1e-9) continue;
      sum += value * thread_weights(fabric, tangents, Weighting::kConsistent, wi, wo)[tangent];
    }
  }
  return sum / whole;
}

TEST(WeightingTableAgreement, TableAgainstDirectAverages) {
  const MicrocylinderFabric fabric = plain(0.4);
  const std::vector<TangentSample> tangents = tangent_samples(fabric, 2);
  WeightingTableSettings settings;
  settings.columns = 32;
  settings.rows = 16;
  settings.contribution = 0.99;
  const WeightingTable table(fabric, tangents, Weighting::kConsistent, settings);
  EXPECT_EQ(table.ranks().size(), tangents.size());
  RandomStream random(3, RandomStage::kTest, 0, 0);
  double squares = 0;
  double norm = 0;
  double worst = 0;
  for (int k = 0; k < 40; ++k) {
    const Vec3d wo = test::upper_direction(random);
    Vec3d axis = test::upper_direction(random);
    if (k % 8 == 0) axis.z() *= -0.3;
    axis.normalize();
    const double sharpness =
        (std::vector<double>{0, 1, 5, 40, 300})[static_cast<std::size_t>(k % 5)];
    const auto t = static_cast<std::size_t>(k) % tangents.size();
    const double exact = direct(fabric, tangents, t, axis, sharpness, wo);
    const double value = table.value(t, table.outgoing(wo), axis, sharpness);
    squares += (value - exact) * (value - exact);
    norm += exact * exact;
    worst = std::max(worst, std::abs(value - exact));
  }
  std::printf("  table: relative RMS %.4f, worst %.4f\n", std::sqrt(squares / norm), worst);
  EXPECT_LT(std::sqrt(squares / norm), 0.03);
  EXPECT_LT(worst, 0.03);
}

TEST(WeightingTable, FewerSingularValuesForLessContribution) {
  const MicrocylinderFabric fabric = plain(0.5);
  const std::vector<TangentSample> tangents = tangent_samples(fabric, 1);
  WeightingTableSettings settings;
  settings.columns = 12;
  settings.rows = 6;
  int before = 0;
  for (const double contribution : {0.5, 0.9, 0.99}) {
    settings.contribution = contribution;
    const WeightingTable table(fabric, tangents, Weighting::kConsistent, settings);
    EXPECT_GT(table.ranks()[0], before);
    before = table.ranks()[0];
    // Rows for wo and for six sharpnesses of twice as many axes, times the ranks in eights.
    std::size_t eights = 0;
    for (const int r : table.ranks()) eights += (static_cast<std::size_t>(r) + 7) / 8;
    EXPECT_EQ(table.bytes(), 32 * eights * (12 * 6 + 6 * 12 * 12));
  }
}

TEST(WeightingTableAgreement, EightAtATime) {
  const MicrocylinderFabric fabric = plain(0.5);
  WeightingTableSettings settings;
  settings.columns = 12;
  settings.rows = 6;
  const WeightingTable table(fabric, tangent_samples(fabric, 2), Weighting::kConsistent, settings);
  RandomStream random(7, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 500; ++k) {
    const WeightingTable::Outgoing outgoing = table.outgoing(test::upper_direction(random));
    Vec8 axes;
    Float8 sharpness;
    for (int lane = 0; lane < 8; ++lane) {
      // On the frame's axes too, but for the nadir, whose value depends on the azimuth from which
      // it is reached.
      const bool on_axis = lane == k % 8 && k % 6 != 5;
      const Vec3 axis =
          on_axis ? Vec3(Vec3::Unit(k % 3) * (k % 2 == 0 ? 1 : -1)) : sample_sphere(random);
      axes.x[lane] = axis.x();
      axes.y[lane] = axis.y();
      axes.z[lane] = axis.z();
      sharpness[lane] = lane == 0 ? 0 : std::exp2(12 * random.uniform() - 2);
    }
    const Float8 values = table.value(1, outgoing, axes, sharpness);
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3d axis(static_cast<double>(axes.x[lane]), static_cast<double>(axes.y[lane]),
                       static_cast<double>(axes.z[lane]));
      EXPECT_NEAR(static_cast<double>(values[lane]),
                  table.value(1, outgoing, axis, static_cast<double>(sharpness[lane])), 1e-5);
    }
  }
}

class WeightingTableFormat : public FileFixture {};

TEST_F(WeightingTableFormat, ReadsWhatItWrote) {
  const MicrocylinderFabric fabric = plain(0.4);
  WeightingTableSettings settings;
  settings.columns = 8;
  settings.rows = 4;
  const WeightingTable table(fabric, tangent_samples(fabric, 3), Weighting::kConsistent, settings);
  table.write(folder_ / "table.safetensors", {{"key", "abc"}});
  EXPECT_EQ(TensorFile::read(folder_ / "table.safetensors").metadata_value("key"), "abc");
  const WeightingTable read =
      WeightingTable::read(folder_ / "table.safetensors", table.ranks().size());
  EXPECT_EQ(read.ranks(), table.ranks());
  EXPECT_NE(error_of([&] {
              WeightingTable::read(folder_ / "table.safetensors", 9);
            }).find("not the sizes"),
            std::string::npos)
      << "of another fabric";
  EXPECT_EQ(read.bytes(), table.bytes());
  RandomStream random(8, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 200; ++k) {
    const Vec3d wo = test::upper_direction(random);
    const Vec3d axis = test::upper_direction(random);
    const std::size_t t = static_cast<std::size_t>(k) % table.ranks().size();
    EXPECT_EQ(read.value(t, read.outgoing(wo), axis, 3.0 * k),
              table.value(t, table.outgoing(wo), axis, 3.0 * k));
  }
}

TEST_F(WeightingTableFormat, SizesThatDoNotFitAreNamed) {
  const auto message = [&](std::vector<std::int32_t> grid, std::vector<std::int32_t> ranks,
                           std::size_t outgoing) {
    TensorFileWriter file;
    file.add<std::int32_t>("grid", {grid.size()}, grid);
    file.add<std::int32_t>("ranks", {ranks.size()}, ranks);
    file.add<float>("outgoing", {outgoing}, std::vector<float>(outgoing));
    file.add<float>("axes", {6 * 16 * 8}, std::vector<float>(6 * 16 * 8));
    file.write(folder_ / "bad.safetensors");
    return error_of([&] { WeightingTable::read(folder_ / "bad.safetensors", 1); });
  };
  EXPECT_EQ(message({2, 4, 4}, {1}, 64), "no error");
  for (const auto& ranks : {std::vector<std::int32_t>{9}, {1, 1}, {0}, {-1}, {2000000000}}) {
    EXPECT_NE(message({2, 4, 4}, ranks, 64).find("bad.safetensors: not the sizes"),
              std::string::npos);
  }
  EXPECT_NE(message({2, 4, 4}, {1}, 65).find("sizes"), std::string::npos);
  EXPECT_NE(message({1, 8, 4}, {1}, 32).find("sizes"), std::string::npos);
  EXPECT_NE(message({2, 4, -4}, {1}, 64).find("sizes"), std::string::npos);
}

}  // namespace
}  // namespace heddle
