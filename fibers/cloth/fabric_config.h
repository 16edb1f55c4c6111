#ifndef HEDDLE_FIBERS_CLOTH_FABRIC_CONFIG_H_
#define HEDDLE_FIBERS_CLOTH_FABRIC_CONFIG_H_
// What a fabric TOML says about the cloth itself: weave, yarns, fibers. Keys, units and ranges:
// configs/README.md. Lengths in millimetres, angles in radians after parsing. Tested in
// tests/fibers/cloth/fabric_config_test.cpp.

#include <cstdint>
#include <string>
#include <vector>

#include "fibers/cloth/weave.h"
#include "fibers/scattering/fiber_bcsdf.h"
#include "formats/toml_table.h"

namespace heddle {

/// A fiber type: its thickness and how it scatters.
struct FiberType {
  std::string name;
  double radius_mm = 0;
  FiberScattering scattering;
};

/// One thread system (all warp or all weft yarns).
struct YarnConfig {
  int fiber = 0;          // index into FabricConfig::fibers
  double spacing_mm = 0;  // distance between neighbouring yarns
  // full width of the flattened yarn in the plane of the cloth; at most spacing_mm
  double width_mm = 0;
  double height_mm = 0;  // full height of the flattened yarn
  int plies = 1;
  int fibers_per_ply = 1;
  // twist of the plies about the yarn, positive = Z; snapped to whole turns per tile
  double yarn_turns_per_mm = 0;
  double ply_turns_per_mm = 0;  // twist of the fibers about their ply, likewise
  // relative depth of radial migration, 0 .. 1 (Zhao et al. 2016: 1 - rho_min)
  double migration = 0;
  // rms angle (radians) of irregular fiber wander against the ideal helix
  double wander_rms = 0;
};

struct FabricConfig {
  std::string name;
  Weave weave;
  // weave repeats in the tile along the weft (x) and along the warp (y)
  int repeats_x = 1;
  int repeats_y = 1;
  double crimp_warp = 0.5;  // share of the crimp height that the warp takes, 0 .. 1
  double segment_mm = 0;    // target length of a fiber segment
  YarnConfig warp;
  YarnConfig weft;
  std::vector<FiberType> fibers;
  bool light_from_both_sides = false;  // light_from = "face" | "both"
  std::uint64_t seed = 1;
};

/// Reads the keys that describe the cloth ([weave], [warp], [weft], [fiber.NAME], name, light_from,
/// seed). The caller reads the other sections and calls finish() on the document.
FabricConfig read_fabric_config(const TomlTable& document);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_FABRIC_CONFIG_H_
