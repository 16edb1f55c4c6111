#ifndef HEDDLE_FIBERS_CLOTH_YARN_CONFIG_H_
#define HEDDLE_FIBERS_CLOTH_YARN_CONFIG_H_
// What a fabric TOML says about fibers and yarns. Keys, units and ranges: configs/README.md.
// Lengths in millimetres, angles in radians after parsing. Tested in
// tests/fibers/cloth/yarn_config_test.cpp.

#include <optional>
#include <string>
#include <vector>

#include "fibers/cloth/flyaways.h"
#include "fibers/cloth/yarn_section.h"
#include "fibers/scattering/fiber_bcsdf.h"
#include "formats/toml_table.h"

namespace heddle {

/// A fiber type: its thickness and how it scatters.
struct FiberType {
  std::string name;
  double radius_mm = 0;
  double density_g_cm3 = 0;  // 0: not told
  FiberScattering scattering;
};

/// One yarn: its fibers and how they lie in it.
struct YarnConfig {
  std::string name;
  int fiber = 0;         // index into FabricConfig::fibers
  double width_mm = 0;   // full width of the flattened yarn in the plane of the cloth
  double height_mm = 0;  // full height of the flattened yarn
  // room that it has between its neighbours; 0: the spacing of its system
  double spacing_mm = 0;
  // share of its height that it loses where it is pressed hardest, 0 .. 0.5
  double contact_flattening = 0;
  // share of the free room beside it in the plane of the cloth that a woven yarn takes, 0 .. 1
  double spread = 0;
  int plies = 1;
  int fibers_per_ply = 1;
  // twist of the plies about the yarn, positive = Z; snapped to whole turns per tile
  double yarn_turns_per_mm = 0;
  double ply_turns_per_mm = 0;  // twist of the fibers about their ply, likewise
  // relative depth of radial migration, 0 .. 1 (Zhao et al. 2016: 1 - rho_min)
  double migration = 0;
  // waves of migration per turn of a fiber about its ply; snapped to whole waves per tile, at least
  // one
  double migration_per_turn = 1;
  // rms angle (radians) of irregular fiber wander against the ideal helix
  double wander_rms = 0;
  // Ellipses of the plies of the round yarn, in mm, of the fibers' axes. Without it plies are
  // circles that fill the section.
  std::optional<PlyShape> ply_mm;
  RadialDensity density;
  Hairs hairs;
  Loops loops;
  std::vector<Slubs> slubs;
  Neps neps;

  /// Radius (mm) of the round yarn, up to the axes of its outermost fibers. Woven, its section is
  /// flattened to width_mm x height_mm; flyaways keep their lengths.
  double round_radius_mm(double fiber_radius_mm) const;
};

/// Index of the fiber type that the key `fiber` of a table names.
int find_fiber(const TomlTable& table, const std::vector<FiberType>& fibers);

/// Reads a table [fiber.NAME].
FiberType read_fiber(const TomlTable& table, const std::string& name);

/// Reads the keys of one yarn from a table [yarn.NAME], [warp] or [weft]. They may stand in a file
/// of their own, named by `from`. A yarn with colours of its own adds a fiber type.
YarnConfig read_yarn(const TomlTable& table, const std::string& name,
                     std::vector<FiberType>& fibers);

/// The fiber type `fiber`, dyed so that thick cloth of it shows about the colour (linear rgb) in
/// even light; found among `fibers` or added to them. Deep layers of scatterers of albedo a reflect
/// R = (1 - g) / (1 + g), g = sqrt(1 - a) (diffusive reflectance, Hapke 1981), so color_tt becomes
/// 4 R / (1 + R)^2. The surface's own reflection, color_r, stays.
int dyed_fiber(int fiber, const Rgbd& color, std::vector<FiberType>& fibers);

/// Share of the area of a yarn's section that its fibers fill; above 0.9 no real fibers fit.
double fill_of(const YarnConfig& yarn, const FiberType& fiber);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_YARN_CONFIG_H_
