#ifndef HEDDLE_PIPELINE_PLAN_CHOICE_H_
#define HEDDLE_PIPELINE_PLAN_CHOICE_H_
// What a way to make a picture costs for a tolerance, and which way is chosen. Pure functions.
//
// Error of a picture of n samples per pixel: sqrt(bias^2 + noise^2 / n), relative RMSE. Part of the
// standard error of what is not known exactly is added (PlanPolicy::caution). Tighter tolerances
// never get cheaper. Tested in tests/pipeline/plan_test.cpp.

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "pipeline/accuracy/probe.h"

namespace heddle {

/// One way to make a picture. Squares are relative to the squared mean radiance.
struct Candidate {
  std::string name;
  Estimate bias_square;        // 0 for path tracing
  Estimate noise_square;       // variance of one sample of a pixel
  double build_seconds = 0;    // of data that the cache lacks
  double setup_seconds = 0;    // of every picture
  double seconds_per_spp = 0;  // of every picture
  int spp_step = 1;            // samples come in multiples of this
};

/// What a candidate takes to meet a tolerance.
struct Offer {
  int spp = 0;
  double seconds_per_picture = 0;
  double seconds = 0;         // building, and all pictures
  double expected_error = 0;  // relative RMSE, without safety
};

/// Nothing where the candidate's bias alone is too large, or more than kMostSamples would be
/// needed.
inline constexpr int kMostSamples = 1 << 20;
std::optional<Offer> offer(const Candidate& candidate, double tolerance, int pictures);

/// The samples of a picture to begin with: as many as the expected noise needs, without caution.
/// The picture itself then says how many more (more_samples). At least 2, which show noise.
int first_samples(const Candidate& candidate, double tolerance);

/// How many more samples per pixel a picture of `done` samples needs; 0 where it is good enough.
/// `noise_square` is what the picture shows of its own noise. At most as many again: it is asked
/// again after those.
int more_samples(const Candidate& candidate, const Estimate& noise_square, int done,
                 double tolerance);

/// The cheapest of those that meet the tolerance; nothing where none does.
std::optional<std::size_t> cheapest(std::span<const Candidate> candidates, double tolerance,
                                    int pictures);

/// The smallest tolerance that some candidate meets.
double best_tolerance(std::span<const Candidate> candidates);

/// The squared error that a way has at best: less by part of its standard error, without caution.
Estimate at_best(const Estimate& square);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_CHOICE_H_
