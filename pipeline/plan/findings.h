#ifndef HEDDLE_PIPELINE_PLAN_FINDINGS_H_
#define HEDDLE_PIPELINE_PLAN_FINDINGS_H_
// What is known of every way: its prior, light between cloths, and what pilots found, put together
// into the candidates that are chosen among. Renders nothing. Tested in
// tests/pipeline/plan_test.cpp.

#include <map>
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
  std::optional<PilotOfWay> pilot = {};  // of one of its kind at most
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
  const Estimate& light_between() const { return light_between_; }
  std::vector<Candidate> candidates() const;
  std::vector<bool> tried() const;

  void add_way(const WaySettings& settings, const WayPrior& prior, std::string name, int changes,
               double build_seconds);
  void set_build_seconds(std::size_t way, double seconds);

  /// Another pilot of paths, in place of the one before.
  void replace_paths(Pilot paths);
  /// The same paths without what they meet beyond the cloth that they leave. All that methods lack
  /// which end light there; light from afar is smooth. `prior`: of the squared light between
  /// cloths.
  void add_local_paths(const Pilot& local, const Estimate& prior);
  /// The picture's mean radiance, which few paths tell badly, by a fast way's pilot.
  void refine_mean(std::size_t way, const Pilot& pilot);
  /// Squared errors of the precomputed ways without surfaces are larger here by this factor.
  void raise_priors(double stress);
  /// A pilot of a way: its noise and speed, and those of its kind; its error. `may_lower`: see
  /// PilotOfWay.
  void add_trial(std::size_t way, const Pilot& pilot, bool may_lower);

  /// The way's kind has been tried against a pilot of as many paths as there are now.
  bool compared_with_these_paths(std::size_t way) const;
  /// Is light between cloths what is known least of the way's error?
  bool between_matters(const Way& way) const;

 private:
  Estimate relative(const Estimate& square) const;
  Estimate prior_of(const Way& way) const;
  void add_up();

  std::vector<Way> ways_;  // path tracing first
  Pilot paths_;
  Estimate path_variance_;                      // absolute
  Estimate path_mean_;                          // radiance, by the pilot of paths
  Estimate mean_;                               // the same, by all that is known
  Estimate light_between_;                      // squared, of what is not local
  double light_between_mean_ = 0;               // of the picture's mean without it, relative
  std::map<std::string, std::size_t> piloted_;  // [kind] the way that has its pilot
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_FINDINGS_H_
