#ifndef HEDDLE_RENDER_YARN_DRIFT_H_
#define HEDDLE_RENDER_YARN_DRIFT_H_
// Yarns that do not lie evenly: the fabric's plane is shifted a little within itself, so that the
// distances between yarns and their directions change from place to place. Ends move across (x) by
// a sum of plane waves that are short across and long along the warp; picks (y) the same way
// turned. The shift is a function of fabric coordinates without a period, the same for every
// method: it is put into the fabric coordinates of a mesh, whose triangles are first cut until they
// resolve it.
//
// A wave of length l and amplitude a changes distances by 2 pi a / l. All waves have the same share
// of the asked rms; their lengths are spread evenly in their logarithm over two octaves from the
// shortest on. Lengths in millimetres. Tested in tests/render/yarn_drift_test.cpp.

#include <array>
#include <cstdint>
#include <vector>

#include "fibers/math/vector.h"
#include "render/shell.h"

namespace heddle {

struct YarnDriftConfig {
  double spacing_rms = 0;  // of the distance between neighbouring yarns, relative, rms
  double across_mm = 1;    // shortest wave across the yarns that move
  double along_mm = 10;    // along them; not shorter than across_mm
  std::uint64_t seed = 1;
};

class YarnDrift {
 public:
  explicit YarnDrift(const YarnDriftConfig& config);

  /// The shift (mm) of the fabric coordinates at a place of the undisturbed fabric.
  Eigen::Vector2d shift(const Eigen::Vector2d& fabric) const;

 private:
  struct Wave {
    Eigen::Vector2d k;  // radians per mm
    double phase;
    double amplitude;  // mm
  };
  std::array<std::vector<Wave>, 2> waves_;  // of the shift in x and in y
};

/// Cuts edges that are longer than `longest_mm` on the fabric's plane in two, until there are none.
/// Neighbours stay together. Errors: ConfigError where that takes more than kMaxDriftTriangles.
inline constexpr std::size_t kMaxDriftTriangles = 8'000'000;
ClothMesh refined(ClothMesh mesh, double longest_mm);

/// The mesh with the drift in its fabric coordinates. Errors: as refined(); MemoryError.
ClothMesh with_yarn_drift(ClothMesh mesh, const YarnDriftConfig& config);

}  // namespace heddle

#endif  // HEDDLE_RENDER_YARN_DRIFT_H_
