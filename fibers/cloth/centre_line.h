#ifndef HEDDLE_FIBERS_CLOTH_CENTRE_LINE_H_
#define HEDDLE_FIBERS_CLOTH_CENTRE_LINE_H_
// The axis of one yarn over one period of its tile, with the ellipse that its cross-section fills.
// Woven yarns, knitted yarns and curves from files all become fibers through it.

#include <functional>

#include "fibers/math/vector.h"

namespace heddle {

/// A cross-section of a yarn: a point across it is position + x side + y up. `side` and `up` are
/// unit vectors, and side x up points along the yarn or at most obliquely to it.
struct YarnPlace {
  Vec3d position;  // mm
  Vec3d side;      // in the plane of the cloth, as far as the yarn allows
  Vec3d up;
  double half_width_mm;   // along `side`
  double half_height_mm;  // along `up`
};

struct CentreLine {
  std::function<YarnPlace(double share)> at;  // share of the period, 0 .. 1
  double length_mm = 0;                       // along the yarn
  bool is_open = false;                       // the yarn ends within the tile, at shares 0 and 1
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_CENTRE_LINE_H_
