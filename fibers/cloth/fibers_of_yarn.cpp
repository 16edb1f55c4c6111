#include "fibers/cloth/fibers_of_yarn.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "fibers/math/random.h"

namespace heddle {
namespace {

constexpr double kTurn = 2 * kPi;

// Wander is a sum of this many Fourier modes per axis. Their wavelengths lie between kShortestWave
// and kLongestWave fiber radii. That is long against the fiber's thickness, and short enough that
// even 10 degrees stay within the yarn.
constexpr int kWanderModes = 4;
constexpr double kShortestWave = 25;
constexpr double kLongestWave = 80;

// A fiber's place in its ply is jittered by this share of the spacing of the sunflower pattern.
constexpr double kPlaceJitter = 0.25;

// Points per turn of the tightest helix. A polyline with fewer does not look round.
constexpr double kPointsPerTurn = 14;

// Ply cross-sections are circles that touch each other and the yarn's edge. Two plies are stretched
// across the line of their centres as far as the yarn's disc allows (semi-axis sqrt(1/2)).
struct PlyShape {
  double centre;      // distance of the ply's axis from the yarn's axis
  double radial;      // semi-axis towards the yarn's axis
  double tangential;  // semi-axis across
};
PlyShape ply_shape(int plies) {
  if (plies == 1) return {0, 1, 1};
  if (plies == 2) return {0.5, 0.5, std::sqrt(0.5)};
  const double s = std::sin(kPi / plies);
  const double radius = s / (1 + s);
  return {1 - radius, radius, radius};
}

struct WanderMode {
  double waves;      // whole waves per period
  double amplitude;  // mm
  double phase;
};

// Modes whose slope has the given rms (mm per mm) over the period.
std::array<WanderMode, kWanderModes> wander_modes(double slope_rms, double period_mm,
                                                  double radius_mm, RandomStream& random) {
  std::array<WanderMode, kWanderModes> modes{};
  const double most = std::max(1.0, period_mm / (kShortestWave * radius_mm));
  const double least = std::min(most, std::max(1.0, period_mm / (kLongestWave * radius_mm)));
  // Each mode carries an equal share of the squared slope: (amplitude * 2 pi waves / period)^2 / 2
  // = rms^2 / modes.
  for (WanderMode& mode : modes) {
    mode.waves = std::round(least + (most - least) * random.uniform_double());
    mode.amplitude = slope_rms * std::sqrt(2.0 / kWanderModes) * period_mm / (kTurn * mode.waves);
    mode.phase = kTurn * random.uniform_double();
  }
  return modes;
}

double wander_at(const std::array<WanderMode, kWanderModes>& modes, double share_of_period) {
  double sum = 0;
  for (const WanderMode& mode : modes) {
    sum += mode.amplitude * std::sin(kTurn * mode.waves * share_of_period + mode.phase);
  }
  return sum;
}

}  // namespace

SnappedTwist snap_twist(const YarnConfig& yarn, double period_mm) {
  return {static_cast<int>(std::lround(yarn.yarn_turns_per_mm * period_mm)),
          static_cast<int>(std::lround(yarn.ply_turns_per_mm * period_mm))};
}

double segments_per_fiber(const YarnConfig& yarn, double period_mm, double segment_mm) {
  const SnappedTwist twist = snap_twist(yarn, period_mm);
  const int turns =
      std::max(std::abs(twist.yarn_turns + twist.ply_turns), std::abs(twist.yarn_turns));
  return std::max({4.0, std::ceil(period_mm / segment_mm), std::ceil(kPointsPerTurn * turns)});
}

void add_fibers_of_yarn(const YarnConfig& yarn, double fiber_radius_mm, const CentreLine& line,
                        double segment_mm, std::uint64_t seed, std::uint32_t yarn_index,
                        Exemplar& exemplar) {
  const double period = line.length_mm;
  const SnappedTwist twist = snap_twist(yarn, period);
  const PlyShape shape = ply_shape(yarn.plies);
  const int segments = static_cast<int>(segments_per_fiber(yarn, period, segment_mm));
  // A slope of s along each of the two cross axes tilts the fiber by atan(sqrt(2) s).
  const double slope_rms = std::tan(yarn.wander_rms) / std::sqrt(2.0);
  const double golden_angle = kPi * (3 - std::sqrt(5.0));
  RandomStream yarn_random(seed, RandomStage::kSynth, yarn_index, 0);
  const double yarn_phase = kTurn * yarn_random.uniform_double();

  for (int ply = 0; ply < yarn.plies; ++ply) {
    const double ply_phase = yarn_phase + kTurn * ply / yarn.plies;
    const double pattern_phase = kTurn * yarn_random.uniform_double();
    for (int i = 0; i < yarn.fibers_per_ply; ++i) {
      RandomStream random(seed, RandomStage::kSynth, yarn_index,
                          1 + static_cast<std::uint64_t>(ply * yarn.fibers_per_ply + i));
      // Place in the ply's unit disc: a sunflower pattern, jittered.
      const double n = yarn.fibers_per_ply;
      const double jitter = kPlaceJitter * std::sqrt(kPi / n);
      const double r = std::sqrt((i + 0.5) / n);
      const double angle = pattern_phase + golden_angle * i;
      double u0 = r * std::cos(angle) + jitter * (2 * random.uniform_double() - 1);
      double v0 = r * std::sin(angle) + jitter * (2 * random.uniform_double() - 1);
      const double norm = std::hypot(u0, v0);
      if (norm > 1) {
        u0 /= norm;
        v0 /= norm;
      }
      // Radial migration: R(s) = R (1 - m (1 + cos(waves s + phase)) / 2), once per turn of the ply
      // and at least once.
      const double migration_waves = std::max(1, std::abs(twist.ply_turns));
      const double migration_phase = kTurn * random.uniform_double();
      const auto wander_u = wander_modes(slope_rms, period, fiber_radius_mm, random);
      const auto wander_v = wander_modes(slope_rms, period, fiber_radius_mm, random);

      for (int k = 0; k <= segments; ++k) {
        const double share = static_cast<double>(k % segments) / segments;
        const double squeeze =
            1 - 0.5 * yarn.migration *
                    (1 + std::cos(kTurn * migration_waves * share + migration_phase));
        const YarnPlace place = line.at(static_cast<double>(k) / segments);
        const double half_width = place.half_width_mm - fiber_radius_mm;
        const double half_height = place.half_height_mm - fiber_radius_mm;
        const double ply_turn = kTurn * twist.ply_turns * share;
        const double u = squeeze * (u0 * std::cos(ply_turn) - v0 * std::sin(ply_turn));
        const double v = squeeze * (u0 * std::sin(ply_turn) + v0 * std::cos(ply_turn));
        // Into the yarn's disc: radial axis towards the ply's centre, which turns about the yarn.
        const double a = ply_phase + kTurn * twist.yarn_turns * share;
        const double radial = shape.centre + shape.radial * u;
        const double tangential = shape.tangential * v;
        double x = half_width * (radial * std::cos(a) - tangential * std::sin(a)) +
                   wander_at(wander_u, share);
        double y = half_height * (radial * std::sin(a) + tangential * std::cos(a)) +
                   wander_at(wander_v, share);
        const double outside = std::hypot(x / half_width, y / half_height);
        if (outside > 1) {
          x /= outside;
          y /= outside;
        }
        exemplar.points.push_back((place.position + x * place.side + y * place.up).cast<float>());
      }
      exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
      exemplar.radius_mm.push_back(static_cast<float>(fiber_radius_mm));
      exemplar.material.push_back(static_cast<std::uint16_t>(yarn.fiber));
      exemplar.yarn.push_back(yarn_index);
      exemplar.is_open.push_back(line.is_open ? 1 : 0);
    }
  }
}

}  // namespace heddle
