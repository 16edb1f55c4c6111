#include "fibers/cloth/fitting_fibers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "fibers/cloth/fibers_of_yarn.h"
#include "fibers/cloth/synthesize.h"
#include "formats/input_error.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

/// A tile of 3 x 4 repeats of 0.6 mm, every block of one repeat.
FabricConfig fabric_of(const YarnConfig& yarn) {
  FabricConfig config = test::small_fabric();
  config.repeats_x = 3;
  config.repeats_y = 4;
  config.fitting_blocks = {1, 1};
  config.segment_mm = 0.03;
  for (YarnConfig& own : config.yarns) {
    const std::string name = own.name;
    own = yarn;
    own.name = name;
    own.width_mm = 0.24;
    own.height_mm = 0.16;
  }
  return config;
}

YarnConfig filament() {
  YarnConfig yarn;
  yarn.fibers_per_ply = 17;
  yarn.wander_rms = radians(5);
  return yarn;
}

YarnConfig one_ply() {
  YarnConfig yarn = filament();
  yarn.ply_turns_per_mm = 0.7;
  yarn.migration = 0.3;
  return yarn;
}

YarnConfig two_plies() {
  YarnConfig yarn = one_ply();
  yarn.plies = 2;
  yarn.yarn_turns_per_mm = -0.9;
  yarn.ply_turns_per_mm = 1.9;
  yarn.migration_per_turn = 0.4;
  return yarn;
}

std::vector<YarnConfig> kinds_of_yarn() {
  return {filament(), one_ply(), two_plies()};
}

struct Crossing {
  Vec3d point;
  Vec3d tangent;
};

/// Where the fibers of a yarn that runs along `axis` cross a plane across it.
std::vector<Crossing> crossings(const Exemplar& exemplar, std::uint32_t yarn, int axis,
                                double plane) {
  std::vector<Crossing> found;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const std::uint32_t f = exemplar.segment_fiber[s];
    if (exemplar.yarn[f] != yarn || exemplar.is_open[f] != 0) continue;
    const Vec3d a = exemplar.points[exemplar.segment_point[s]].cast<double>();
    const Vec3d b = exemplar.points[exemplar.segment_point[s] + 1].cast<double>();
    if ((a[axis] <= plane) == (b[axis] <= plane)) continue;
    found.push_back({a + (plane - a[axis]) / (b[axis] - a[axis]) * (b - a), (b - a).normalized()});
  }
  return found;
}

/// The largest distance of any of `a` from the nearest of `b`: of points (mm) and of tangents.
std::pair<double, double> largest_gap(const std::vector<Crossing>& a,
                                      const std::vector<Crossing>& b, const Vec3d& shift) {
  std::pair<double, double> largest = {0, 0};
  for (const Crossing& own : a) {
    double nearest = 1e9;
    double turn = 0;
    for (const Crossing& other : b) {
      const double apart = (other.point - own.point - shift).norm();
      if (apart >= nearest) continue;
      nearest = apart;
      turn = (other.tangent - own.tangent).norm();
    }
    largest = {std::max(largest.first, nearest), std::max(largest.second, turn)};
  }
  return largest;
}

/// A yarn of the tile, and the yarn at the same place of the first blocks.
struct YarnOfTile {
  std::uint32_t yarn, first;
  int axis;
  Vec3d across;  // from the first to it
};

std::vector<YarnOfTile> yarns_of(const FabricConfig& config) {
  std::vector<YarnOfTile> yarns;
  const auto warp = static_cast<std::uint32_t>(2 * config.repeats_x);
  const auto weft = static_cast<std::uint32_t>(2 * config.repeats_y);
  for (std::uint32_t k = 0; k < warp; ++k)
    yarns.push_back({k, k % 2, 1, Vec3d(0.3 * (k - k % 2), 0, 0)});
  for (std::uint32_t k = 0; k < weft; ++k)
    yarns.push_back({warp + k, warp + k % 2, 0, Vec3d(0, 0.3 * (k - k % 2), 0)});
  return yarns;
}

// Just after a border and just before it, the fibers of every yarn are the same in all blocks, in
// place and direction; only which fiber lies where differs. So the segments that meet at a border
// do so for any two blocks.
TEST(FittingFibersLaw, AnyBlockFitsAnyOther) {
  for (const YarnConfig& yarn : kinds_of_yarn()) {
    const FabricConfig config = fabric_of(yarn);
    const Exemplar exemplar = synthesize(config);
    EXPECT_NO_THROW(validate_exemplar(exemplar, "fitting"));
    for (const double beside : {0.001, 0.6 - 0.001}) {
      for (const YarnOfTile& own : yarns_of(config)) {
        const auto first = crossings(exemplar, own.first, own.axis, beside);
        ASSERT_EQ(first.size(), static_cast<std::size_t>(yarn.plies * yarn.fibers_per_ply));
        const int blocks = own.axis == 0 ? config.repeats_x : config.repeats_y;
        for (int block = 0; block < blocks; ++block) {
          Vec3d shift = own.across;
          shift[own.axis] = 0.6 * block;
          const auto here = crossings(exemplar, own.yarn, own.axis, beside + 0.6 * block);
          ASSERT_EQ(here.size(), first.size());
          for (const auto& gap :
               {largest_gap(first, here, shift), largest_gap(here, first, -shift)}) {
            EXPECT_LT(gap.first, 2e-6) << own.yarn << ", block " << block;
            EXPECT_LT(gap.second, 1e-4) << own.yarn << ", block " << block;
          }
        }
      }
    }
  }
}

// The segment that ends at a border goes on in the one that starts there: no kink beyond what the
// fiber's own curvature asks for.
TEST(FittingFibersLaw, FibersPassBordersSmoothly) {
  FabricConfig config = fabric_of(two_plies());
  config.segment_mm = 0.005;
  const Exemplar exemplar = synthesize(config);
  const auto before = crossings(exemplar, 0, 1, 0.6 - 1e-4);
  const auto after = crossings(exemplar, 0, 1, 0.6 + 1e-4);
  ASSERT_EQ(before.size(), 34U);
  for (const Crossing& end : before) {
    double nearest = 1e9;
    double turn = 0;
    for (const Crossing& start : after) {
      const double apart = (start.point - end.point).norm();
      if (apart < nearest) {
        nearest = apart;
        turn = (start.tangent - end.tangent).norm();
      }
    }
    EXPECT_LT(nearest, 5e-4);
    EXPECT_LT(turn, 0.1);
  }
}

TEST(FittingFibersLaw, BlocksDifferInside) {
  for (const YarnConfig& yarn : kinds_of_yarn()) {
    const FabricConfig config = fabric_of(yarn);
    const Exemplar exemplar = synthesize(config);
    for (const YarnOfTile& own : yarns_of(config)) {
      const auto first = crossings(exemplar, own.first, own.axis, 0.3);
      const int blocks = own.axis == 0 ? config.repeats_x : config.repeats_y;
      for (int block = 0; block < blocks; ++block) {
        if (own.yarn == own.first && block == 0) continue;
        Vec3d shift = own.across;
        shift[own.axis] = 0.6 * block;
        const auto here = crossings(exemplar, own.yarn, own.axis, 0.3 + 0.6 * block);
        EXPECT_GT(largest_gap(first, here, shift).first, 0.005) << own.yarn << ", block " << block;
      }
    }
  }
}

// Whatever is asked for: whole turns per tile, 1 / plies of a turn per block, and half of that away
// at most.
TEST(FittingFibersLaw, YarnTwistIsNearTheOneAskedFor) {
  for (int plies = 1; plies <= 7; ++plies) {
    for (int blocks = 1; blocks <= 24; ++blocks) {
      for (double turns = -7.3; turns < 7.5; turns += 0.37) {
        const int fitting = fitting_yarn_turns(turns, plies, blocks);
        EXPECT_EQ(fitting * plies % blocks, 0);
        EXPECT_LE(std::abs(fitting - turns), 0.5 * blocks + 1e-9);
        if (blocks % plies == 0 || plies % blocks == 0) {
          EXPECT_LE(std::abs(fitting - turns), 0.5 * std::max(1.0, 1.0 * blocks / plies) + 1e-9);
        }
      }
    }
  }
}

FittingFibers::Setup setup_of(double length_mm, int segments, int ply_turns, double waves) {
  return {0.005, length_mm, segments, 0, ply_turns, waves, 3, 1};
}

// A fiber makes the tile's whole turns; within any block it turns by at most 1 / order of a turn
// more or less than on the mean, and not at all unevenly where blocks are few.
TEST(FittingFibersLaw, TwistIsAsEvenAsRingsAllow) {
  for (const int blocks : {1, 2, 3, 5, 12, 13, 24, 64}) {
    for (const int turns : {-9, -1, 0, 2, 7, 30}) {
      const YarnConfig yarn = [] {
        YarnConfig own;
        own.fibers_per_ply = 40;
        return own;
      }();
      const FittingFibers fibers(yarn, {blocks, 0}, setup_of(1, 8 * blocks, turns, 1));
      const FittingFiber fiber = fibers.fiber(0, 39);
      EXPECT_NEAR(fibers.turns(fiber, 1), turns, 1e-9);
      const double even = static_cast<double>(turns) / blocks;
      for (int block = 0; block < blocks; ++block) {
        const double own = fibers.turns(fiber, (block + 1.0) / blocks) -
                           fibers.turns(fiber, static_cast<double>(block) / blocks);
        EXPECT_LE(std::abs(own - even),
                  blocks <= kMostFibersOfRing ? 1e-9 : 1.0 / kMostFibersOfRing + 1e-9);
        EXPECT_NEAR(own * fiber.order, std::round(own * fiber.order), 1e-9);
      }
    }
  }
}

TEST(FittingFibersLaw, MigrationIsNearTheOneAskedFor) {
  YarnConfig yarn = one_ply();
  for (const int blocks : {1, 2, 3, 8, 13}) {
    for (const int turns : {-5, 0, 1, 4, 8}) {
      for (const double waves : {1.0, 3.0, 8.0}) {
        const FittingFibers fibers(yarn, {blocks, 0}, setup_of(1, 8 * blocks, turns, waves));
        EXPECT_LE(std::abs(fibers.migration_waves() - waves), 0.5 * blocks + 1e-9);
        if (std::abs(turns) == 1) {
          EXPECT_EQ(fibers.migration_waves(), waves);
        }
        const FittingFiber fiber = fibers.fiber(0, 16);
        EXPECT_NEAR(fibers.migration_phase(fiber, 1) - fibers.migration_phase(fiber, 0),
                    2 * kPi * fibers.migration_waves(), 1e-6);
        // In the middle of a block, even waves are missed by up to half a one.
        const double half = 0.5 / blocks;
        const double ahead = fibers.migration_phase(fiber, half) -
                             fibers.migration_phase(fiber, 0) -
                             2 * kPi * fibers.migration_waves() * half;
        if (blocks <= kMostFibersOfRing) {
          EXPECT_LE(std::abs(ahead), kPi + 1e-9);
          EXPECT_GT(std::abs(ahead), 1e-3);
        }
      }
    }
  }
}

CentreLine straight_line(double length_mm) {
  return {
      [=](double share) {
        return YarnPlace{Vec3d(share * length_mm, 0.5, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1), 1, 1};
      },
      length_mm};
}

/// Of a round yarn 2 mm thick along x.
Exemplar fibers_of_round_yarn(YarnConfig yarn, double length_mm, int blocks, double segment_mm) {
  yarn.width_mm = yarn.height_mm = 2;
  Exemplar exemplar;
  exemplar.width_mm = static_cast<float>(length_mm);
  exemplar.height_mm = 1;
  exemplar.first_point = {0};
  exemplar.scattering = {test::white_fiber()};
  add_fibers_of_yarn(yarn, 0.005, straight_line(length_mm), segment_mm, 1, 0, exemplar,
                     {blocks, 0});
  index_segments(exemplar);
  return exemplar;
}

// Over all blocks, and in each part of a block: no calm places at borders.
TEST(FittingFibersStatistical, WanderHasTheStatedRmsAngle) {
  for (const double block_mm : {0.35, 2.0}) {
    YarnConfig yarn;
    yarn.fibers_per_ply = 300;
    yarn.wander_rms = radians(4);
    constexpr int kBlocks = 8;
    const Exemplar exemplar = fibers_of_round_yarn(yarn, kBlocks * block_mm, kBlocks, 0.01);
    constexpr std::size_t kParts = 7;
    std::array<double, kParts> sum{};
    std::array<double, kParts> count{};
    for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
      const Vec3 t = exemplar.segment_tangent(s);
      const double along = exemplar.segment_midpoint(s).x() / block_mm;
      const auto part =
          std::min(kParts - 1, static_cast<std::size_t>((along - std::floor(along)) * kParts));
      sum[part] += (t.y() * t.y() + t.z() * t.z()) / (t.x() * t.x());
      ++count[part];
    }
    double all = 0;
    for (std::size_t part = 0; part < kParts; ++part) {
      all += sum[part] / count[part] / kParts;
      const double rms = degrees(std::atan(std::sqrt(sum[part] / count[part])));
      EXPECT_NEAR(rms, 4, 0.25 * 4) << part;
    }
    EXPECT_NEAR(degrees(std::atan(std::sqrt(all))), 4, 0.05 * 4) << block_mm;
  }
}

// Each fiber comes as near to its ply's axis as asked for, and 1 / (1 - migration) as far again.
TEST(FittingFibersLaw, MigrationHasItsDepth) {
  YarnConfig yarn;
  yarn.fibers_per_ply = 25;
  yarn.ply_turns_per_mm = 0.5;
  yarn.migration = 0.4;
  const Exemplar exemplar = fibers_of_round_yarn(yarn, 4, 4, 0.01);
  int on_axis = 0;
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    double nearest = 9;
    double farthest = 0;
    for (std::uint32_t p = exemplar.first_point[f]; p < exemplar.first_point[f + 1]; ++p) {
      const Vec3& point = exemplar.points[p];
      nearest = std::min(nearest, std::hypot(point.y() - 0.5, static_cast<double>(point.z())));
      farthest = std::max(farthest, std::hypot(point.y() - 0.5, static_cast<double>(point.z())));
    }
    if (farthest < 1e-4) {
      ++on_axis;
    } else {
      EXPECT_NEAR(nearest / farthest, 0.6, 2e-3) << f;
    }
  }
  EXPECT_EQ(on_axis, 1);  // 25 fibers in rings of 2
}

TEST(FittingFibers, TheForecastCountsTheirSegments) {
  for (const YarnConfig& yarn : kinds_of_yarn()) {
    const FabricConfig config = fabric_of(yarn);
    EXPECT_EQ(forecast_exemplar(config).segments,
              static_cast<double>(synthesize(config).segment_count()));
  }
}

// Loops lie within blocks, so borders fit with them too.
TEST(FittingFibersLaw, LoopsLieWithinBlocks) {
  YarnConfig yarn = one_ply();
  yarn.fibers_per_ply = 40;
  yarn.ply_turns_per_mm = 1.4;
  const FabricConfig even = fabric_of(yarn);
  yarn.loops = {1, {0.12, 0.005}};
  const FabricConfig loops = fabric_of(yarn);
  const Exemplar a = synthesize(even);
  const Exemplar b = synthesize(loops);
  ASSERT_EQ(a.points.size(), b.points.size());
  EXPECT_NE(a.points, b.points);
  for (std::size_t f = 0; f < a.fiber_count(); ++f) {
    const std::uint32_t first = a.first_point[f];
    const std::uint32_t segments = a.first_point[f + 1] - 1 - first;
    const bool is_warp = a.yarn[f] < 6;
    const std::uint32_t blocks = is_warp ? 4 : 3;
    for (std::uint32_t border = 0; border <= blocks; ++border) {
      const std::uint32_t p = first + border * (segments / blocks);
      EXPECT_EQ(a.points[p], b.points[p]);
      if (border > 0) {
        EXPECT_EQ(a.points[p - 1], b.points[p - 1]);
      }
      if (border < blocks) {
        EXPECT_EQ(a.points[p + 1], b.points[p + 1]);
      }
    }
  }
}

/// The error of a fabric of 4 x 6 repeats; of the warp yarn as the yarn "a" in a sequence of 4.
std::string refusal(const std::string& keys, const std::string& more = "",
                    bool has_sequence = false) {
  std::string text = test::small_fabric_toml();
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("repeats_x = 1\nrepeats_y = 1\n", "repeats_x = 4\nrepeats_y = 6\n" + keys);
  if (has_sequence) replace("[warp]", "[yarn.a]");
  text += more;
  if (has_sequence) text += "[warp]\nspacing_mm = 0.3\nsequence = [\"4 a\"]\n";
  try {
    read_fabric_config(TomlTable::parse(text, "small.toml"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string fitting(int x, int y) {
  return "fitting_repeats_x = " + std::to_string(x) + "\nfitting_repeats_y = " + std::to_string(y) +
         "\n";
}

TEST(FittingBlocks, AreRefusedWhereTheyCannotFit) {
  EXPECT_EQ(refusal(""), "");
  EXPECT_EQ(refusal(fitting(2, 3)), "");
  EXPECT_EQ(refusal(fitting(2, 3), "", true), "");
  const auto expect = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_NE(message.find("fitting_repeats_"), std::string::npos) << message;
  };
  expect(refusal(fitting(3, 3)), "divisor of repeats_x, which is 4");
  expect(refusal(fitting(2, 4)), "divisor of repeats_y, which is 6");
  expect(refusal(fitting(0, 3)), "in [1, 64]");
  expect(refusal("fitting_repeats_x = 2\n"), "both or none");
  expect(refusal("fitting_repeats_y = 2\n"), "both or none");
  expect(refusal(fitting(1, 3), "", true), "multiple of 2: blocks hold whole sequences");
  expect(refusal(fitting(2, 3),
                 "[[weft.slubs]]\nper_m = 1\nlength_mm = [1, 0]\nthickness = [1.5, 0]\n"),
         "no slubs");
  expect(refusal(fitting(2, 3),
                 "[pile]\nfiber = \"thread\"\nper_mm2 = 10\nlength_mm = [1, 0]\nlean_deg = 10\n"
                 "lean_azimuth_deg = 0\nspread_deg = 5\n"),
         "no [pile]");
}

}  // namespace
}  // namespace heddle
