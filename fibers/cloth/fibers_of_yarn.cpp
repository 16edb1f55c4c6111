#include "fibers/cloth/fibers_of_yarn.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

using Vec2d = Eigen::Vector2d;

constexpr double kTurn = 2 * kPi;

// Wander is a sum of this many Fourier modes per axis.
constexpr int kWanderModes = 4;

// A fiber's place in its ply is jittered by this share of the spacing of the sunflower pattern.
constexpr double kPlaceJitter = 0.25;

// Points per turn of the tightest helix. A polyline with fewer does not look round.
constexpr double kPointsPerTurn = 14;

// Segments of the shortest open fiber, and most segments of a long one.
constexpr int kFewestSegments = 4;
constexpr int kMostSegmentsPerFiber = 1 << 16;

// A loop rises above its fiber by at least this factor (the published generator's).
constexpr double kLeastLift = 1.05;

// Where blocks must fit, a loop lies within one. Its top is at least this share of a block away
// from borders.
constexpr double kLeastRoomOfLoop = 0.2;

// Draws of a fiber for a loop of a given height, before there is taken to be none.
constexpr int kLoopDraws = 10000;

// Fourier modes of a fiber in a nep.
constexpr int kNepModes = 3;

// Random streams of one yarn: 0 for itself, 1 + i for fiber i, and these, far above.
enum class YarnStream : std::uint64_t { kLoops = 1, kHair, kSlubs, kAdded, kNeps };
RandomStream stream_of(std::uint64_t seed, std::uint32_t yarn, YarnStream kind,
                       std::uint64_t item) {
  return {seed, RandomStage::kSynth, yarn, (static_cast<std::uint64_t>(kind) << 40U) + item};
}

struct WanderMode {
  double waves;      // whole waves per period
  double amplitude;  // mm
  double phase;
};
using WanderModes = std::array<WanderMode, kWanderModes>;

// Modes whose slope has the given rms (mm per mm) over the period.
WanderModes wander_modes(double slope_rms, double period_mm, double radius_mm,
                         RandomStream& random) {
  WanderModes modes{};
  const double most = std::max(1.0, period_mm / (kShortestWander * radius_mm));
  const double least = std::min(most, std::max(1.0, period_mm / (kLongestWander * radius_mm)));
  // Each mode carries an equal share of the squared slope: (amplitude * 2 pi waves / period)^2 / 2
  // = rms^2 / modes.
  for (WanderMode& mode : modes) {
    mode.waves = std::round(least + (most - least) * random.uniform_double());
    mode.amplitude = slope_rms * std::sqrt(2.0 / kWanderModes) * period_mm / (kTurn * mode.waves);
    mode.phase = kTurn * random.uniform_double();
  }
  return modes;
}

double wander_at(const WanderModes& modes, double share_of_period) {
  double sum = 0;
  for (const WanderMode& mode : modes) {
    sum += mode.amplitude * std::sin(kTurn * mode.waves * share_of_period + mode.phase);
  }
  return sum;
}

Vec2d turned(const Vec2d& place, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * place.x() - s * place.y(), s * place.x() + c * place.y()};
}

// Beyond its period a yarn goes on in the next tile, and an open one not at all.
YarnPlace place_along(const CentreLine& line, double share) {
  if (line.is_open) return line.at(std::clamp(share, 0.0, 1.0));
  const double turns = std::floor(share);
  YarnPlace place = line.at(share - turns);
  if (turns != 0) place.position += turns * (line.at(1).position - line.at(0).position);
  return place;
}

// A fiber as it lies in its ply.
struct FiberOfPly {
  int ply;
  Vec2d place;  // in the ply's unit disc, where the fiber's twist starts and migration is nil
  double migration_phase;
  WanderModes wander_side, wander_up;
  std::optional<FittingFiber> fitting;
};

struct Loop {
  double centre_share;
  double half_share;
  double lift;  // of the fiber's distance from its ply's axis, at the loop's top
};

class FibersOfYarn {
 public:
  FibersOfYarn(const YarnConfig& yarn, double fiber_radius_mm, const CentreLine& line,
               double segment_mm, std::uint64_t seed, std::uint32_t yarn_index,
               const BlocksOfYarn& blocks, Exemplar& exemplar)
      : yarn_(yarn),
        fiber_radius_(fiber_radius_mm),
        line_(line),
        segment_mm_(segment_mm),
        seed_(seed),
        index_(yarn_index),
        exemplar_(exemplar),
        twist_(snap_twist(yarn, line.length_mm, blocks.count)),
        segments_(
            static_cast<int>(segments_per_fiber(yarn, line.length_mm, segment_mm, blocks.count))),
        blocks_(blocks),
        // once per turn of the ply, unless asked otherwise
        migration_waves_(
            std::max(1.0, std::round(yarn.migration_per_turn * std::abs(twist_.ply_turns)))),
        round_radius_(yarn.round_radius_mm(fiber_radius_mm)),
        places_(yarn.density) {
    shape_ = yarn.ply_mm ? *yarn.ply_mm : touching_plies(yarn.plies);
    if (yarn.ply_mm) {
      for (double* length : {&shape_.centre, &shape_.radial, &shape_.tangential})
        *length /= round_radius_;
    }
    if (blocks.count > 0) {
      fitting_.emplace(
          yarn, blocks,
          FittingFibers::Setup{fiber_radius_, line.length_mm, segments_, twist_.yarn_turns,
                               twist_.ply_turns, migration_waves_, seed, yarn_index});
      migration_waves_ = fitting_->migration_waves();
    }
    RandomStream slubs = stream_of(seed, yarn_index, YarnStream::kSlubs, 0);
    thickness_ = ThicknessProfile(yarn.slubs, line.length_mm, slubs);
  }

  void add_all() {
    RandomStream random(seed_, RandomStage::kSynth, fitting_ ? blocks_.pattern_yarn : index_, 0);
    const double yarn_phase = kTurn * random.uniform_double();
    for (int ply = 0; ply < yarn_.plies; ++ply)
      ply_phase_.push_back(yarn_phase + kTurn * ply / yarn_.plies);
    for (int ply = 0; ply < yarn_.plies; ++ply) {
      const double pattern_phase = kTurn * random.uniform_double();
      add_ply(ply, pattern_phase);
      add_hairs(ply);
      add_fibers_of_thick_places(ply);
    }
    add_neps();
  }

 private:
  // The fibers of a ply start as a sunflower pattern, jittered, whose radii are moved to the ply's
  // density.
  FiberOfPly fiber_in_pattern(int ply, int i, double pattern_phase) const {
    if (fitting_) {
      FittingFiber fitting = fitting_->fiber(ply, i);
      const Vec2d place = with_density(fitting.place);
      return {ply, place, fitting.migration_phase, {}, {}, std::move(fitting)};
    }
    const double golden_angle = kPi * (3 - std::sqrt(5.0));
    RandomStream random(seed_, RandomStage::kSynth, index_,
                        1 + static_cast<std::uint64_t>(ply * yarn_.fibers_per_ply + i));
    const double n = yarn_.fibers_per_ply;
    const double jitter = kPlaceJitter * std::sqrt(kPi / n);
    Vec2d place = turned({std::sqrt((i + 0.5) / n), 0}, pattern_phase + golden_angle * i);
    place.x() += jitter * (2 * random.uniform_double() - 1);
    place.y() += jitter * (2 * random.uniform_double() - 1);
    return fiber_at(ply, place, random);
  }

  // From a unit disc in which fibers lie evenly to the ply's.
  Vec2d with_density(Vec2d even) const {
    const double norm = std::min(1.0, even.norm());
    if (norm > 0) even *= places_.radius(norm * norm) / even.norm();
    return even;
  }

  // `even`: a place in the unit disc in which fibers lie evenly.
  FiberOfPly fiber_at(int ply, Vec2d even, RandomStream& random) const {
    // A slope of s along each of the two cross axes tilts the fiber by atan(sqrt(2) s).
    const double slope_rms = std::tan(yarn_.wander_rms) / std::sqrt(2.0);
    FiberOfPly fiber{ply, with_density(even), kTurn * random.uniform_double(), {}, {}, {}};
    fiber.wander_side = wander_modes(slope_rms, line_.length_mm, fiber_radius_, random);
    fiber.wander_up = wander_modes(slope_rms, line_.length_mm, fiber_radius_, random);
    return fiber;
  }

  // R(s) = R (1 - m (1 - cos(waves s + phase)) / 2), m = 1 - rho_min (Zhao et al. 2016, equation
  // 4).
  Vec2d in_ply(const FiberOfPly& fiber, double share) const {
    double phase = kTurn * migration_waves_ * share + fiber.migration_phase;
    double angle = kTurn * twist_.ply_turns * share;
    if (fitting_) {
      phase = fitting_->migration_phase(*fiber.fitting, share);
      angle = kTurn * fitting_->turns(*fiber.fitting, share);
    }
    const double squeeze = 1 - 0.5 * yarn_.migration * (1 - std::cos(phase));
    const Vec2d place = squeeze * turned(fiber.place, angle);
    return {shape_.radial * place.x(), shape_.tangential * place.y()};
  }

  // From beside the axis of a ply to the yarn's unit disc.
  Vec2d in_yarn(int ply, double share, const Vec2d& beside) const {
    return turned(beside + Vec2d(shape_.centre, 0),
                  ply_phase_[static_cast<std::size_t>(ply)] + kTurn * twist_.yarn_turns * share);
  }

  // From the yarn's unit disc to the cloth. `yarn`: the yarn's own place at that share.
  Vec3d in_cloth(const YarnPlace& yarn, double share, const Vec2d& place) const {
    const double thickness = thickness_.at(share);
    const Vec2d half(thickness * (yarn.half_width_mm - fiber_radius_),
                     thickness * (yarn.half_height_mm - fiber_radius_));
    const double outside = std::max(1.0, place.norm());
    const Vec2d edge = place / outside;
    const Vec2d across = edge.cwiseProduct(half) + (outside - 1) * round_radius_ * edge;
    return yarn.position + across.x() * yarn.side + across.y() * yarn.up;
  }

  Vec3d point_of(const FiberOfPly& fiber, double share, const Loop* loop) const {
    const Vec2d beside = in_ply(fiber, share);
    Vec2d place = in_yarn(fiber.ply, share, beside);
    const YarnPlace yarn = place_along(line_, share);
    if (yarn_.wander_rms > 0) {
      const Vec2d wander =
          fitting_ ? fitting_->wander_mm(*fiber.fitting, share)
                   : Vec2d(wander_at(fiber.wander_side, share), wander_at(fiber.wander_up, share));
      place.x() += wander.x() / (yarn.half_width_mm - fiber_radius_);
      place.y() += wander.y() / (yarn.half_height_mm - fiber_radius_);
    }
    place /= std::max(1.0, place.norm());
    if (loop != nullptr) {
      const double apart = share - loop->centre_share;
      const double distance = std::abs(apart - std::round(apart)) / loop->half_share;
      if (distance < 1) {
        const double rise = (loop->lift - 1) * std::pow(std::cos(kHalfPi * distance), 2);
        place += in_yarn(fiber.ply, share, beside * (1 + rise)) - in_yarn(fiber.ply, share, beside);
      }
    }
    return in_cloth(yarn, share, place);
  }

  void add_ply(int ply, double pattern_phase) {
    std::vector<FiberOfPly> fibers;
    for (int i = 0; i < yarn_.fibers_per_ply; ++i)
      fibers.push_back(fiber_in_pattern(ply, i, pattern_phase));
    const auto loops = draw_loops(ply, fibers);
    for (std::size_t i = 0; i < fibers.size(); ++i) {
      for (int k = 0; k <= segments_; ++k) {
        const double share = static_cast<double>(k) / segments_;
        const Loop* nearest = nullptr;
        for (const Loop& loop : loops[i]) {
          const double apart = share - loop.centre_share;
          if (std::abs(apart - std::round(apart)) < loop.half_share) nearest = &loop;
        }
        add_point(point_of(fibers[i], share, nearest));
      }
      end_own_fiber(line_.is_open);
    }
  }

  // Per fiber of the ply its loops, at most one at each outer turn of its migration.
  std::vector<std::vector<Loop>> draw_loops(int ply, const std::vector<FiberOfPly>& fibers) const {
    std::vector<std::vector<Loop>> loops(fibers.size());
    if (yarn_.loops.per_mm == 0) return loops;
    RandomStream random =
        stream_of(seed_, index_, YarnStream::kLoops, static_cast<std::uint64_t>(ply));
    const auto waves = static_cast<std::uint32_t>(migration_waves_);
    std::set<std::pair<std::uint32_t, std::uint32_t>> taken;
    const auto draw = [&](double height) {
      for (int k = 0; waves > 0 && k < kLoopDraws; ++k) {
        const std::uint32_t f = random.index(fibers.size());
        const std::uint32_t wave = random.index(waves);
        // The outer turn, where the phase of the migration is whole.
        double centre = (wave - fibers[f].migration_phase / kTurn) / migration_waves_;
        centre -= std::floor(centre);
        const double radius = round_radius_ * in_ply(fibers[f], centre).norm();
        if (kLeastLift * radius > height || radius <= 0) continue;
        double half = 0.5 / migration_waves_;
        if (fitting_) {  // within a block
          const double room = fitting_->distance_to_border(centre) - 1.0 / segments_;
          if (room < kLeastRoomOfLoop / blocks_.count) continue;
          half = std::min(half, room);
        }
        if (!taken.insert({f, wave}).second) continue;
        loops[f].push_back({centre, half, height / radius});
        return true;
      }
      return false;
    };
    const int count = draw_count(yarn_.loops.per_mm * line_.length_mm, random);
    for (int i = 0; i < count; ++i) {
      if (draw(yarn_.loops.height_mm.draw(random))) continue;
      throw std::invalid_argument(fmt::format(
          "no room for {} loops on a ply of yarn {}: {} fibers migrate {} times over {:.3g} mm, "
          "and "
          "few lie deep enough to rise to {:g} mm; make loops.per_m smaller or loops.height_mm "
          "larger",
          count, yarn_.name, fibers.size(), waves, line_.length_mm, yarn_.loops.height_mm.mean));
    }
    return loops;
  }

  void add_hairs(int ply) {
    if (yarn_.hairs.per_mm == 0) return;
    RandomStream random =
        stream_of(seed_, index_, YarnStream::kHair, static_cast<std::uint64_t>(ply) << 24U);
    const int count = draw_count(yarn_.hairs.per_mm * line_.length_mm, random);
    for (int h = 0; h < count; ++h) {
      RandomStream own =
          stream_of(seed_, index_, YarnStream::kHair,
                    (static_cast<std::uint64_t>(ply) << 24U) + 1U + static_cast<std::uint64_t>(h));
      const HairArc arc = draw_hair(yarn_.hairs, line_.length_mm, own);
      const auto point_at = [&](double t) {
        const double share = arc.start_share + t * arc.along;
        const double radius = (arc.start_mm + t * arc.rise_mm) / round_radius_;
        const Vec2d beside = turned({radius, 0}, arc.start_angle + t * arc.around);
        return in_cloth(place_along(line_, share), share, in_yarn(ply, share, beside));
      };
      double from = -arc.buried;
      double to = 1;
      if (line_.is_open && arc.along != 0) {  // hairs of an open yarn stop at its ends
        const double a = -arc.start_share / arc.along;
        const double b = (1 - arc.start_share) / arc.along;
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
      }
      const double length = std::hypot(arc.rise_mm, arc.along * line_.length_mm,
                                       (arc.start_mm + arc.rise_mm) * arc.around);
      add_open_fiber(from, to, (to - from) * length, point_at);
    }
  }

  // A thick place of thickness f has f^2 times as many fibers in its middle. The i-th of those
  // added lies where the section needs so many.
  void add_fibers_of_thick_places(int ply) {
    std::uint64_t item = static_cast<std::uint64_t>(ply) << 24U;
    for (const ThicknessProfile::Place& thick : thickness_.places()) {
      if (thick.thickness <= 1) continue;
      const double more = thick.thickness * thick.thickness - 1;
      const int count = static_cast<int>(std::lround(more * yarn_.fibers_per_ply));
      for (int i = 0; i < count; ++i) {
        RandomStream random = stream_of(seed_, index_, YarnStream::kAdded, item++);
        const FiberOfPly fiber = fiber_at(ply, sample_disk(random).cast<double>(), random);
        const double thickness = std::sqrt(1 + more * (i + 0.5) / count);
        const double bump = (thickness - 1) / (thick.thickness - 1);
        const double half = thick.half_share * std::acos(std::sqrt(bump)) / kHalfPi;
        double from = thick.centre_share - half;
        double to = thick.centre_share + half;
        if (line_.is_open) {
          from = std::max(from, 0.0);
          to = std::min(to, 1.0);
        }
        add_open_fiber(from, to, (to - from) * line_.length_mm,
                       [&](double share) { return point_of(fiber, share, nullptr); });
      }
    }
  }

  // A nep's fibers are closed random curves of few modes, left open at one place, in a ball that is
  // centred on the edge of the yarn.
  void add_neps() {
    if (yarn_.neps.per_mm == 0) return;
    RandomStream random = stream_of(seed_, index_, YarnStream::kNeps, 0);
    const int count = draw_count(yarn_.neps.per_mm * line_.length_mm, random);
    for (int n = 0; n < count; ++n) {
      const double share = random.uniform_double();
      const Vec3d centre = in_cloth(place_along(line_, share), share,
                                    turned({1, 0}, kTurn * random.uniform_double()));
      const double radius = std::max(2 * fiber_radius_, 0.5 * yarn_.neps.diameter_mm.draw(random));
      for (int i = 0; i < yarn_.neps.fibers; ++i) {
        std::array<Vec3d, kNepModes> cosines;
        std::array<Vec3d, kNepModes> sines;
        double most = 0;
        for (std::size_t m = 0; m < kNepModes; ++m) {
          cosines[m] = random.uniform_double() * sample_sphere(random).cast<double>();
          sines[m] = random.uniform_double() * sample_sphere(random).cast<double>();
          most += std::hypot(cosines[m].norm(), sines[m].norm());
        }
        const double scale = (radius - fiber_radius_) / most;
        add_open_fiber(0, 0.95, 2 * kTurn * radius, [&](double t) {
          Vec3d sum = Vec3d::Zero();
          for (std::size_t m = 0; m < kNepModes; ++m) {
            const double angle = kTurn * static_cast<double>(m + 1) * t;
            sum += std::cos(angle) * cosines[m] + std::sin(angle) * sines[m];
          }
          return Vec3d(centre + scale * sum);
        });
      }
    }
  }

  template <class PointAt>
  void add_open_fiber(double from, double to, double length_mm, PointAt&& point_at) {
    const int segments = std::clamp(static_cast<int>(std::ceil(length_mm / segment_mm_)),
                                    kFewestSegments, kMostSegmentsPerFiber);
    for (int k = 0; k <= segments; ++k) add_point(point_at(from + (to - from) * k / segments));
    end_own_fiber(true);
  }

  void add_point(const Vec3d& point) { exemplar_.points.push_back(point.cast<float>()); }

  void end_own_fiber(bool is_open) {
    end_fiber(exemplar_, fiber_radius_, yarn_.fiber, index_, is_open);
  }

  const YarnConfig& yarn_;
  double fiber_radius_;
  const CentreLine& line_;
  double segment_mm_;
  std::uint64_t seed_;
  std::uint32_t index_;
  Exemplar& exemplar_;
  SnappedTwist twist_;
  int segments_;  // of each fiber
  BlocksOfYarn blocks_;
  double migration_waves_;  // whole waves per period
  double round_radius_;     // mm
  RadialPlaces places_;
  PlyShape shape_;  // in the yarn's unit disc
  ThicknessProfile thickness_;
  std::vector<double> ply_phase_;
  std::optional<FittingFibers> fitting_;  // where blocks must fit
};

}  // namespace

SnappedTwist snap_twist(const YarnConfig& yarn, double period_mm, int blocks) {
  const double yarn_turns = yarn.yarn_turns_per_mm * period_mm;
  return {blocks > 0 ? fitting_yarn_turns(yarn_turns, yarn.plies, blocks)
                     : static_cast<int>(std::lround(yarn_turns)),
          static_cast<int>(std::lround(yarn.ply_turns_per_mm * period_mm))};
}

double segments_per_fiber(const YarnConfig& yarn, double period_mm, double segment_mm, int blocks) {
  const SnappedTwist twist = snap_twist(yarn, period_mm, blocks);
  const int turns =
      std::max(std::abs(twist.yarn_turns + twist.ply_turns), std::abs(twist.yarn_turns));
  const double segments =
      std::max({4.0, std::ceil(period_mm / segment_mm), std::ceil(kPointsPerTurn * turns)});
  if (blocks == 0) return segments;
  return blocks * std::max<double>(kFewestSegmentsOfBlock, std::ceil(segments / blocks));
}

double segments_of_yarn(const YarnConfig& yarn, double period_mm, double segment_mm, int blocks) {
  const auto open_fiber = [&](double length_mm) {
    return std::max<double>(kFewestSegments, length_mm / segment_mm + 0.5);
  };
  const Hairs& hairs = yarn.hairs;
  const double hair =
      2 * std::hypot(hairs.rise_mm.mean, std::hypot(hairs.along_mm.mean, hairs.along_mm.deviation),
                     (hairs.start_mm.mean + hairs.rise_mm.mean) *
                         std::hypot(hairs.around.mean, hairs.around.deviation));
  double of_ply = yarn.fibers_per_ply * segments_per_fiber(yarn, period_mm, segment_mm, blocks) +
                  hairs.per_mm * period_mm * open_fiber(hair);
  for (const Slubs& slubs : yarn.slubs) {
    const double more = std::max(0.0, std::pow(slubs.thickness.mean, 2) - 1);
    of_ply += slubs.per_mm * period_mm * more * yarn.fibers_per_ply *
              open_fiber(0.5 * slubs.length_mm.mean);
  }
  return yarn.plies * of_ply + yarn.neps.per_mm * period_mm * yarn.neps.fibers *
                                   open_fiber(kTurn * yarn.neps.diameter_mm.mean);
}

void add_fibers_of_yarn(const YarnConfig& yarn, double fiber_radius_mm, const CentreLine& line,
                        double segment_mm, std::uint64_t seed, std::uint32_t yarn_index,
                        Exemplar& exemplar, const BlocksOfYarn& blocks) {
  FibersOfYarn(yarn, fiber_radius_mm, line, segment_mm, seed, yarn_index, blocks, exemplar)
      .add_all();
}

}  // namespace heddle
