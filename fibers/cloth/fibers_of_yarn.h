#ifndef HEDDLE_FIBERS_CLOTH_FIBERS_OF_YARN_H_
#define HEDDLE_FIBERS_CLOTH_FIBERS_OF_YARN_H_
// Fibers of one yarn, after the procedural yarn model of Zhao, Luan, Bala 2016: elliptic plies
// twisted about the yarn, fibers twisted about their ply with a radial density, migration, loops
// and hairs. Added are a band-limited random wander of stated rms angle, thick and thin places, and
// neps.
//
// Three spaces follow each other. In its ply, a fiber has a place beside the ply's axis: x away
// from the yarn's axis, y across, both in radii of the yarn. In the yarn's unit disc, the ply has
// turned about the yarn's axis. The disc is scaled to the ellipse of the centre line less one fiber
// radius; what lies beyond its edge (flyaways) keeps its distance from the edge in millimetres. So
// no fiber but these leaves its yarn.
//
// Twists and waves of migration are snapped to whole numbers per tile, which makes every fiber of a
// ply periodic under its own id. Hairs, neps and the added fibers of thick places are open.
// Everything random comes from (seed, yarn, fiber). Tested in
// tests/fibers/cloth/fibers_of_yarn_test.cpp.

#include <cstdint>

#include "fibers/cloth/centre_line.h"
#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/fitting_fibers.h"
#include "fibers/cloth/yarn_config.h"

namespace heddle {

/// Twist in whole turns over one period of the yarn; of `blocks` blocks that fit, if any.
struct SnappedTwist {
  int yarn_turns;
  int ply_turns;
};
SnappedTwist snap_twist(const YarnConfig& yarn, double period_mm, int blocks = 0);

/// Pieces of each fiber over one period of the yarn: as short as the config asks for, and enough to
/// follow its twist.
double segments_per_fiber(const YarnConfig& yarn, double period_mm, double segment_mm,
                          int blocks = 0);

/// Segments that one yarn is expected to have, flyaways and uneven places too. Exact without these.
double segments_of_yarn(const YarnConfig& yarn, double period_mm, double segment_mm,
                        int blocks = 0);

/// Appends the fibers of one yarn to the exemplar (points, radius, material, yarn, is_open). Throws
/// std::invalid_argument where the yarn has no room for the loops that it asks for.
void add_fibers_of_yarn(const YarnConfig& yarn, double fiber_radius_mm, const CentreLine& line,
                        double segment_mm, std::uint64_t seed, std::uint32_t yarn_index,
                        Exemplar& exemplar, const BlocksOfYarn& blocks = {});

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_FIBERS_OF_YARN_H_
