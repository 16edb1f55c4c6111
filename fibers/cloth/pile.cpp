#include "fibers/cloth/pile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

constexpr int kFewestPileSegments = 4;
constexpr int kRootDraws = 1000;
constexpr int kCurlModes = 2;

// Longest fiber, in tiles: a point may lie a tile outside.
constexpr double kMostTiles = 0.9;

// Where the roots may be, and how high the pile is there.
class PileGround {
 public:
  PileGround(const PileConfig& pile, const Exemplar& ground) : pile_(pile), ground_(ground) {
    double low = 1e30;
    for (const Vec3& point : ground.points) {
      low = std::min<double>(low, point.z());
      top_ = std::max<double>(top_, point.z());
    }
    const double middle = 0.5 * (low + top_);
    for (std::uint32_t p = 0; p < ground.points.size(); ++p) {
      if (ground.points[p].z() >= middle) upper_.push_back(p);
    }
  }

  // A root in the tile, or nothing where ribs leave no room.
  std::optional<Vec3d> draw_root(RandomStream& random) const {
    for (int k = 0; k < kRootDraws; ++k) {
      Vec3d root = ground_.points[upper_[random.index(upper_.size())]].cast<double>();
      root.x() -= ground_.width_mm * std::floor(root.x() / ground_.width_mm);
      root.y() -= ground_.height_mm * std::floor(root.y() / ground_.height_mm);
      if (profile(root.x()) > 0) return root;
    }
    return {};
  }

  // Where a fiber is cut.
  double shorn_at(double x) const {
    return pile_.height_mm > 0 ? top_ + pile_.height_mm * profile(x) : 1e30;
  }

 private:
  double profile(double x) const {
    if (pile_.ribs == 0) return 1;
    const double place = x / ground_.width_mm * pile_.ribs;
    const double from_middle = 2 * std::abs(place - std::floor(place) - 0.5);
    const double u = from_middle / (1 - pile_.rib_gap_share);
    return u < 1 ? std::sqrt(1 - u * u) : 0;
  }

  const PileConfig& pile_;
  const Exemplar& ground_;
  double top_ = -1e30;
  std::vector<std::uint32_t> upper_;  // points of the upper half
};

// The direction of one fiber along its length.
class PileDirection {
 public:
  PileDirection(const PileConfig& pile, double length_mm, RandomStream& random) : bend_(pile.bend) {
    const Vec3d lean(std::sin(pile.lean) * std::cos(pile.lean_azimuth),
                     std::sin(pile.lean) * std::sin(pile.lean_azimuth), std::cos(pile.lean));
    // Turned by a normal deviation each about two axes across.
    const Vec3d first = lean.unitOrthogonal();
    const Vec3d second = lean.cross(first);
    const MeanAndDeviation spread{0, pile.spread};
    const double a = spread.draw(random);
    const double b = spread.draw(random);
    const double turn = std::hypot(a, b);
    start_ = lean;
    if (turn > 0) start_ = std::cos(turn) * lean + std::sin(turn) / turn * (a * first + b * second);
    start_.z() = std::abs(start_.z());
    for (Mode& mode : modes_) {
      const double wave = std::max(1e-6, pile.curl_mm) * (0.7 + 0.6 * random.uniform_double());
      mode.waves = length_mm / wave;
      mode.phase = {2 * kPi * random.uniform_double(), 2 * kPi * random.uniform_double()};
      // Both axes and all modes together have the rms that is asked for.
      mode.slope = std::tan(pile.curl) / std::sqrt(static_cast<double>(kCurlModes));
    }
  }

  Vec3d at(double share) const {
    const double polar = std::acos(std::clamp(start_.z(), -1.0, 1.0)) + bend_ * share;
    const double azimuth = std::atan2(start_.y(), start_.x());
    const Vec3d along(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                      std::cos(polar));
    const Vec3d first(std::cos(polar) * std::cos(azimuth), std::cos(polar) * std::sin(azimuth),
                      -std::sin(polar));
    const Vec3d second = along.cross(first);
    Vec3d direction = along;
    for (const Mode& mode : modes_) {
      const double angle = 2 * kPi * mode.waves * share;
      direction += mode.slope * (std::sin(angle + mode.phase[0]) * first +
                                 std::sin(angle + mode.phase[1]) * second);
    }
    return direction.normalized();
  }

 private:
  struct Mode {
    double waves, slope;
    std::array<double, 2> phase;
  };
  double bend_;
  Vec3d start_;
  std::array<Mode, kCurlModes> modes_;
};

}  // namespace

PileConfig read_pile(const TomlTable& table) {
  PileConfig pile;
  pile.per_mm2 = table.number("per_mm2", {.min = 0, .max = 1e5});
  const auto [length, deviation] = table.number2("length_mm", {.min = 0, .max = 100});
  if (length <= 0) table.fail("length_mm", "expected a mean above 0");
  pile.length_mm = {length, deviation};
  pile.height_mm = table.number("height_mm", {.min = 0, .max = 100}, 0);
  pile.lean = radians(table.number("lean_deg", {.min = 0, .max = 90}));
  pile.lean_azimuth = radians(table.number("lean_azimuth_deg", {.min = -360, .max = 360}));
  pile.spread = radians(table.number("spread_deg", {.min = 0, .max = 90}));
  pile.bend = radians(table.number("bend_deg", {.min = -90, .max = 180}, 0));
  pile.curl = radians(table.number("curl_deg", {.min = 0, .max = 60}, 0));
  pile.curl_mm = table.number("curl_mm", {.min = 0.01, .max = 100}, 1);
  if (const auto ribs = table.optional_table("ribs")) {
    pile.ribs = static_cast<int>(ribs->integer("count", 1, 1000));
    pile.rib_gap_share = ribs->number("gap_share", {.min = 0, .max = 0.9});
    if (pile.height_mm == 0)
      table.fail("height_mm", "expected above 0: ribs are shorn to a rounded section");
  }
  return pile;
}

double segments_of_pile(const PileConfig& pile, double area_mm2, double segment_mm) {
  return pile.per_mm2 * area_mm2 *
         std::max<double>(kFewestPileSegments, std::ceil(pile.length_mm.mean / segment_mm));
}

void add_pile(const PileConfig& pile, double fiber_radius_mm, double segment_mm, std::uint64_t seed,
              std::uint32_t yarn_index, Exemplar& exemplar) {
  const double width = exemplar.width_mm;
  const double height = exemplar.height_mm;
  const double longest = kMostTiles * std::min(width, height);
  RandomStream tile_random(seed, RandomStage::kSynth, yarn_index, 0);
  const int count = draw_count(pile.per_mm2 * width * height, tile_random);
  // All roots are drawn in the ground as it was before the pile.
  const PileGround ground(pile, exemplar);
  std::vector<Vec3d> points;
  for (int i = 0; i < count; ++i) {
    RandomStream random(seed, RandomStage::kSynth, yarn_index, 1 + static_cast<std::uint64_t>(i));
    const auto root = ground.draw_root(random);
    if (!root) continue;
    const double length =
        std::clamp(pile.length_mm.draw(random), 0.1 * pile.length_mm.mean, longest);
    const PileDirection direction(pile, length, random);
    const int segments =
        std::max(kFewestPileSegments, static_cast<int>(std::ceil(length / segment_mm)));
    points = {*root};
    for (int k = 0; k < segments; ++k) {
      Vec3d step = length / segments * direction.at((k + 0.5) / segments);
      // Bent fibers lie down on the ground and do not dive into it.
      if (points.back().z() + step.z() < root->z()) step.z() = 0;
      if (step.norm() < 0.1 * length / segments) break;
      const Vec3d next = points.back() + step;
      const double limit = ground.shorn_at(next.x());
      if (next.z() > limit) {
        const double rest = (limit - points.back().z()) / std::max(1e-9, step.z());
        if (rest > 0.05) points.emplace_back(points.back() + std::min(1.0, rest) * step);
        break;
      }
      points.push_back(next);
    }
    if (points.size() < 3) continue;
    for (const Vec3d& point : points) exemplar.points.push_back(point.cast<float>());
    end_fiber(exemplar, fiber_radius_mm, pile.fiber, yarn_index, true);
  }
}

}  // namespace heddle
