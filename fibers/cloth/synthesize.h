#ifndef HEDDLE_FIBERS_CLOTH_SYNTHESIZE_H_
#define HEDDLE_FIBERS_CLOTH_SYNTHESIZE_H_
// Weave, yarns, plies, fibers: the exemplar tile of a fabric. Tested in
// tests/fibers/cloth/synthesize_test.cpp.

#include <cstdint>
#include <functional>

#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/fabric_config.h"

namespace heddle {

/// What synthesize() will make of a config, without making it.
struct ExemplarForecast {
  std::uint64_t yarns = 0;
  double segments = 0;
  double bytes = 0;  // of memory, with what writing the fibers takes
};
ExemplarForecast forecast_exemplar(const FabricConfig& config);

/// The same config gives the same bytes. `yarn_done` is called after each yarn. Throws
/// std::invalid_argument as lay_yarns() and where indices of 32 bits do not suffice; MemoryError
/// where the machine cannot hold the fibers.
Exemplar synthesize(
    const FabricConfig& config, const std::function<void()>& yarn_done = [] {});

/// What a user wants to know of an exemplar's geometry.
struct ExemplarSummary {
  std::size_t fibers = 0;
  std::size_t segments = 0;
  double thickness_mm = 0;
  double volume_fraction = 0;  // fiber volume / (tile area x thickness)
  double mean_segment_mm = 0;
  double areal_fiber_length_per_mm2 = 0;  // mm of fiber per mm^2 of cloth
  // rms angle of fiber segments against the yarn's own direction in the plane, without open fibers
  double wander_rms_deg = 0;
};
ExemplarSummary summarize(const Exemplar& exemplar);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_SYNTHESIZE_H_
