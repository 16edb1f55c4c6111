#ifndef HEDDLE_RENDER_SINGLE_SCATTERING_H_
#define HEDDLE_RENDER_SINGLE_SCATTERING_H_
// Light that scatters once, at the fiber the eye sees: BCSDF times precomputed visibility, for one
// light at a time (Khungurn 2017, section 5.2). Results are radiance for a light of irradiance 1,
// before macroscopic shadows.
//
// A directional light along w gives V(w) S(w, wo) cos(theta_w), with V = 1 where the signed
// distance to the edge of visibility is > 0. A spherical Gaussian (axis xi, sharpness l, mass M(l))
// is blended linearly in l over [10, 20] (VisibilityBlend) between
//   soft:   1 / M(l) sum over lobes q of w_q / M(s) exp(n_q - s - l) Gamma(v_q / n_q, n_q, wo),
//           v_q = s xi_q + l xi, n_q = |v_q|, s the lobes' sharpness;
//   sharp:  1 / M(l) sum over the fiber's lobes X = R, TT of Gamma_X(xi, l, wo) U_X,
//           U_X = E[(1 + erf(sqrt(p / 2) d)) / 2]
// U_X is the visible share of a Gaussian about the mean of light times lobe. p is the precision of
// that product in inclination, and d the signed distance. The mean E is over the product's
// azimuths.
//
// The paper looks d up at xi, with l for p (SgMethod::kPrinted), whatever part of that light the
// fiber uses. But a fiber's lobe is much narrower in inclination than a soft light. Errors of both:
// docs/performance.md.
//
// There are two spaces, because draped cloth is a bent copy of the flat exemplar. BCSDF and Gamma
// take world-space unit vectors, with angles as they are in the picture. Signed distances are
// looked up in fabric space, where they were baked. The lobes of the soft branch live in fabric
// space too. A product of lobe and light only makes sense in one space, so all of that branch,
// Gamma included, is evaluated in fabric space. Gamma is BcsdfTable::sg_scatter, or the printed
// form (sg_scatter.h); their errors are stated there. Tested in
// tests/render/single_scattering_test.cpp.

#include <compare>
#include <span>

#include "fibers/baked/segment_visibility.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/scattering/sg_scatter.h"

namespace heddle {

/// One direction as seen in the two spaces; both unit vectors.
struct DirectionPair {
  Vec3 world;
  Vec3 fabric;
};

/// What the eye sees at one sample.
struct ShadingPoint {
  std::uint32_t segment;
  std::uint32_t cell;  // of the segment, in the transfer's grid
  std::uint16_t material;
  DirectionPair tangent;
  DirectionPair wo;
};

/// Which form of visibility serves a spherical Gaussian; a directional light always takes the
/// signed distance.
struct VisibilityBlend {
  float from = 10;  // sharpness above which the signed distance takes part
  float to = 20;    // sharpness from which the lobes no longer do; > from

  auto operator<=>(const VisibilityBlend&) const = default;
  bool uses_distance(float sharpness) const { return sharpness > from; }
  bool uses_lobes(float sharpness) const { return sharpness < to; }
};
// for SgMethod::kPrinted, whose signed distances fail earlier
inline constexpr VisibilityBlend kPrintedBlend{100, 200};
inline constexpr VisibilityBlend kSignedDistanceOnly{-2, -1};
inline constexpr VisibilityBlend kLobesOnly{1e30F, 2e30F};

/// Radiance by single scattering from one light of irradiance 1: what SingleScattering and its
/// rivals (render/rivals/) offer to the renderer.
class SingleScatteringModel {
 public:
  virtual ~SingleScatteringModel() = default;
  virtual Rgb directional(const ShadingPoint& point, const DirectionPair& light) const = 0;
  /// sharpness 0: constant light from everywhere.
  virtual Rgb spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                                 float sharpness) const = 0;
};

class SingleScattering final : public SingleScatteringModel {
 public:
  /// Either representation may be absent (nullptr) where no light needs it. What is passed must
  /// outlive this object. gamma: SgMethod::kDefault, or kPrinted for the paper's own.
  SingleScattering(const SsdfVisibility* ssdf, const SgVisibility* lobes,
                   std::span<const BcsdfTable> materials, const VisibilityBlend& blend = {},
                   SgMethod gamma = SgMethod::kDefault)
      : ssdf_(ssdf), lobes_(lobes), materials_(materials), blend_(blend), gamma_(gamma) {}

  Rgb directional(const ShadingPoint& point, const DirectionPair& light) const override;
  Rgb spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                         float sharpness) const override;

 private:
  Rgb scattered(const BcsdfTable& bcsdf, const Vec3& axis, float sharpness, const Vec3& wo) const;
  Rgb soft(const ShadingPoint& point, const DirectionPair& axis, float sharpness) const;
  Rgb sharp(const ShadingPoint& point, const DirectionPair& axis, float sharpness) const;
  /// Share of a lobe's light that comes through. to_fabric: from the fiber's frame; axis_theta,
  /// axis_phi: the light's axis there.
  float visible_share(std::uint32_t segment, const Mat3& to_fabric, float axis_theta,
                      float axis_phi, const BcsdfTable::LobeResponse& lobe) const;
  const SsdfVisibility* ssdf_;
  const SgVisibility* lobes_;
  std::span<const BcsdfTable> materials_;
  VisibilityBlend blend_;
  SgMethod gamma_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SINGLE_SCATTERING_H_
