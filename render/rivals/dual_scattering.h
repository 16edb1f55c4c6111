#ifndef HEDDLE_RENDER_RIVALS_DUAL_SCATTERING_H_
#define HEDDLE_RENDER_RIVALS_DUAL_SCATTERING_H_
// Dual scattering (Zinke, Yuksel, Weber and Keyser 2008) on explicit fibers, density factors 1 as
// in Khungurn 2017. Light of irradiance 1 along w_d (inclination theta_d) leaves a fiber towards wo
// as
//   cos(theta_d) (S + f_back)            if no fiber lies between it and the light
//   cos(theta_d) T_f (S^G + f_back^G)    behind n >= 1 fibers
//
//   T_f       = product of a_f(theta_d^k) over the fibers k that the light passes, each with the
//               scattering of its own
//   sigma_f^2 = sum of beta_f^2(theta_d^k) over the same fibers
//   S^G       : S under light spread by sigma_f^2 in inclination, evenly over the front half in
//               azimuth: its M has variance beta^2 + sigma_f^2, its N is averaged over that half
//   f_back    = 2 A_b g(theta_o + theta_d, sigma_b^2) / (pi cos^2 theta), behind the fiber
//               (|phi_o - phi_d| < pi / 2), theta = (theta_o - theta_d) / 2
//   f_back^G  : the same with sigma_b^2 + sigma_f^2, averaged over the front half of incoming
//               azimuths
//   A_b       = a_b a_f^2 / (1 - a_f^2) + a_b^3 a_f^2 / (1 - a_f^2)^3
//   sigma_b   = (1 + a_f^2)
//               * (a_b sqrt(2 beta_f^2 + beta_b^2) + a_b^3 sqrt(2 beta_f^2 + 3 beta_b^2))
//               / (a_b + a_b^3 (2 beta_f + 3 beta_b))
//
// a_f and a_b are the shares of light that a fiber sends into its front half (azimuth more than
// pi/2 from the light's) and its back half, averaged over incoming azimuths. In closed form, with P
// the share of TT's azimuth within pi/2 of straight on:
//   a_f = F / 2 + (1 - F) C_TT P,   a_b = F / 2 + (1 - F) C_TT (1 - P)
// beta_f^2 and beta_b^2 are the lobes' variances, weighed by those shares. R and TT are not
// shifted, so the means of their shifts (Delta_b) are 0. Everything is per colour.
//
// Difference: the pseudo-code of the paper multiplies f_back^G by a further pi. f_back^G is already
// an average over incoming directions, so we leave it out. docs/rivals.md says how much that
// changes. A ray ignores the fiber that it starts at, so no fiber counts itself. Tested in
// tests/render/rivals/dual_scattering_test.cpp.

#include <array>
#include <span>
#include <vector>

#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/tile_scene.h"
#include "render/single_scattering.h"

namespace heddle {

class DualScattering {
 public:
  /// Both must outlive this object.
  DualScattering(const TileScene& tile, std::span<const BcsdfTable> materials);

  /// `single` is exact single scattering, by the fibers that are there; `multiple` all the rest.
  struct Parts {
    Rgb single = Rgb::Zero();
    Rgb multiple = Rgb::Zero();
  };
  /// position: of the hit, fabric space, in the base tile.
  Parts directional(const ShadingPoint& point, const Vec3& position,
                    const DirectionPair& light) const;

  /// What light loses and gains in width on its way to a point of `segment` from `direction`
  /// (fabric space).
  struct Passage {
    int fibers = 0;
    Rgb transmittance = Rgb::Ones();  // T_f
    Rgb variance = Rgb::Zero();       // sigma_f^2, radians^2
  };
  Passage passage(const Vec3& position, std::uint32_t segment, const Vec3& direction) const;

  /// Averages over the two halves, for light at inclination theta.
  struct Averages {
    Rgb forward;            // a_f
    Rgb backward;           // a_b
    Rgb forward_variance;   // beta_f^2
    Rgb backward_variance;  // beta_b^2
  };
  Averages averages(std::uint16_t material, float theta) const;

  /// A_b and sigma_b of those averages. Where a_f is 1 in exact arithmetic nothing comes back: A_b
  /// = 0.
  struct Backscattering {
    Rgb attenuation;
    Rgb deviation;  // radians
  };
  static Backscattering backscattering(const Averages& averages);

  /// S^G(theta_d, wo) for a spread of variance sigma_f^2; delta_phi = phi_o - phi_d.
  Rgb spread_scattering(std::uint16_t material, float theta_d, float theta_o, float delta_phi,
                        const Rgb& variance) const;

 private:
  static constexpr int kAzimuthSteps = 180;  // of mean_azimuth over [0, pi]
  struct Material {
    Rgb color_r;
    Rgb color_tt;
    float beta_r;
    float beta_tt;
    float straight_on;  // P
    // [|delta_phi|] TT's azimuthal part averaged over the front half
    std::array<float, kAzimuthSteps + 1> mean_azimuth;
    Rgb fresnel(float theta) const;
  };
  /// M(theta_i, theta_o) for a deviation of sqrt(variance), at most 90 degrees.
  float longitudinal(float theta_i, float theta_o, float variance) const;

  const TileScene* tile_;
  std::span<const BcsdfTable> tables_;
  std::vector<Material> materials_;
  // Gn by |theta| and log deviation, both equally spaced.
  static constexpr int kThetaSteps = 180;
  static constexpr int kDeviationSteps = 96;
  std::vector<float> cos2_mean_;  // [theta][deviation]
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_RIVALS_DUAL_SCATTERING_H_
