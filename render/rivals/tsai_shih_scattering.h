#ifndef HEDDLE_RENDER_RIVALS_TSAI_SHIH_SCATTERING_H_
#define HEDDLE_RENDER_RIVALS_TSAI_SHIH_SCATTERING_H_
// Single scattering by the scheme of Tsai and Shih 2006, as Khungurn 2017, section 6.2, compares
// it. The BCSDF is factored by its singular value decomposition. Visibility is in spherical
// Gaussians, more of them than ours.
//
// Per segment V(w) = sum over q of share_q A_q G(w; xi_q, s) / M(s), with one byte per Gaussian.
// There are 512 axes on the upper hemisphere (1024 on the sphere), and s = 320. share_q is the open
// part of the axis' Voronoi cell, by the signs of the stored signed distances. A_q is the cell's
// solid angle (Khungurn 2017, section 4.1). The transfer function of factor r is V g_r
// cos(theta_i). With the light it integrates to
//   spherical Gaussian: lobe by lobe, as the product of lobe and light is a Gaussian again
//                       (BcsdfFactors::response)
//   directional:        V(w) g_r(w) cos(theta_i)
// Tsai and Shih fit Gaussians to V g_r itself. Lobes that wide would smear a specular g_r, so g_r
// stays exact here, which favours the rival. The sum over r is folded into the cut matrix, so time
// does not depend on R. Everything is in fabric space. Tested in
// tests/render/rivals/tsai_shih_scattering_test.cpp.

#include <cstdint>
#include <span>
#include <vector>

#include "fibers/baked/segment_visibility.h"
#include "fibers/scattering/bcsdf_table.h"
#include "render/rivals/bcsdf_factors.h"
#include "render/single_scattering.h"

namespace heddle {

class TsaiShihScattering final : public SingleScatteringModel {
 public:
  static constexpr int kLobesPerHemisphere = 512;
  /// 3.2 degrees where axes are 6.3 apart: sharper ones ripple (an open sky by 4 % rms here, 14 %
  /// at most; 23 % at 512). Ours: 8.3 degrees.
  static constexpr float kSharpness = 320;

  /// All arguments are needed here only. terms, matrix: see BcsdfFactors.
  TsaiShihScattering(const SsdfVisibility& ssdf, bool both_sides,
                     std::span<const BcsdfTable> materials, int terms,
                     BcsdfFactors::Matrix matrix = BcsdfFactors::Matrix::kWeighted);

  Rgb directional(const ShadingPoint& point, const DirectionPair& light) const override;
  Rgb spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                         float sharpness) const override;

  /// V of a segment in a direction.
  float visibility(std::uint32_t segment, const Vec3& direction) const;

 private:
  std::vector<BcsdfFactors> factors_;  // [material]
  std::vector<Vec3> axes_;             // [lobe]
  std::vector<float> cell_;            // [lobe] A_q / M(s)
  std::vector<std::uint8_t> share_;    // [segment][lobe] 255 where the whole cell is open
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_RIVALS_TSAI_SHIH_SCATTERING_H_
