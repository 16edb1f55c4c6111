#ifndef HEDDLE_RENDER_RIVALS_PRT_SCATTERING_H_
#define HEDDLE_RENDER_RIVALS_PRT_SCATTERING_H_
// Single scattering by standard precomputed radiance transfer (Sloan et al. 2002), as Khungurn
// 2017, section 6.2, compares it. Light that reaches a segment directly goes through the same
// low-order harmonics as indirect light does.
//
//   c_light[j]  light in real spherical harmonics of order 5: Y_j(w), or A_l(sharpness) Y_lm(axis)
//   c_T[k]      = sum over j of V_kj c_light[j],  V_kj = integral of V Y_k Y_j: the segment's
//                                                 transfer matrix
//   outgoing    = c_S(theta_o) . D(R) c_T, as for indirect light (multiple_scattering.h)
//
// A product of two harmonics of order 5 has order 10, so the matrix holds nothing of V beyond its
// harmonics of order 10. Stored per segment is V cut to order 10 at the 231 nodes of a product rule
// that is exact for V Y_k Y_j: 0.9 KB instead of 5 KB. Sums over the nodes give the matrix. V comes
// from the signs of the stored signed distances. Order 5 loses highlights and sharp shadows. It
// adds ringing of either sign. 0.1 ms per segment at load. Tested in
// tests/render/rivals/prt_scattering_test.cpp.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fibers/baked/segment_visibility.h"
#include "fibers/scattering/bcsdf_table.h"
#include "render/single_scattering.h"

namespace heddle {

class PrtScattering final : public SingleScatteringModel {
 public:
  static constexpr int kOrder = 5;

  /// `ssdf` is needed here only; `materials` must outlive the object.
  PrtScattering(const SsdfVisibility& ssdf, bool both_sides, std::span<const BcsdfTable> materials);

  /// Everything in fabric space, where the light is projected. Can be negative.
  Rgb directional(const ShadingPoint& point, const DirectionPair& light) const override;
  Rgb spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                         float sharpness) const override;

  /// c_T = V c_light. Both [sh_count(kOrder)].
  Eigen::VectorXf transferred(std::uint32_t segment, const Eigen::VectorXf& light) const;

 private:
  Rgb scattered(const ShadingPoint& point, const Eigen::VectorXf& light) const;

  std::span<const BcsdfTable> materials_;
  Eigen::MatrixXf harmonics_;   // [coefficient, node] Y_j of order kOrder
  Eigen::MatrixXf visibility_;  // [node, segment] V of order 2 kOrder, times the node's weight
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_RIVALS_PRT_SCATTERING_H_
