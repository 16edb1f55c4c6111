#include "fibers/cloth/fitting_fibers.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "fibers/math/random.h"
#include "fibers/math/wrapped.h"

namespace heddle {
namespace {

constexpr double kFullTurn = 2 * kPi;
constexpr double kGoldenShare = 0.6180339887498949;

// Wander becomes a block's own over half the longest wave, or this share of a block.
constexpr double kLongestRamp = 0.3;

// A ring's place is jittered by this share of the distance between fibers.
constexpr double kRingJitter = 0.25;

// Random streams of one yarn, beside those of fibers_of_yarn.cpp.
enum class FittingStream : std::uint64_t { kPattern = 6, kRings, kBorders, kBlocks, kPhases };
std::uint64_t sample_of(FittingStream kind, std::uint64_t item) {
  return (static_cast<std::uint64_t>(kind) << 40U) + item;
}

// From 0 to 1, level at both.
double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Eigen::Vector2d at_angle(double radius, double turns) {
  return {radius * std::cos(kFullTurn * turns), radius * std::sin(kFullTurn * turns)};
}

// `along`: blocks from where the phases are told.
double sum_of(const std::array<FittingWander::Mode, FittingWander::kModes>& modes, double along) {
  double sum = 0;
  for (const auto& mode : modes)
    sum += mode.amplitude * std::sin(kFullTurn * mode.waves * along + mode.phase);
  return sum;
}

Eigen::Vector2d wander_at_place(const FittingWander& wander, double along) {
  return {sum_of(wander.side, along), sum_of(wander.up, along)};
}

}  // namespace

int fitting_yarn_turns(double turns, int plies, int blocks) {
  // n blocks turn by a multiple of n / plies: whole where it is one of n / gcd(n, plies).
  const int step = blocks / std::gcd(blocks, plies);
  return step * static_cast<int>(std::lround(turns / step));
}

FittingFibers::FittingFibers(const YarnConfig& yarn, const BlocksOfYarn& blocks, const Setup& setup)
    : yarn_(yarn),
      setup_(setup),
      blocks_(blocks.count),
      pattern_yarn_(blocks.pattern_yarn),
      order_(std::min(
          {blocks_ / std::gcd(blocks_, setup.ply_turns), kMostFibersOfRing, yarn.fibers_per_ply})),
      flat_(static_cast<double>(blocks_) / setup.segments) {
  pattern_angle_ = RandomStream(setup.seed, RandomStage::kSynth, pattern_yarn_,
                                sample_of(FittingStream::kPattern, 0))
                       .uniform_double();
  const double block_mm = setup.length_mm / blocks_;
  ramp_ = std::min(kLongestRamp, 0.5 * kLongestWander * setup.fiber_radius_mm / block_mm);
  // Phases of slots allow a turns + b blocks waves, a and b whole.
  double best = 1e300;
  for (int by_turn = -blocks_; by_turn <= blocks_; ++by_turn) {
    const double rest = setup.migration_waves - by_turn * setup.ply_turns;
    const int of_block = static_cast<int>(std::lround(rest / blocks_));
    // of equally good ones the simplest
    const double cost =
        std::abs(rest - of_block * blocks_) + 1e-3 * std::abs(of_block) + 1e-6 * std::abs(by_turn);
    if (cost >= best) continue;
    best = cost;
    waves_by_turn_ = by_turn;
    waves_of_block_ = of_block;
  }
}

FittingFiber FittingFibers::fiber(int ply, int i) const {
  const int n = yarn_.fibers_per_ply;
  const int inner = n % order_;  // fibers that fill no ring lie in one of their own, innermost
  const bool is_inner = i < inner;
  const int ring = is_inner ? 0 : 1 + (i - inner) / order_;
  const int first = is_inner ? 0 : inner + (ring - 1) * order_;
  FittingFiber fiber;
  fiber.order = is_inner ? inner : order_;
  RandomStream random(setup_.seed, RandomStage::kSynth, pattern_yarn_,
                      sample_of(FittingStream::kRings, static_cast<std::uint64_t>(ring)));
  // The rings' first fibers make a sunflower of one sector; a single fiber lies on the axis.
  const double radius = inner == 1 && is_inner ? 0 : std::sqrt((first + 0.5 * fiber.order) / n);
  const double jitter = radius > 0 ? kRingJitter * std::sqrt(kPi / n) : 0;
  Eigen::Vector2d place = at_angle(radius, pattern_angle_ + kGoldenShare * ring / fiber.order);
  place.x() += jitter * (2 * random.uniform_double() - 1);
  place.y() += jitter * (2 * random.uniform_double() - 1);
  const double ring_phase = kFullTurn * random.uniform_double();
  const double sector = static_cast<double>(i - first) / fiber.order;
  const double c = std::cos(kFullTurn * sector);
  const double s = std::sin(kFullTurn * sector);
  fiber.place = {c * place.x() - s * place.y(), s * place.x() + c * place.y()};
  fiber.migration_phase = ring_phase + kFullTurn * waves_by_turn_ * sector;
  const auto own_block = [&](int block) {
    return (static_cast<std::uint64_t>(ply) * n + i) * blocks_ + block;
  };
  for (int block = 0; yarn_.migration > 0 && block < blocks_; ++block) {
    RandomStream own(setup_.seed, RandomStage::kSynth, setup_.yarn_index,
                     sample_of(FittingStream::kPhases, own_block(block)));
    fiber.phase_within.push_back(kPi * (2 * own.uniform_double() - 1));
  }
  if (yarn_.wander_rms == 0) return fiber;
  for (int border = 0; border <= blocks_; ++border) {
    const int by =
        static_cast<int>(std::lround(fiber.order * turns_at_border(fiber.order, border)));
    const int slot = first + wrapped(i - first + by, fiber.order);
    const int ply_there =
        wrapped(ply + yarn_.plies * setup_.yarn_turns * border / blocks_, yarn_.plies);
    fiber.at_border.push_back(draw_wander(
        pattern_yarn_,
        sample_of(FittingStream::kBorders, static_cast<std::uint64_t>(ply_there) * n + slot)));
  }
  for (int block = 0; block < blocks_; ++block) {
    fiber.within.push_back(
        draw_wander(setup_.yarn_index, sample_of(FittingStream::kBlocks, own_block(block))));
  }
  return fiber;
}

FittingWander FittingFibers::draw_wander(std::uint32_t yarn, std::uint64_t sample) const {
  RandomStream random(setup_.seed, RandomStage::kSynth, yarn, sample);
  const double block_mm = setup_.length_mm / blocks_;
  const double most = block_mm / (kShortestWander * setup_.fiber_radius_mm);
  const double least = block_mm / (kLongestWander * setup_.fiber_radius_mm);
  // A slope of s along each of the two cross axes tilts the fiber by atan(sqrt(2) s).
  const double slope_rms = std::tan(yarn_.wander_rms) / std::sqrt(2.0);
  // Blended waves are steeper: weights cos t and sin t add (dt/dshare)^2 to the squared wave
  // number. Its mean over a block, t = smooth_step pi / 2 over both ramps:
  const double of_ramps = 2 * kHalfPi * kHalfPi * 1.2 / ramp_;
  FittingWander wander{};
  for (auto* modes : {&wander.side, &wander.up}) {
    for (FittingWander::Mode& mode : *modes) {
      mode.waves = least + (most - least) * random.uniform_double();
      mode.amplitude = slope_rms * std::sqrt(2.0 / FittingWander::kModes) * block_mm /
                       std::sqrt(std::pow(kFullTurn * mode.waves, 2) + of_ramps);
      mode.phase = kFullTurn * random.uniform_double();
    }
  }
  return wander;
}

FittingFibers::InBlock FittingFibers::in_block(double share) const {
  const double along = share * blocks_;
  const int block = std::clamp(static_cast<int>(std::floor(along)), 0, blocks_ - 1);
  return {block, along - block};
}

double FittingFibers::turns_at_border(int order, int border) const {
  const double even = static_cast<double>(order) * setup_.ply_turns * border / blocks_;
  return std::floor(even + 0.5) / order;
}

double FittingFibers::turns(const FittingFiber& fiber, double share) const {
  const InBlock at = in_block(share);
  const auto uneven = [&](int border) {
    return turns_at_border(fiber.order, border) -
           static_cast<double>(setup_.ply_turns) * border / blocks_;
  };
  const double t = smooth_step((at.share - flat_) / (1 - 2 * flat_));
  return setup_.ply_turns * share + (1 - t) * uneven(at.block) + t * uneven(at.block + 1);
}

double FittingFibers::migration_phase(const FittingFiber& fiber, double share) const {
  double ahead = 0;
  if (!fiber.phase_within.empty()) {
    const InBlock at = in_block(share);
    const double from_border = std::min(at.share, 1 - at.share);
    ahead = smooth_step((from_border - flat_) / (0.5 - flat_)) *
            fiber.phase_within[static_cast<std::size_t>(at.block)];
  }
  const double waves = waves_by_turn_ * turns(fiber, share) + waves_of_block_ * blocks_ * share;
  return fiber.migration_phase + ahead + kFullTurn * waves;
}

Eigen::Vector2d FittingFibers::wander_mm(const FittingFiber& fiber, double share) const {
  if (fiber.within.empty()) return Eigen::Vector2d::Zero();
  const InBlock at = in_block(share);
  const auto block = static_cast<std::size_t>(at.block);
  const double before = kHalfPi * smooth_step((at.share - flat_) / ramp_);
  const double after = kHalfPi * smooth_step((1 - flat_ - at.share) / ramp_);
  Eigen::Vector2d sum =
      std::sin(std::min(before, after)) * wander_at_place(fiber.within[block], at.share);
  if (before < kHalfPi) sum += std::cos(before) * wander_at_place(fiber.at_border[block], at.share);
  if (after < kHalfPi)
    sum += std::cos(after) * wander_at_place(fiber.at_border[block + 1], at.share - 1);
  return sum;
}

double FittingFibers::distance_to_border(double share) const {
  const InBlock at = in_block(share);
  return std::min(at.share, 1 - at.share) / blocks_;
}

}  // namespace heddle
