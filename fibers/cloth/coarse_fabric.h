#ifndef HEDDLE_FIBERS_CLOTH_COARSE_FABRIC_H_
#define HEDDLE_FIBERS_CLOTH_COARSE_FABRIC_H_
// The tiny form of a fabric: fewer, thicker fibers. For tests and first looks, not for pictures:
// light goes further between fibers. Tested in tests/fibers/cloth/coarse_fabric_test.cpp.

#include "fibers/cloth/fabric_config.h"

namespace heddle {

/// Each fiber stands for `count` (>= 2): so many times fewer in each ply, hair, loop, nep and pile,
/// whose radius grows by its square root. So yarns keep the area that their fibers fill. Segments
/// grow by the square root of count, too. A fiber stands for fewer where a ply would keep less than
/// three, or where it would be thicker than a quarter of its yarn's height.
void make_coarse(FabricConfig& config, int count);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_COARSE_FABRIC_H_
