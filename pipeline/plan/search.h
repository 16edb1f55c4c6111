#ifndef HEDDLE_PIPELINE_PLAN_SEARCH_H_
#define HEDDLE_PIPELINE_PLAN_SEARCH_H_
// From priors to a choice: as long as it pays, finds out more of the way that looks cheapest, or of
// one that may be much cheaper, by pilots. Errors: those of pilots. Tested in
// tests/pipeline/end_to_end_test.cpp.

#include <optional>

#include "pipeline/plan/findings.h"

namespace heddle {

/// What is asked of a plan's pictures.
struct Target {
  double tolerance = 0;    // relative RMSE of the picture against path tracing, its noise included
  int pictures = 1;        // that share the data: frames of a shot
  bool may_build = false;  // data of a way, to try it
};

class Search {
 public:
  /// All outlive the object. `findings` hold path tracing alone.
  Search(const Target& target, PilotRenderer& renderer, const ViewFacts& view,
         FabricLibrary& library, Findings& findings)
      : target_(target),
        renderer_(&renderer),
        view_(&view),
        library_(&library),
        findings_(&findings) {}

  /// Every other way, with its prior; the fabrics' tables have been read.
  void add_other_ways();
  /// The way chosen, of findings.ways(); nothing where none meets the tolerance.
  std::optional<std::size_t> choose_way();

 private:
  std::optional<std::size_t> cheapest_way() const;
  Offer offer_of(std::size_t way) const;
  bool try_choice(std::size_t chosen);
  bool try_cheaper(std::size_t chosen);
  void try_out(std::size_t way);
  void measure_stress();

  bool may_try(std::size_t way) const;
  int samples_to_try(std::size_t way) const;
  double seconds_to_try(std::size_t way) const;
  double pilot_error(double samples) const;
  bool more_paths(double wanted, double affordable, double known);

  Target target_;
  PilotRenderer* renderer_;
  const ViewFacts* view_;
  FabricLibrary* library_;
  Findings* findings_;
  bool stress_measured_ = false;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_SEARCH_H_
