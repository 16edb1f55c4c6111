#ifndef HEDDLE_PIPELINE_PLAN_POLICY_H_
#define HEDDLE_PIPELINE_PLAN_POLICY_H_
// All numbers of a plan's policy, each with its reason. docs/plan-method.md says how they work
// together, docs/plan-experiments.md what was measured about them.

#include <cstdint>

namespace heddle {

struct PlanPolicy {
  // --- Pilots ---
  /// Edge of a pilot's blocks of pixels: neighbours share cache lines, blocks show how much the
  /// picture varies.
  int block_edge = 8;
  /// Pixels of the first pilot at most: a tenth of a second of paths.
  int first_pixels = 2048;
  /// Pixels of the first pilot at least, where the picture is small.
  int fewest_pixels = 256;
  /// Share of the picture's pixels in the first pilot of a small picture: it must stay cheap.
  double first_share = 0.25;
  /// Samples per pixel of the first pilot: two halves, which is the least that shows noise.
  int pilot_samples = 2;
  /// Added to the picture's seed: a pilot must not share the picture's random numbers.
  std::uint64_t pilot_seed = 0x9107;
  /// Standard error of the squared error that pilots of P pixels and s samples say, in units of
  /// noise^2 / (s sqrt(P)): measured on pilots of paths and of a fast method of about the same
  /// time.
  double pilot_noise = 2.5;

  // --- Priors: what tables say of a view ---
  /// Relative standard error of a table's squared error on another scene: measured on 60 scenes.
  double table_error = 0.5;
  /// Relative standard error of a way's noise, of which the table says the ratio to paths: the
  /// ratio varies between views.
  double noise_ratio_error = 0.2;
  /// A setting's error is above the fabric's own by this share of the square of what it changes:
  /// of many settings one merely looks better than it is.
  double change_share = 0.5;
  /// Weight of "errors under all lights are the same" against "they are independent": nothing tells
  /// which.
  double lights_together = 0.5;
  /// Least cosine that a light counts with: soft light comes from beside its axis too.
  double least_cosine = 0.05;
  /// Light between cloths by enclosure, relative to a table's folds: long valleys give each other
  /// more than drapes do. Fitted on 18 scenes.
  double between_of_folds = 0.6;
  /// Relative standard error of that: the ratio is beyond a factor of 2 for 5 of the 18.
  double between_error = 0.6;
  /// Path-traced samples that take as long as measuring a table: a plan that needs fewer traces
  /// paths.
  double table_samples = 4e6;

  // --- Evidence: what pilots say ---
  /// Relative standard error of a pilot's squared error, times the root of the share of pixels that
  /// it left out: few pixels hold most of the squares.
  double pilot_error = 0.4;
  /// Share of pixels that a pilot of all pixels has not seen: samples are few there too.
  double least_unseen = 0.25;
  /// Standard errors added to a pilot that says less than the prior: it misses rare large squares
  /// more often than it meets them.
  double doubt_of_less = 0.7;
  /// Squared errors of hard views are raised by this factor at most: five times is the most that
  /// was seen.
  double most_stress = 4;

  // --- Choice ---
  /// Standard errors added to a bias before it is compared: more turns fast methods away, less
  /// misses.
  double caution = 0.5;
  /// Share of the squared tolerance that is aimed at: a picture's noise is itself uncertain.
  double aim = 0.89;
  /// Standard errors added to the bias where they cost few samples: safety that is nearly free.
  double more_caution = 1;
  /// Share of its room that noise keeps under that caution: that many more samples at most.
  double room_kept = 0.88;

  // --- Finding out more ---
  /// Pilots after the first at most: an end where two ways take turns.
  int most_tries = 16;
  /// Share of its offer's time that trying the cheapest way may take: its noise and its speed here
  /// decide how many samples it needs.
  double try_share = 0.2;
  /// Share of the offer's time that a larger pilot of paths may take: it must stay
  /// small beside the picture.
  double pilot_share = 0.08;
  /// A way is tried to be cheaper if it would take at most this share of the offer's time: less is
  /// not worth a trial.
  double cheaper_share = 0.5;
  /// Share of what it may save that building its data and trying it may take: the trial may fail.
  double build_share = 0.25;
  /// Standard errors by which it may be better than expected: about one way in four is.
  double optimism = 0.7;
  /// A pilot is useful if its standard error is at most this share of that of what is known: one
  /// that is noisier hardly changes it.
  double useful_pilot = 0.8;
  /// A larger pilot is made such that its standard error is this share: some more than useful, for
  /// its noise is known only roughly.
  double wanted_pilot = 0.6;
};

inline constexpr PlanPolicy kPolicy;

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_POLICY_H_
