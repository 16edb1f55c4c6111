#ifndef HEDDLE_PRECOMPUTE_SSDF_FIT_H_
#define HEDDLE_PRECOMPUTE_SSDF_FIT_H_
// Visibility maps -> signed distance functions compressed by principal components (Khungurn 2017,
// section 4.1).
//
// Distances are to the edges of cells (fibers/math/signed_distance.h). They are limited to
// +-kLargestDistance before the fit. Neither the sign nor the error function of a light of
// sharpness >= 100 sees more, and the components are left to describe where the edge is (figures in
// docs/performance.md).
//
// Components are computed from a random subset of the segments that see something, with each cell
// weighted by its solid angle. With light from the face only they span the upper half and two rows
// below it, which interpolation at the horizon touches. Farther below, the distance is the mean.
// The seed alone decides the subset, the order of every sum and so the result. Tested in
// tests/precompute/ssdf_fit_test.cpp.

#include "fibers/baked/segment_visibility.h"
#include "precompute/visibility_maps.h"
#include "precompute/visibility_settings.h"

namespace heddle {

inline constexpr float kLargestDistance = 0.5F;  // radians

/// `maps` holds all segments from 0 on.
SsdfVisibility fit_ssdf(const VisibilityMaps& maps, const VisibilitySettings& settings);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_SSDF_FIT_H_
