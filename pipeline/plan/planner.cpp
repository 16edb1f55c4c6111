#include "pipeline/plan/planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace heddle {
namespace {

// Standard errors added to what a candidate is thought to err by. More would turn away fast methods
// whose error is near the tolerance, at a high price; less would miss it.
constexpr double kCaution = 0.25;
// Share of the squared tolerance that is aimed at: the noise of a picture is itself uncertain.
constexpr double kAim = 0.89;

// Standard errors less at best: finding out more costs little beside what it may save.
constexpr double kOptimism = 0.7;
// Standard errors more at which it is worth looking twice.
constexpr double kDoubt = 2;
// More caution of the bias is taken as long as noise keeps this share of its room: that many more
// samples at most.
constexpr double kMoreCaution = 1;
constexpr double kRoomKept = 0.88;

// What is known, or errs less apart from noise, may cost so much more: what is not known may be
// worse than thought, and noise alone can be mended.
constexpr double kLittleMore = 1.25;
// Squared errors that differ by this share of the squared tolerance are alike.
constexpr double kLittleBias = 0.02;
// Of a pilot of few of the picture's pixels, relative: a few pixels hold most of the squares, and
// it misses more of them than it meets.
constexpr double kPilotError = 0.4;

double cautious(const Estimate& square, double caution = kCaution) {
  return std::max(0.0, square.value) + caution * square.error;
}

/// Squared error that noise may have.
double room(const Candidate& candidate, double tolerance) {
  const auto left = [&](double caution) {
    return kAim * tolerance * tolerance - cautious(candidate.bias_square, caution);
  };
  return std::max(left(kMoreCaution), kRoomKept * left(kCaution));
}

/// Samples in the candidate's steps; one step more than kMostSamples where those are not enough.
int in_steps(double samples, int step) {
  const double steps = std::ceil(std::min(samples, static_cast<double>(kMostSamples)) / step);
  return step * std::max(1, static_cast<int>(steps));
}

}  // namespace

std::optional<Offer> offer(const Candidate& candidate, double tolerance, int pictures) {
  const double left = room(candidate, tolerance);
  const double needed =
      left > 0 ? cautious(candidate.noise_square) / left : std::numeric_limits<double>::infinity();
  if (!(needed <= kMostSamples)) return {};
  Offer result;
  result.spp = in_steps(needed, candidate.spp_step);
  result.seconds_per_picture = candidate.setup_seconds + result.spp * candidate.seconds_per_spp;
  result.seconds = candidate.build_seconds + pictures * result.seconds_per_picture;
  result.expected_error = std::sqrt(std::max(0.0, candidate.bias_square.value) +
                                    std::max(0.0, candidate.noise_square.value) / result.spp);
  return result;
}

bool may_miss(const Candidate& candidate, double tolerance) {
  return cautious(candidate.bias_square, kDoubt) > kAim * tolerance * tolerance;
}

int first_samples(const Candidate& candidate, double tolerance) {
  const double left = room(candidate, tolerance);
  return left > 0 ? in_steps(std::max(2.0, candidate.noise_square.value / left), candidate.spp_step)
                  : 2;
}

int more_samples(const Candidate& candidate, const Estimate& noise_square, int done,
                 double tolerance) {
  const double left = room(candidate, tolerance);
  if (!(left > 0)) return 0;
  const double needed = cautious(noise_square) / left;
  if (needed <= done || done >= kMostSamples) return 0;
  return in_steps(std::min(needed, 2.0 * done) - done, candidate.spp_step);
}

std::optional<std::size_t> cheapest(std::span<const Candidate> candidates, double tolerance,
                                    int pictures) {
  std::optional<std::size_t> best;
  double seconds = 0;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::optional<Offer> made = offer(candidates[k], tolerance, pictures);
    if (!made || (best && made->seconds >= seconds)) continue;
    best = k;
    seconds = made->seconds;
  }
  return best;
}

std::optional<std::size_t> cheapest_known(std::span<const Candidate> candidates,
                                          const std::vector<bool>& known, double tolerance,
                                          int pictures) {
  const std::optional<std::size_t> cheapest_of_all = cheapest(candidates, tolerance, pictures);
  if (!cheapest_of_all) return {};
  const double most_seconds =
      kLittleMore * offer(candidates[*cheapest_of_all], tolerance, pictures)->seconds;
  std::vector<std::size_t> rivals;
  bool any_known = false;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::optional<Offer> made = offer(candidates[k], tolerance, pictures);
    if (!made || made->seconds > most_seconds) continue;
    rivals.push_back(k);
    any_known = any_known || known[k];
  }
  if (any_known) std::erase_if(rivals, [&](std::size_t k) { return !known[k]; });
  const auto bias = [&](std::size_t k) {
    return cautious(candidates[k].bias_square, kMoreCaution);
  };
  const double least =
      bias(*std::min_element(rivals.begin(), rivals.end(),
                             [&](std::size_t a, std::size_t b) { return bias(a) < bias(b); }));
  std::erase_if(
      rivals, [&](std::size_t k) { return bias(k) > least + kLittleBias * tolerance * tolerance; });
  const auto rank = [&](std::size_t k) {
    return std::pair(candidates[k].changes, offer(candidates[k], tolerance, pictures)->seconds);
  };
  return *std::min_element(rivals.begin(), rivals.end(),
                           [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
}

double best_tolerance(std::span<const Candidate> candidates) {
  double best = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    const double noise = cautious(candidate.noise_square) / kMostSamples;
    const double square = std::min(cautious(candidate.bias_square, kMoreCaution) + noise,
                                   cautious(candidate.bias_square) + noise / kRoomKept);
    best = std::min(best, std::sqrt(square / kAim));
  }
  return best;
}

Estimate at_best(const Estimate& square) {
  return {std::max(0.0, square.value - kOptimism * square.error), 0};
}

Estimate weighed(Estimate thought, Estimate measured, double unseen) {
  // No square is negative: what is below 0 is noise, however little of it the pilot thinks that it
  // has.
  measured.error = std::max(measured.error, -measured.value);
  const double square = std::max(thought.value, measured.value - measured.error);
  thought.error = std::max(thought.error, kTableError * square);
  measured.error = std::hypot(measured.error, kPilotError * std::sqrt(unseen) * square);
  return combined(thought, measured);
}

Estimate alike(const Estimate& thought, const Estimate& like_thought, const Estimate& like_seen) {
  const double value = like_seen.value >= like_thought.value || !(like_thought.value > 0)
                           ? thought.value + like_seen.value - like_thought.value
                           : thought.value * std::max(0.0, like_seen.value) / like_thought.value;
  return {value,
          std::min(std::hypot(like_seen.error, kTableError * (thought.value - like_thought.value)),
                   std::hypot(thought.error, kTableError * (value - thought.value)))};
}

Estimate combined(const Estimate& a, const Estimate& b) {
  if (!(a.error > 0)) return a;
  if (!(b.error > 0)) return b;
  const double weight_a = 1 / (a.error * a.error);
  const double weight_b = 1 / (b.error * b.error);
  return {(weight_a * a.value + weight_b * b.value) / (weight_a + weight_b),
          1 / std::sqrt(weight_a + weight_b)};
}

}  // namespace heddle
