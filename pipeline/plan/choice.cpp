#include "pipeline/plan/choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/plan/policy.h"

namespace heddle {
namespace {

double cautious(const Estimate& square, double caution = kPolicy.caution) {
  return std::max(0.0, square.value) + caution * square.error;
}

/// Squared error that noise may have.
double room(const Candidate& candidate, double tolerance) {
  const auto left = [&](double caution) {
    return kPolicy.aim * tolerance * tolerance - cautious(candidate.bias_square, caution);
  };
  return std::max(left(kPolicy.more_caution), kPolicy.room_kept * left(kPolicy.caution));
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

double best_tolerance(std::span<const Candidate> candidates) {
  double best = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    const double noise = cautious(candidate.noise_square) / kMostSamples;
    const double square = std::min(cautious(candidate.bias_square, kPolicy.more_caution) + noise,
                                   cautious(candidate.bias_square) + noise / kPolicy.room_kept);
    best = std::min(best, std::sqrt(square / kPolicy.aim));
  }
  return best;
}

Estimate at_best(const Estimate& square) {
  return {std::max(0.0, square.value - kPolicy.optimism * square.error), 0};
}

}  // namespace heddle
