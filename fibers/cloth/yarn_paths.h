#ifndef HEDDLE_FIBERS_CLOTH_YARN_PATHS_H_
#define HEDDLE_FIBERS_CLOTH_YARN_PATHS_H_
// How the yarns of a woven tile lie. In the plane each yarn runs straight. In height it is a string
// pulled tight over and under the sections of the yarns that it crosses: it wraps around them and
// runs straight between, as in Peirce's geometry of cloth (1937). Between the two yarns of each
// crossing lies a level plane that neither passes. The planes lie where the yarns press on each
// other with equal force, which is the balance of crimp: a float lies straight and pushes the yarns
// that it passes away from it, and so on through the whole weave.
//
// A yarn's section is an ellipse in the vertical plane across it, and stays upright: slopes shear
// it. Where yarns press on each other they may be flattened; they grow as much wider. They may also
// spread into the room beside them: up to their neighbour, or up to the yarn that passes between.
// Tested in tests/fibers/cloth/yarn_paths_test.cpp.

#include <memory>
#include <vector>

#include "fibers/cloth/centre_line.h"
#include "fibers/cloth/fabric_config.h"

namespace heddle {

/// Where the yarns of one system lie: in order, side by side, each with its own spacing.
struct YarnPlaces {
  std::vector<double> centre_mm;   // [yarn of the tile]
  std::vector<double> spacing_mm;  // [yarn of the tile] room that it has
  double period_mm = 0;            // of the tile
};
YarnPlaces warp_places(const FabricConfig& config);
YarnPlaces weft_places(const FabricConfig& config);

/// Heights and sections of one yarn over one repeat of weave and sequences; all of it is periodic.
struct YarnShape {
  double step_mm = 0;                  // between samples
  std::vector<double> height_mm;       // [sample] over the middle plane, from 0 along the yarn on
  std::vector<double> shift_mm;        // [sample] of the section's middle, across the yarn
  std::vector<double> half_width_mm;   // [sample]
  std::vector<double> half_height_mm;  // [sample]

  /// At a distance along the yarn; a smooth curve through the samples.
  double height_at(double along_mm) const;
  double shift_at(double along_mm) const;
  double half_width_at(double along_mm) const;
  double half_height_at(double along_mm) const;
  /// By how much the yarn is longer than its repeat, relative: what the trade calls crimp.
  double crimp() const;
};

struct YarnPath {
  bool is_warp = false;                    // runs along y; otherwise along x
  double across_mm = 0;                    // x of a warp yarn, y of a weft yarn
  double length_mm = 0;                    // of the tile along it
  std::shared_ptr<const YarnShape> shape;  // the same for all copies of the repeat
};

struct YarnPaths {
  double width_mm = 0;
  double height_mm = 0;
  std::vector<YarnPath> warp;  // [end]
  std::vector<YarnPath> weft;  // [pick]
};

/// Yarns are laid no steeper than this; where that does not do, the cloth is jammed.
inline constexpr double kSteepestSlope = 2.75;  // 70 degrees

/// Throws std::invalid_argument where yarns jam, with the spacing and the thickness that would do,
/// and where a repeat is too large to lay (kMostCrossings).
YarnPaths lay_yarns(const FabricConfig& config);

/// Crossings of one repeat of weave and sequences that can be laid.
inline constexpr double kMostCrossings = 1 << 18;

/// The path as a centre line.
CentreLine centre_line(const YarnPath& path);

/// Smallest vertical gap (mm, negative = overlap) between the surfaces of any warp and weft yarn,
/// on `samples` x `samples` points of each crossing of the first repeat. `paths`: laid for this
/// config.
double smallest_clearance(const FabricConfig& config, const YarnPaths& paths, int samples);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_YARN_PATHS_H_
