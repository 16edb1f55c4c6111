#ifndef HEDDLE_FIBERS_CLOTH_FABRIC_CONFIG_H_
#define HEDDLE_FIBERS_CLOTH_FABRIC_CONFIG_H_
// What a fabric TOML says about the cloth itself: weave, yarns, fibers. Keys, units and ranges:
// configs/README.md. Lengths in millimetres, angles in radians after parsing. Tested in
// tests/fibers/cloth/fabric_config_test.cpp.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fibers/cloth/curve_exemplar.h"
#include "fibers/cloth/knit.h"
#include "fibers/cloth/pile.h"
#include "fibers/cloth/weave.h"
#include "fibers/cloth/yarn_config.h"
#include "formats/toml_table.h"

namespace heddle {

/// One thread system: all warp yarns (ends) or all weft yarns (picks).
struct ThreadSystem {
  double spacing_mm = 0;      // distance between neighbouring yarns
  std::vector<int> sequence;  // index into FabricConfig::yarns; repeated over the tile

  int yarn_at(int place) const {
    return sequence[static_cast<std::size_t>(place) % sequence.size()];
  }
};

struct FabricConfig {
  std::string name;
  Weave weave;
  // weave repeats in the tile along the weft (x) and along the warp (y)
  int repeats_x = 1;
  int repeats_y = 1;
  // Weave repeats along weft and warp in the blocks of the tile that fit each other; 0: none need.
  std::array<int, 2> fitting_blocks = {0, 0};
  // share of the pull that the weft takes, 0 .. 1, and thus of the crimp that the warp takes
  double crimp_warp = 0.5;
  double segment_mm = 0;  // target length of a fiber segment
  std::vector<FiberType> fibers;
  std::vector<YarnConfig> yarns;
  ThreadSystem warp;
  ThreadSystem weft;
  // Instead of a weave with its warp and weft:
  std::optional<KnitConfig> knit;
  std::optional<CurvesConfig> curves;
  std::optional<PileConfig> pile;      // on any of them
  bool light_from_both_sides = false;  // light_from = "face" | "both"
  std::uint64_t seed = 1;

  const YarnConfig& yarn(int k) const { return yarns[static_cast<std::size_t>(k)]; }
  const FiberType& fiber_of(const YarnConfig& yarn) const {
    return fibers[static_cast<std::size_t>(yarn.fiber)];
  }
  /// What a yarn of a system has between its neighbours (mm).
  double room_mm(const ThreadSystem& system, int place) const {
    const double own = yarn(system.yarn_at(place)).spacing_mm;
    return own > 0 ? own : system.spacing_mm;
  }
};

/// Larger side of the largest section among these yarns.
double thickest_yarn_mm(const FabricConfig& config, const std::vector<int>& yarns);

/// Reads the keys that describe the cloth ([weave], [warp], [weft], [fiber.NAME], name, light_from,
/// seed). The caller reads the other sections and calls finish() on the document.
FabricConfig read_fabric_config(const TomlTable& document);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_FABRIC_CONFIG_H_
