#ifndef HEDDLE_RENDER_FLIP_H_
#define HEDDLE_RENDER_FLIP_H_
// How different two pictures look when one is swapped for the other at its place on a screen. 0 is
// no visible difference, 1 the largest. Andersson et al. 2020, "FLIP: A Difference Evaluator for
// Alternating Images", low-dynamic-range form. Per pixel it is the colour difference raised to 1 -
// (difference of edges and points). The colour difference is filtered by the eye's contrast
// sensitivity and is the HyAB distance in Hunt-adjusted L*a*b*. Input is scene-linear Rec.709; like
// the screen, it is clipped to [0, 1]. The sums of Gaussians that filter the three channels are as
// printed (table 1). Beyond the rim, pixels repeat. Symmetric in its two pictures. Tested in
// tests/render/flip_test.cpp.

#include <span>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

/// A 0.7 m wide screen of 3840 pixels seen from 0.7 m, as in the paper: 67.02.
double default_pixels_per_degree();

/// [pixel], row by row, in [0, 1].
std::vector<float> flip_map(std::span<const Rgb> a, std::span<const Rgb> b, int width, int height,
                            double pixels_per_degree = default_pixels_per_degree());

/// Mean of flip_map.
double flip_error(std::span<const Rgb> a, std::span<const Rgb> b, int width, int height,
                  double pixels_per_degree = default_pixels_per_degree());

}  // namespace heddle

#endif  // HEDDLE_RENDER_FLIP_H_
