#ifndef HEDDLE_FIBERS_CLOTH_PILE_H_
#define HEDDLE_FIBERS_CLOTH_PILE_H_
// Pile: fibers that stand on the face of a ground cloth, with one end in a yarn and one free. Cut
// pile (velvet, corduroy) stands up and is shorn to a height; the raised face of a fleece is long,
// leans over and is in disorder. Both are one model with other numbers. Tested in
// tests/fibers/cloth/pile_test.cpp.

#include <cstdint>
#include <optional>

#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/flyaways.h"
#include "formats/toml_table.h"

namespace heddle {

struct PileConfig {
  int fiber = 0;               // index into FabricConfig::fibers
  double per_mm2 = 0;          // fibers per area of cloth
  MeanAndDeviation length_mm;  // before shearing
  // Height above the ground's highest point at which it is shorn; 0: it is not.
  double height_mm = 0;
  double lean = 0;          // of the pile as a whole, from the normal of the cloth, radians
  double lean_azimuth = 0;  // which way: 0 along the weft, pi / 2 along the warp
  double spread = 0;        // deviation of a fiber's direction from this, radians
  double bend = 0;          // how much further a fiber leans at its end than at its root, radians
  double curl = 0;          // rms angle of its bends, radians
  double curl_mm = 0;       // their length
  // Ribs of corduroy run along y; pile stands on them alone, as a half ellipse in section.
  int ribs = 0;              // in the tile; 0: pile everywhere
  double rib_gap_share = 0;  // of a rib's room, without pile
};

/// Reads [pile] but for `fiber`, which the caller finds.
PileConfig read_pile(const TomlTable& table);

/// Segments that the pile is expected to have, before it is shorn.
double segments_of_pile(const PileConfig& pile, double area_mm2, double segment_mm);

/// Appends the pile to the exemplar of its ground. Roots are points of the ground's fibers in the
/// upper half of its thickness, so pile stands where yarns are. No fiber is longer than the tile.
void add_pile(const PileConfig& pile, double fiber_radius_mm, double segment_mm, std::uint64_t seed,
              std::uint32_t yarn_index, Exemplar& exemplar);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_PILE_H_
