#ifndef HEDDLE_FIBERS_CLOTH_YARN_PATHS_H_
#define HEDDLE_FIBERS_CLOTH_YARN_PATHS_H_
// Crimped centre lines of the yarns of one tile. In the plane each yarn runs straight. It rises
// over and dives under the yarns that it crosses, with crests at the crossings, cosine flanks
// between them and flat floats. A yarn's cross-section in the vertical plane is an ellipse (width x
// height). The crest heights are the smallest for which no two yarns overlap anywhere. They follow
// from the clearance of every kind of crossing on a grid. Warp and weft share them by `crimp_warp`.
// Tested in tests/fibers/cloth/yarn_paths_test.cpp.

#include <vector>

#include "fibers/cloth/centre_line.h"
#include "fibers/cloth/fabric_config.h"

namespace heddle {

/// One yarn: position across its own direction, and its height over the middle plane at each
/// crossing.
struct YarnPath {
  bool is_warp = false;            // runs along y; otherwise along x
  double across_mm = 0;            // x of a warp yarn, y of a weft yarn
  double crossing_spacing_mm = 0;  // crossing k lies at (k + 0.5) * spacing along the yarn
  int crossings = 0;               // of the tile
  std::vector<double> crest_mm;    // [crossing of the weave's repeat] height there; periodic

  double length_mm() const { return crossing_spacing_mm * crossings; }
  /// Height over the middle plane at a distance along the yarn (periodic).
  double height_at(double along_mm) const;
};

/// The path as a centre line with a section of this size. It stays upright: slopes shear it.
CentreLine centre_line(const YarnPath& path, double width_mm, double height_mm);

struct YarnPaths {
  double width_mm = 0;
  double height_mm = 0;
  std::vector<YarnPath> warp;  // [end]
  std::vector<YarnPath> weft;  // [pick]
};

/// Throws std::invalid_argument where the yarns are too wide to interlace (no crest height clears
/// them).
YarnPaths lay_yarns(const FabricConfig& config);

/// Smallest vertical gap (mm, negative = overlap) between the surfaces of any warp and weft yarn,
/// on `samples` x `samples` points per kind of crossing. `paths`: laid for this config.
double smallest_clearance(const FabricConfig& config, const YarnPaths& paths, int samples);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_YARN_PATHS_H_
