#ifndef HEDDLE_RENDER_STAND_IN_FIT_STAND_IN_H_
#define HEDDLE_RENDER_STAND_IN_FIT_STAND_IN_H_
// The stand-in that comes closest to a fabric, and how close that is. Colours of the layers enter
// linearly, so they are least squares within their bounds, for each colour channel. Amounts of
// gloss and sheen, their roughnesses and the strength of normals are searched for. Tested in
// tests/render/stand_in/fit_stand_in_test.cpp.

#include <optional>
#include <vector>

#include "render/stand_in/flat_response.h"
#include "render/stand_in/stand_in.h"

namespace heddle {

/// How far a stand-in is from path tracing of the fibers, over pairs of view and light.
struct StandInError {
  double rmse = 0;  // root of the mean square over pairs and colours, relative to the mean radiance
  double mean = 0;  // of the stand-in over that of the fibers, less 1
};

/// The lights of the pairs that count: above the cloth or below it. The noise of the response does
/// not count: squares are products of the differences to its two halves. Nothing where no such
/// light sends anything.
std::optional<StandInError> stand_in_error(const StandIn& stand_in, const FlatResponse& response,
                                           bool from_below);

/// `maps` of the same fabric as the response.
StandInParameters fit_stand_in(const FlatMaps& maps, const FlatResponse& response);

}  // namespace heddle

#endif  // HEDDLE_RENDER_STAND_IN_FIT_STAND_IN_H_
