#ifndef HEDDLE_FIBERS_CLOTH_FIBERS_OF_YARN_H_
#define HEDDLE_FIBERS_CLOTH_FIBERS_OF_YARN_H_
// Fibers of one yarn, after the procedural yarn model of Zhao, Luan, Bala 2016: plies twisted about
// the yarn, fibers twisted about their ply, radial migration. A band-limited random wander of
// stated rms angle is added. The yarn's cross-section is a unit disc. It is scaled to the ellipse
// of the centre line less one fiber radius, so no fiber leaves its yarn. Twists are snapped to
// whole turns per tile, which makes every fiber periodic under its own id. Everything random comes
// from (seed, yarn, fiber). Tested in tests/fibers/cloth/fibers_of_yarn_test.cpp.

#include <cstdint>

#include "fibers/cloth/centre_line.h"
#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/yarn_config.h"

namespace heddle {

/// Twist in whole turns over one period of the yarn.
struct SnappedTwist {
  int yarn_turns;
  int ply_turns;
};
SnappedTwist snap_twist(const YarnConfig& yarn, double period_mm);

/// Pieces of each fiber over one period of the yarn: as short as the config asks for, and enough to
/// follow its twist.
double segments_per_fiber(const YarnConfig& yarn, double period_mm, double segment_mm);

/// Appends the fibers of one yarn to the exemplar (points, radius, material, yarn).
void add_fibers_of_yarn(const YarnConfig& yarn, double fiber_radius_mm, const CentreLine& line,
                        double segment_mm, std::uint64_t seed, std::uint32_t yarn_index,
                        Exemplar& exemplar);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_FIBERS_OF_YARN_H_
