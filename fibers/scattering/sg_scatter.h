#ifndef HEDDLE_FIBERS_SCATTERING_SG_SCATTER_H_
#define HEDDLE_FIBERS_SCATTERING_SG_SCATTER_H_
// Gamma: what a fiber scatters to wo from a spherical Gaussian of light,
//   Gamma = integral of G(wi; axis, sharpness) S(wi, wo) cos(theta_i) over wi,   G not normalised.
//
// All methods integrate over azimuth exactly. What remains per lobe is an integral over theta =
// theta_i (Khungurn 2017, appendix A), with theta' that of the axis and B slow beside exp(E):
//   Gamma_X = integral of B_X(theta) exp(E(theta))
//   E = -(theta + theta_o)^2 / (2 beta^2) - 2 sharpness sin^2((theta - theta') / 2)
// Fiber frame as in fiber_bcsdf.h.
//
// Mean |error| at sharpness 25, 100, 400, light within the lobe R with beta = 10 degrees:
//   |theta_o| = 60 degrees        kPrinted 4.5, 1.9, .6 %    kDefault .4, .03, .001 %
//   |theta_o| = 75 to 85 degrees  kPrinted 13, 15, 13 %      kDefault 1.4, .7, .2 %
// Plain Gauss-Hermite nodes, not cut at the ends, have 8, 4, 2 % in the second row. Recentring by a
// Newton step changes nothing. Tested in tests/fibers/scattering/sg_scatter_test.cpp, which prints
// the table.

#include "fibers/math/quadrature.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/fiber_bcsdf.h"

namespace heddle {

enum class SgMethod {
  kPrinted,     // the paper's, typos corrected: E to second order, B at one theta
  kDefault,     // three Gauss nodes with E exact: what the renderer uses (BcsdfTable::sg_scatter)
  kQuadrature,  // converged, for sharpness from 0 to 1e8 and beyond
};

Rgbd sg_scatter(const FiberScattering& fiber, const SphericalGaussian& light, const Vec3d& wo,
                SgMethod method, Lobe lobe = Lobe::kAll);

/// kDefault puts its nodes where the Gaussian exp(-precision (theta - centre)^2) puts them, cut at
/// the nearer end of
/// [-pi/2, pi/2]. Below kBroadPrecision both ends matter and it uses kBroadNodes Gauss-Legendre
/// nodes instead.
inline constexpr double kBroadPrecision = 4.0;
inline constexpr int kBroadNodes = 8;

/// Rules for that Gaussian, by the distance of its centre from the nearer end times sqrt(precision)
/// (>= 0). Interpolated between tabulated rules, error of the weights' sum below 1e-5; from
/// kCutReach on the cut does not show.
inline constexpr double kCutReach = 4.0;
inline constexpr int kCutRules = 257;
const ThreeNodeRule* cut_rules();  // [kCutRules] for cuts equally spaced in [0, kCutReach]
ThreeNodeRule cut_rule(double cut);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_SCATTERING_SG_SCATTER_H_
