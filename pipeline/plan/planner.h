#ifndef HEDDLE_PIPELINE_PLAN_PLANNER_H_
#define HEDDLE_PIPELINE_PLAN_PLANNER_H_
// The arithmetic of a plan, apart from where its numbers come from: how many samples a way to make
// a picture needs for a tolerance, what that costs, and which way is cheapest.
//
// Error of a picture of n samples per pixel: sqrt(bias^2 + noise^2 / n), relative RMSE. What is not
// known exactly counts with part of its standard error on the safe side. Tighter tolerances never
// get cheaper. Tested in tests/pipeline/plan_test.cpp.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/plan/probe.h"

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
  int changes = 0;             // settings that are not the fabrics' own
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

/// Is the bias alone too large for the tolerance if it is two standard errors larger than thought?
bool may_miss(const Candidate& candidate, double tolerance);

/// The samples of a picture to begin with: what it needs if its noise is what it is thought to be,
/// caution aside; the picture itself then says how many more (more_samples). At least 2, which tell
/// of noise.
int first_samples(const Candidate& candidate, double tolerance);

/// How many samples per pixel a picture of `done` still needs, `noise_square` being what it shows
/// itself of its own noise; 0 where it is good enough. At most as many again: more samples know
/// better.
int more_samples(const Candidate& candidate, const Estimate& noise_square, int done,
                 double tolerance);

/// The cheapest of those that meet the tolerance; nothing where none does.
std::optional<std::size_t> cheapest(std::span<const Candidate> candidates, double tolerance,
                                    int pictures);

/// Of those that cost little more, too: one that is known (by a pilot of its own) if there is one,
/// since finding out costs; and of these the one that errs least apart from noise, and of those
/// that err alike the one with the fewest changes: what each of them does here is known least.
std::optional<std::size_t> cheapest_known(std::span<const Candidate> candidates,
                                          const std::vector<bool>& known, double tolerance,
                                          int pictures);

/// The smallest tolerance that some candidate meets.
double best_tolerance(std::span<const Candidate> candidates);

/// A squared error with caution on the other side: what it may well be, at best.
Estimate at_best(const Estimate& square);

/// What a way errs by, of which only `thought` is known, if of a like one `like_thought` was and
/// `like_seen` is now: worse by as much, or better by the same factor.
Estimate alike(const Estimate& thought, const Estimate& like_thought, const Estimate& like_seen);

/// Two independent estimates of one quantity.
Estimate combined(const Estimate& a, const Estimate& b);

/// How far the squared error on a swatch is from that of a scene, relative, one standard error
/// (docs/plan.md).
inline constexpr double kTableError = 0.5;

/// What a way is thought to err by and what a pilot of it measured, both squared; `unseen` is the
/// share of the picture's pixels that the pilot left out. Both are wrong by a share of what the
/// error is, not of what they say it is: else the lower would count for more.
Estimate weighed(Estimate thought, Estimate measured, double unseen);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_PLANNER_H_
