#ifndef HEDDLE_PIPELINE_PLAN_FINDINGS_H_
#define HEDDLE_PIPELINE_PLAN_FINDINGS_H_
// What is known of every way: its prior, light between cloths, and what pilots found, put together
// into the candidates that are chosen among. Renders nothing. Tested in
// tests/pipeline/plan_test.cpp.

#include <optional>
#include <string>
#include <vector>

#include "pipeline/plan/choice.h"
#include "pipeline/plan/evidence.h"
#include "pipeline/plan/pilot.h"
#include "pipeline/plan/prior.h"
#include "pipeline/plan/ways.h"

namespace heddle {

/// A way to make the picture.
struct Way {
  WaySettings settings;
  WayPrior prior;  // against what the method claims to compute: without light between cloths
  Candidate candidate;
  std::optional<PilotOfWay> pilot = {};
  bool tried = false;  // it or one of its kind: noise and speed are this view's own
};

class Findings {
 public:
  /// Path tracing, from its first pilot.
  explicit Findings(Pilot paths);

  const std::vector<Way>& ways() const { return ways_; }
  std::vector<Way> take_ways() { return std::move(ways_); }
  const Pilot& paths() const { return paths_; }
  const Candidate& path_candidate() const { return ways_[0].candidate; }
  std::vector<Candidate> candidates() const;

  /// The squared light between cloths, which some ways lack; before any way is added.
  void set_light_between(const Estimate& square) { light_between_ = square; }
  void add_way(const WaySettings& settings, const WayPrior& prior, std::string name,
               double build_seconds);
  void set_build_seconds(std::size_t way, double seconds);

  /// Another pilot of paths, in place of the one before.
  void replace_paths(Pilot paths);
  /// Squared errors of the precomputed ways without surfaces are larger here by this factor.
  void raise_priors(double stress);
  /// A pilot of a way: its error, its noise and speed, and those of its kind.
  void add_trial(std::size_t way, const Pilot& pilot);

  /// The way has been tried against a pilot of as many paths as there are now.
  bool compared_with_these_paths(std::size_t way) const;

 private:
  Estimate relative(const Estimate& square) const;
  Estimate error_of(const Way& way) const;

  std::vector<Way> ways_;  // path tracing first
  Pilot paths_;
  Estimate path_variance_;  // absolute
  Estimate mean_;           // radiance
  Estimate light_between_;  // squared
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_FINDINGS_H_
