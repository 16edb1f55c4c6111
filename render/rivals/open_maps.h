#ifndef HEDDLE_RENDER_RIVALS_OPEN_MAPS_H_
#define HEDDLE_RENDER_RIVALS_OPEN_MAPS_H_
// Which directions are open from each segment, by the signs of the stored signed distances, on the
// cells of their lat-long map. The rivals make their own representations of visibility from it, so
// that they differ from ours in nothing else. With light from the face only, directions below the
// horizon count as closed. 26 us per segment at 128 x 128 cells: two matrix products. Tested in
// tests/render/rivals/open_maps_test.cpp.

#include <Eigen/Core>
#include <vector>

#include "fibers/baked/segment_visibility.h"

namespace heddle {

class OpenMaps {
 public:
  /// `ssdf` must outlive this object.
  OpenMaps(const SsdfVisibility& ssdf, bool both_sides);

  std::uint32_t segment_count() const {
    return static_cast<std::uint32_t>(ssdf_->sees_nothing.size());
  }
  /// The cells of the sphere, or of the upper hemisphere.
  const std::vector<Vec3d>& directions() const { return directions_; }
  const std::vector<double>& solid_angles() const { return solid_angles_; }  // steradians

  /// [cell, segment - first] 1 where open, 0 where closed, for segments first .. last - 1.
  Eigen::MatrixXf open(std::uint32_t first, std::uint32_t last) const;

  /// Segments to ask for at a time: a matrix of 4 MB (8 MB for the whole sphere).
  static constexpr std::uint32_t kBatch = 128;

 private:
  const SsdfVisibility* ssdf_;
  std::vector<Vec3d> directions_;
  std::vector<double> solid_angles_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_RIVALS_OPEN_MAPS_H_
