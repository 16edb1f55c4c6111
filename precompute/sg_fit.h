#ifndef HEDDLE_PRECOMPUTE_SG_FIT_H_
#define HEDDLE_PRECOMPUTE_SG_FIT_H_
// Visibility maps -> sums of spherical Gaussians (Khungurn 2017, section 4.1). The fit itself is in
// fibers/math/sg_sum_fit.h.
//
// The set of axes is turned about +z by a random angle per segment. That masks errors which all
// segments would have in common. The angle is a whole number of columns of the map (2.8 degrees),
// so that all segments share one table of the fit. Tested in tests/precompute/sg_fit_test.cpp.

#include "fibers/baked/segment_visibility.h"
#include "precompute/visibility_maps.h"
#include "precompute/visibility_settings.h"

namespace heddle {

/// `maps` holds all segments from 0 on.
SgVisibility fit_sgs(const VisibilityMaps& maps, const VisibilitySettings& settings);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_SG_FIT_H_
