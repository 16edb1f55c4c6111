#ifndef HEDDLE_TESTS_SUPPORT_SMALL_EXEMPLARS_H_
#define HEDDLE_TESTS_SUPPORT_SMALL_EXEMPLARS_H_
// Exemplars small enough to reason about: straight fibers on a tile.

#include <cstdint>

#include "fibers/baked/segment_visibility.h"
#include "fibers/cloth/exemplar.h"
#include "tests/support/fibers.h"

namespace heddle {

/// Cotton of the fabric configs, with a wider R lobe so that few samples suffice.
inline FiberScattering test_cotton() {
  return test::fiber_in_degrees({.5, .4, .3}, {.9, .8, .6}, 8, 27, 38);
}

/// Appends a straight fiber through (x, y, z) along the weft (x) or the warp (y), cut into
/// `segments` pieces.
inline void add_straight_fiber(Exemplar& exemplar, const Vec3& through, bool along_x,
                               float radius_mm, int segments = 4) {
  const Vec3 period = along_x ? Vec3(exemplar.width_mm, 0, 0) : Vec3(0, exemplar.height_mm, 0);
  if (exemplar.first_point.empty()) exemplar.first_point.push_back(0);
  for (int k = 0; k <= segments; ++k) {
    exemplar.points.emplace_back(through +
                                 static_cast<float>(k) / static_cast<float>(segments) * period);
  }
  // The last point is exactly one period away.
  exemplar.points.back() = through + period;
  exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
  exemplar.radius_mm.push_back(radius_mm);
  exemplar.material.push_back(0);
}

/// One fiber along the warp in the middle of a tile of 1 mm x 1 mm, radius 0.05 mm.
inline Exemplar single_fiber(const FiberScattering& scattering) {
  Exemplar exemplar;
  exemplar.width_mm = exemplar.height_mm = 1;
  exemplar.scattering = {scattering};
  add_straight_fiber(exemplar, {0.5F, 0, 0}, false, 0.05F);
  index_segments(exemplar);
  return exemplar;
}

/// Layers of straight fibers, alternately along weft and warp, staggered, 0.2 mm x 0.25 mm: about
/// half full, open to light, no fiber touching another.
inline Exemplar crossed_layers(const FiberScattering& scattering) {
  Exemplar exemplar;
  exemplar.width_mm = 0.2F;
  exemplar.height_mm = 0.25F;
  exemplar.scattering = {scattering};
  constexpr int kPerLayer = 4;
  for (int layer = 0; layer < 6; ++layer) {
    const bool along_x = layer % 2 == 0;
    for (int k = 0; k < kPerLayer; ++k) {
      const float offset = (static_cast<float>(k) + 0.3F * static_cast<float>(layer)) / kPerLayer;
      const float z = (static_cast<float>(layer) - 2.5F) * 0.04F;
      add_straight_fiber(exemplar,
                         along_x ? Vec3(0, offset * exemplar.height_mm, z)
                                 : Vec3(offset * exemplar.width_mm, 0, z),
                         along_x, 0.0175F);
    }
  }
  index_segments(exemplar);
  return exemplar;
}

/// Signed distances of segments that nothing hides: every direction is open.
inline SsdfVisibility open_distances(std::size_t segments) {
  SsdfVisibility ssdf;
  ssdf.components = 1;
  const auto texels = static_cast<std::size_t>(ssdf.resolution * ssdf.resolution);
  ssdf.mean.assign(texels, kPif);
  ssdf.basis.assign(texels, 0.0F);
  ssdf.coefficients.resize(segments);
  ssdf.sees_nothing.assign(segments, 0);
  return ssdf;
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_SUPPORT_SMALL_EXEMPLARS_H_
