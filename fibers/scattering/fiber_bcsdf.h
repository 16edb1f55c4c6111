#ifndef HEDDLE_FIBERS_SCATTERING_FIBER_BCSDF_H_
#define HEDDLE_FIBERS_SCATTERING_FIBER_BCSDF_H_
// The fiber scattering model of Khungurn et al. 2015 in double precision. It has a reflection lobe
// R, uniform in azimuth, and a transmission lobe TT, von Mises in azimuth. This is the definition;
// BcsdfTable is its fast form.
//
// Fiber frame: x = tangent, theta = asin(x) in [-pi/2, pi/2], phi = atan2(z, y). wi points to the
// light, wo to the viewer. R peaks at theta_o = -theta_i, TT also at phi_o - phi_i = pi. Values are
// 1/sr without the cosine. Source: Khungurn 2015, and Khungurn 2017, appendix A, with '+' in
// Schlick's term where the print has '-':
//   S_R  = F M(beta_r) / (2 pi)
//   S_TT = (1 - F) C_TT M(beta_tt) V(phi_o - phi_i)
//   F    = C_R + (1 - C_R) (1 - cos theta_i)^5
//   M    = exp(-(theta_o + theta_i)^2 / (2 beta^2)) / (sqrt(2 pi) beta Gn(theta_i; beta))
//   V(d) = exp(-2 k cos^2(d / 2)) / (2 pi I0(k) exp(-k)),   k = gamma_tt^-2
// The integral of S cos(theta_o) over wo is F + (1 - F) C_TT exactly. S is not reciprocal, since F
// and Gn see theta_i only. It is finite for beta and gamma from 0.1 to 60 degrees and all
// directions. Tested in tests/fibers/scattering/fiber_bcsdf_test.cpp.

#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

struct FiberScattering {
  Rgbd color_r = Rgbd::Zero();   // C_R, reflectance at normal incidence, in [0, 1]
  Rgbd color_tt = Rgbd::Zero();  // C_TT, transmittance, in [0, 1]
  double beta_r = 0.0;           // longitudinal deviation of R, radians
  double beta_tt = 0.0;          // longitudinal deviation of TT, radians
  double gamma_tt = 0.0;         // azimuthal width of TT, radians
  // S = 1 / pi^2 for all directions, and the rest is unused: the fiber of the furnace test
  bool isotropic_white = false;
};

struct FiberDirection {
  double theta;  // radians, [-pi/2, pi/2]
  double phi;    // radians
};

FiberDirection fiber_direction(const Vec3d& direction);
Vec3d vector_from(const FiberDirection& direction);

/// Which part of S. The isotropic white fiber counts as R.
enum class Lobe { kAll, kR, kTt };

Rgbd evaluate_bcsdf(const FiberScattering& fiber, const Vec3d& wi, const Vec3d& wo,
                    Lobe lobe = Lobe::kAll);

/// Integral of S cos(theta_o) over wo, by quadrature.
Rgbd bcsdf_albedo(const FiberScattering& fiber, double theta_i);

/// [(order + 1)^2] integrals of Y_j(wi) S(wi, wo) cos(theta_i) over wi (C_S of Khungurn 2017,
/// section 5.3). Frame: x = tangent, wo in the xy plane, y >= 0. Coefficients with l + m odd are 0.
/// order <= 10; error below 1e-10.
std::vector<Rgbd> bcsdf_sh(const FiberScattering& fiber, double theta_o, int order,
                           Lobe lobe = Lobe::kAll);

/// Any integral of S over wi is linear in three sums that hold no colour: of R's density, of R's
/// density times s = (1 - cos theta_i)^5, and of TT's density times 1 - s. The isotropic white
/// fiber uses `r` alone.
struct LobeSums {
  double r = 0.0;
  double r_schlick = 0.0;
  double tt = 0.0;
};
Rgbd colored(const FiberScattering& fiber, const LobeSums& sums);

/// s = (1 - cos theta)^5.
double schlick_weight(double cos_theta);

/// cos^2(theta_i) / (sqrt(2 pi) beta Gn(theta_i; beta)), at most about 1 / (sqrt(2 pi) beta). It is
/// the factor of the Gaussian of theta_i + theta_o when S is integrated over d theta_i d phi_i.
double longitudinal_weight(double theta_i, double beta);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_SCATTERING_FIBER_BCSDF_H_
