// Accuracy: statistics on frames of known noise and bias, tables, enclosure, a measured table.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "formats/input_error.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/accuracy/enclosure.h"
#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/accuracy/probe.h"
#include "pipeline/stages.h"
#include "render/pixel_sums.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

TEST(Probe, BlocksLieInsideAndApart) {
  const PixelRect rectangle{3, 5, 61, 30};
  for (const int pixels : {1, 300, 100000}) {
    std::vector<int> covered(100 * 100, 0);
    int count = 0;
    for (const PixelRect& block : spread_blocks(rectangle, 8, pixels)) {
      for (int y = block.y0; y < block.y0 + block.height; ++y) {
        for (int x = block.x0; x < block.x0 + block.width; ++x) {
          ASSERT_TRUE(3 <= x && x < 64 && 5 <= y && y < 35);
          EXPECT_EQ(covered[static_cast<std::size_t>(100 * y + x)]++, 0);
          ++count;
        }
      }
    }
    EXPECT_NEAR(count, std::min(pixels, 61 * 30), pixels < 61 * 30 ? 64 : 0);
  }
}

TEST(Probe, BlocksReachAllOfAPicture) {
  // A quarter of the blocks: every quadrant holds about a quarter of them.
  int quadrants[4] = {};
  for (const PixelRect& block : spread_blocks({0, 0, 256, 256}, 8, 128 * 128)) {
    ++quadrants[(block.x0 >= 128) + 2 * (block.y0 >= 128)];
  }
  for (const int blocks : quadrants) EXPECT_NEAR(blocks, 64, 13);
}

/// Blocks of pixels whose eye rays bring noise that both pictures share, and each a noise of its
/// own.
struct Drawn {
  std::vector<FrameBuffers> reference;
  std::vector<FrameBuffers> picture;
};
Drawn draw(double bias, double shared, double own, int samples) {
  std::mt19937 engine(7);
  std::normal_distribution<double> normal;
  Drawn drawn;
  for (int block = 0; block < 64; ++block) {
    FrameBuffers frames[2] = {FrameBuffers(8, 8), FrameBuffers(8, 8)};
    for (FrameBuffers& frame : frames) {
      frame.spp = samples;
      frame.half0.resize(64);
      frame.half1.resize(64);
      frame.variance.resize(64);
    }
    for (std::size_t k = 0; k < 64; ++k) {
      PixelSums sums[2];
      // The same everywhere in a pixel, another sign in the next.
      const double pixel_bias = k % 2 == 0 ? bias : -bias;
      for (int s = 0; s < samples; ++s) {
        const double common = 1 + shared * normal(engine);
        for (int p = 0; p < 2; ++p) {
          const auto value = static_cast<float>(common + own * normal(engine) + p * pixel_bias);
          sums[p].add({Rgb(value, value, value), Rgb::Zero(), Rgb::Zero(), 1}, s);
        }
      }
      for (int p = 0; p < 2; ++p) sums[p].store(samples, k, frames[p]);
    }
    drawn.reference.push_back(frames[0]);
    drawn.picture.push_back(frames[1]);
  }
  return drawn;
}

TEST(ProbeStatistical, NoiseIsTheVarianceOfASample) {
  const Drawn drawn = draw(0.3, 0.8, 0.6, 8);
  const Estimate variance = sample_variance(drawn.picture);
  EXPECT_NEAR(variance.value, 1.0, 4 * variance.error);
  EXPECT_LT(variance.error, 0.03);
  EXPECT_NEAR(mean_radiance(drawn.picture), 1.0, 4 / std::sqrt(64.0 * 64 * 8));
}

TEST(ProbeStatistical, BiasIsFoundUnderNoise) {
  for (const double bias : {0.0, 0.1, 0.3}) {
    const Drawn drawn = draw(bias, 5.0, 0.5, 8);
    const Estimate square = squared_bias(drawn.picture, drawn.reference);
    EXPECT_NEAR(square.value, bias * bias, 4 * square.error) << bias;
    EXPECT_LT(square.error, 0.01) << "noise of common eye rays drops out";
  }
}

/// A picture of 64 x 64 pixels with so many samples, whose noise doubles every 32 columns and of
/// which a share of samples is bright.
FrameBuffers noisy(int samples, double share_of_bright, double bright, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  FrameBuffers frame(64, 64);
  frame.spp = samples;
  frame.half0.resize(64 * 64);
  frame.half1.resize(64 * 64);
  frame.variance.resize(64 * 64);
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    PixelSums sums;
    for (int s = 0; s < samples; ++s) {
      const double spread = k % 64 < 32 ? 1 : 2;
      const auto value = static_cast<float>(1 + spread * normal(engine) +
                                            (uniform(engine) < share_of_bright ? bright : 0));
      sums.add({Rgb(value, value, value), Rgb::Zero(), Rgb::Zero(), 1}, s);
    }
    sums.store(samples, k, frame);
  }
  return frame;
}

TEST(ProbeStatistical, APictureKnowsHowWellItKnowsItsNoise) {
  // Known noise, half of the pixels with 1 and half with 4: no error but that of each pixel's 15
  // degrees of freedom.
  const Estimate even = sample_variance_of_all(noisy(16, 0, 0, 3));
  EXPECT_NEAR(even.value, 2.5, 4 * even.error);
  EXPECT_NEAR(even.error, std::sqrt((1 + 16) / 2.0 * 2 / 15 / 4096), 0.1 * even.error);
  // Every 3000th sample is brighter by 200: of the variance 13.3 of it, known from about 22 of
  // them, to 1 / sqrt(22).
  double within = 0;
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    const Estimate rare = sample_variance_of_all(noisy(16, 1 / 3000.0, 200, 100 + seed));
    EXPECT_GT(rare.error, 0.1 * rare.value) << seed;
    EXPECT_LT(rare.error, 0.5 * rare.value) << seed;
    if (std::abs(rare.value - (2.5 + 200 * 200 / 3000.0)) < rare.error) ++within;
  }
  // Of 40, 27 are expected within one standard error.
  EXPECT_NEAR(within / 40, 0.68, 4 * std::sqrt(0.68 * 0.32 / 40));
}

AccuracyTable small_table() {
  AccuracyTable table;
  table.fabric = "cloth \"of\" gold";
  table.key = "0123";
  table.threads = 2;
  table.sharpness = {10, 1000};
  table.footprint_mm = {0.1, 0.4};
  table.light_cosine = {0.5, 0.9};
  const auto entry = [](double bias) {
    return Accuracy{bias, 0.01, 2 * bias, 3 * bias, Rgbd(1, 0.9, 1.1)};
  };
  table.bent_footprint_mm = 3;
  table.bent_light_cosine = 0.7;
  table.bent_between = {0.2, 0.4};
  table.bent_enclosure_square = 0.05;
  table.color = Rgbd(1.5, 1, 0.5);
  table.through = 0.25;
  // [light][footprint][height]: low light errs by 10 more.
  table.settings = {
      {"path", 1e-5, 0.5, std::vector<Accuracy>(8, entry(0)), {entry(0), entry(0)}},
      {"exact",
       1e-6,
       0.25,
       {entry(11), entry(1), entry(12), entry(2), entry(13), entry(3), entry(14), entry(4)},
       {entry(5), entry(7)}}};
  table.costs = {{{"maps"}, {1.5, 3.0}}, {{"transfer", "cells x 2"}, {2.5, 5.0}}};
  return table;
}

TEST(AccuracyTable, BetweenEntriesInLogarithms) {
  const AccuracyTable table = small_table();
  EXPECT_DOUBLE_EQ(table.at("exact", 10, 0.1, 0.9).bias_square, 1);
  EXPECT_NEAR(table.at("exact", 10, 0.2, 0.9).bias_square, 1.5, 1e-12);
  EXPECT_NEAR(table.at("exact", 100, 0.2, 0.9).bias_square, 2.5, 1e-12);
  EXPECT_NEAR(table.at("exact", 100, 0.2, 0.6).bias_square, 10, 1e-12)
      << "cosines themselves, not their logarithms";
  EXPECT_DOUBLE_EQ(table.at("exact", 0, 0.001, 1).bias_square, 1)
      << "the nearest entry beyond the ends";
  EXPECT_DOUBLE_EQ(table.at("exact", kDirectionalSharpness, 10, 0).bias_square, 14);
  EXPECT_NEAR(table.at("exact", 100, 0.2, 0.9).change_square, 7.5, 1e-12);
  EXPECT_NEAR(table.between_at(100), 0.3, 1e-12);
  EXPECT_DOUBLE_EQ(table.between_at(1), 0.2);
  EXPECT_THROW(table.at("no such", 10, 0.1, 0.5), FileError);
}

TEST(AccuracyTableFormat, RoundTrip) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "table.json";
  write_accuracy(path, small_table());
  EXPECT_EQ(accuracy_json(read_accuracy(path)), accuracy_json(small_table()));
  EXPECT_NE(accuracy_text(small_table()).find("exact"), std::string::npos);
  AccuracyTable of_surface = small_table();
  of_surface.costs.clear();
  write_accuracy(path, of_surface);
  EXPECT_EQ(accuracy_json(read_accuracy(path)), accuracy_json(of_surface)) << "nothing to build";
}

TEST(AccuracyTableFormat, DamagedTablesAreRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "table.json";
  const std::string whole = accuracy_json(small_table()).dump(1) + "\n";
  for (std::size_t size = 0; size + 2 < whole.size(); size += 7) {
    std::ofstream(path, std::ios::trunc) << whole.substr(0, size);
    EXPECT_THROW(read_accuracy(path), FileError) << size;
  }
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"\"version\": 3", "\"version\": 99"},
        {"heddle accuracy", "heddle chart"},
        {"1000.0", "10.0"},
        {"0.2,\n  0.4", "0.2"},
        {"\"threads\": 2", "\"threads\": 2e300"},
        {"\"threads\": 2", "\"threads\": \"2\""}}) {
    std::string damaged = whole;
    ASSERT_NE(damaged.find(from), std::string::npos) << from;
    std::ofstream(path, std::ios::trunc) << damaged.replace(damaged.find(from), from.size(), to);
    EXPECT_THROW(read_accuracy(path), FileError) << to;
  }
}

/// A disk of radius 2 mm, or the half of it with x > 0, `height` over z = 0.
TriangleMesh roof(float height, bool half) {
  constexpr int kCorners = 240;
  TriangleMesh mesh;
  mesh.positions.emplace_back(0, 0, height);
  for (int k = 0; k <= kCorners; ++k) {
    const float angle = (half ? kPif : 2 * kPif) * static_cast<float>(k) / kCorners - 0.5F * kPif;
    mesh.positions.emplace_back(2 * std::cos(angle), 2 * std::sin(angle), height);
    if (k > 0)
      mesh.triangles.push_back(
          {0, static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(k + 1)});
  }
  return mesh;
}

// A disk of radius r at height h over a place covers r^2 / (r^2 + h^2) of its cosine-weighted
// hemisphere.
TEST(EnclosureLaw, IsTheShareOfTheHemisphereThatIsCovered) {
  const auto tile = std::make_shared<TileScene>(crossed_layers(test_cotton()));
  const auto of = [&](std::vector<TriangleMesh> meshes, const Vec3& direction) {
    const ClothScene scene({{tile, flat_cloth(20, 20)}}, std::move(meshes));
    // Along a tilted ray that meets the cloth next to the axis of the roof.
    const std::optional<ShellHit> hit =
        scene.first_fiber({Vec3d(0.01, 0.01, 0) - 0.5 * direction.cast<double>(), direction});
    return hit ? enclosure(scene, *hit, direction) : -1.0;
  };
  const Vec3 down = Vec3(0.01F, 0, -1).normalized();
  const Vec3 up = Vec3(0.01F, 0, 1).normalized();
  const auto top = static_cast<float>(tile->exemplar().z_max);
  EXPECT_EQ(of({}, down), 0);
  EXPECT_NEAR(of({roof(top + 2, false)}, down), 0.5, 0.05);
  EXPECT_NEAR(of({roof(top + 1, false)}, down), 0.8, 0.05);
  EXPECT_NEAR(of({roof(top + 4, false)}, down), 0.2, 0.05);
  EXPECT_NEAR(of({roof(top + 1, true)}, down), 0.4, 0.09);
  EXPECT_EQ(of({roof(top + 1, false)}, up), 0)
      << "what is behind the side that is seen does not matter";
}

/// The table of the small fabric, measured with little effort.
AccuracyTable measured_table() {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "fabric.toml") << kSmallFabric;
  std::ostringstream silent;
  Console console(silent, false, true);
  StageContext context{.cache = Cache(folder.path() / "cache"),
                       .console = &console,
                       .fabric_seed = {},
                       .picture_seed = {},
                       .results = {}};
  FabricStages stages(folder.path() / "fabric.toml", context);
  AccuracyData data;
  data.pack = load_pack(stages.pack(kEverything).path);
  return measure_accuracy(
      data, 1, [](double) {},
      {.pixels = 32, .bent_pixels = 8, .path_samples = 6, .method_samples = 2, .bent_factor = 4});
}

TEST(MeasureAccuracyStatistical, SaysWhatHoldsOfAnyFabric) {
  const AccuracyTable table = measured_table();
  for (std::size_t f = 1; f < table.footprint_mm.size(); ++f) {
    EXPECT_NEAR(table.footprint_mm[f], 2 * table.footprint_mm[f - 1], 1e-9);
  }
  EXPECT_NEAR(table.footprint_mm[0], 0.02, 1e-5) << "the fibers' diameter";
  EXPECT_NEAR(table.color.mean(), 1, 1e-9);
  EXPECT_GT(table.through, 0.01) << "thin cloth lets light through";
  EXPECT_LT(table.through, 2);
  ASSERT_EQ(table.light_cosine.size(), 2U);
  EXPECT_LT(table.light_cosine[0], 0.55);
  EXPECT_GT(table.light_cosine[1], 0.75);
  EXPECT_FALSE(table.has(order_setting(3))) << "the fabric's own order is 2";
  EXPECT_TRUE(table.has(order_setting(1)));
  for (const double sharpness : table.sharpness) {
    const auto at = [&](const char* setting, double footprint) {
      return table.at(setting, sharpness, footprint, 0.8);
    };
    for (const double footprint : table.footprint_mm) {
      EXPECT_EQ(at("path", footprint).bias_square, 0);
      EXPECT_GT(at("path", footprint).noise_square, at("exact", footprint).noise_square)
          << sharpness;
      // Six events are too dark, and differ from all of them by what is missing.
      EXPECT_LT(at("path-6", footprint).color_ratio.mean(), 1) << sharpness;
    }
    // A wider pixel sees more of the cloth's variety, and averages errors.
    EXPECT_GE(at("exact", 1).noise_square, at("exact", 0.02).noise_square);
    EXPECT_LT(at("exact", 1).bias_square,
              at("exact", 0.02).bias_square + 3 * at("exact", 0.02).bias_square_error);
  }
  // What a setting changes is part of what it errs by: the root of one is at most the other's and
  // the base's together.
  for (const double sharpness : table.sharpness) {
    EXPECT_EQ(table.at("exact", sharpness, 0.02, 0.8).change_square, 0);
    const Accuracy low = table.at(order_setting(1), sharpness, 0.3, 0.8);
    const Accuracy base = table.at("exact", sharpness, 0.3, 0.8);
    EXPECT_GT(low.change_square, 0) << sharpness;
    EXPECT_LT(std::sqrt(low.change_square),
              std::sqrt(std::max(0.0, low.bias_square) + 2 * low.bias_square_error) +
                  std::sqrt(std::max(0.0, base.bias_square) + 2 * base.bias_square_error))
        << sharpness;
    EXPECT_GT(table.between_at(sharpness), 0) << "folds light each other";
  }
  EXPECT_GT(table.bent_enclosure_square, 0.002);
  EXPECT_LT(table.bent_enclosure_square, 0.1) << "folds of 35 degrees see little of each other";
  // Light that both forms of visibility treat alike.
  const auto bias = [&](const char* setting, double sharpness) {
    return table.at(setting, sharpness, 0.02, 0.8).bias_square;
  };
  EXPECT_EQ(bias("Gaussians", kDirectionalSharpness), bias("exact", kDirectionalSharpness));
  EXPECT_EQ(bias("signed distance", 1000), bias("exact", 1000));
  EXPECT_NE(bias("signed distance", 3), bias("exact", 3));
}

}  // namespace
}  // namespace heddle
