#ifndef HEDDLE_FIBERS_CLOTH_FITTING_FIBERS_H_
#define HEDDLE_FIBERS_CLOTH_FITTING_FIBERS_H_
// Fibers of a woven yarn whose blocks fit each other: any block of the tile may lie beside any
// other, and no fiber jumps. A fiber need not meet itself beyond a border. It is enough that the
// fibers of the yarn pass every border at the same places with the same directions, as a set. Each
// of those places is a slot.
//
// - Twist: the fibers of a ply lie in rings of equal distances. Between two borders a ring of
//   `order` fibers turns by a multiple of 1 / order. So slots are taken by other fibers of the
//   ring.
// - Plies likewise: they have equal patterns, and the yarn's twist is a multiple of 1 / plies per
//   block.
// - Migration: at a border its phase follows the fiber's angle, so that it belongs to the slot.
//   In a block's middle it is ahead or behind, by up to half a wave.
// - Wander: near a border it is a function of the slot, within a block one of its own. Both are
//   blended with weights whose squares add up to 1, so its strength is the same everywhere.
//
// The two segments that meet a border are the same in all blocks, and all variation lies between
// them. Over the whole tile a fiber turns by whole turns, and is periodic under its own id. Tested
// in tests/fibers/cloth/fitting_fibers_test.cpp.

#include <array>
#include <cstdint>
#include <vector>

#include "fibers/cloth/yarn_config.h"
#include "fibers/math/vector.h"

namespace heddle {

/// Wavelengths of the fibers' wander, in fiber radii, in yarns that must fit and in all others:
/// long against the fiber's thickness, and short enough that even 10 degrees stay within the yarn.
inline constexpr double kShortestWander = 25;
inline constexpr double kLongestWander = 80;

/// The blocks of a tile along one of its yarns.
struct BlocksOfYarn {
  int count = 0;  // 0: they need not fit
  // Index of the yarn that lies at the same place of the tile's first blocks. Yarns with the same
  // one are equal at borders.
  std::uint32_t pattern_yarn = 0;
};

/// The twist that is nearest to `turns`, in whole turns per tile, and in a multiple of 1 / plies
/// per block.
int fitting_yarn_turns(double turns, int plies, int blocks);

/// Most fibers of a ring. More would crowd about the ply's axis.
inline constexpr int kMostFibersOfRing = 12;

/// Segments of a fiber within a block: at least so many.
inline constexpr int kFewestSegmentsOfBlock = 6;

/// Wander: for each axis a sum of sines.
struct FittingWander {
  static constexpr int kModes = 4;
  struct Mode {
    double waves;      // per block
    double amplitude;  // mm
    double phase;
  };
  std::array<Mode, kModes> side, up;
};

/// A fiber of a ply, over the whole tile.
struct FittingFiber {
  Eigen::Vector2d place;                 // at share 0, in a unit disc in which fibers lie evenly
  double migration_phase = 0;            // there, radians
  int order = 1;                         // fibers of its ring
  std::vector<FittingWander> at_border;  // [border, 0 .. blocks]
  std::vector<FittingWander> within;     // [block]
  std::vector<double> phase_within;      // [block] by which migration is ahead in its middle
};

class FittingFibers {
 public:
  struct Setup {
    double fiber_radius_mm;
    double length_mm;        // of the tile along the yarn
    int segments;            // of a fiber, a multiple of the blocks
    int yarn_turns;          // per tile: of fitting_yarn_turns()
    int ply_turns;           // per tile
    double migration_waves;  // per tile, asked for
    std::uint64_t seed;
    std::uint32_t yarn_index;
  };
  FittingFibers(const YarnConfig& yarn, const BlocksOfYarn& blocks, const Setup& setup);

  /// Fiber i of a ply.
  FittingFiber fiber(int ply, int i) const;

  /// Turns of a fiber about its ply from share 0 on.
  double turns(const FittingFiber& fiber, double share) const;
  /// Radians.
  double migration_phase(const FittingFiber& fiber, double share) const;
  /// Waves of migration per tile: the number that is nearest to the one asked for, at most half a
  /// wave per block away.
  int migration_waves() const {
    return waves_by_turn_ * setup_.ply_turns + waves_of_block_ * blocks_;
  }
  /// To the yarn's side and up, mm.
  Eigen::Vector2d wander_mm(const FittingFiber& fiber, double share) const;
  /// Share of the tile from there to the nearest border.
  double distance_to_border(double share) const;

 private:
  struct InBlock {
    int block;
    double share;  // of the block
  };
  InBlock in_block(double share) const;
  /// Turns at a border: the multiple of 1 / order that is nearest to an even twist.
  double turns_at_border(int order, int border) const;
  FittingWander draw_wander(std::uint32_t yarn, std::uint64_t sample) const;

  const YarnConfig& yarn_;
  Setup setup_;
  int blocks_;
  std::uint32_t pattern_yarn_;
  int order_;               // of the rings
  double pattern_angle_;    // turns
  int waves_by_turn_ = 0;   // waves of migration that a fiber makes per turn
  int waves_of_block_ = 0;  // and per block, besides
  double flat_;             // share of a block at each end that is the same in all blocks
  double ramp_;             // share of a block over which wander becomes its own
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_FITTING_FIBERS_H_
