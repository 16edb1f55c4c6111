#ifndef HEDDLE_TESTS_SUPPORT_FABRICS_H_
#define HEDDLE_TESTS_SUPPORT_FABRICS_H_
// Small fabrics and exemplars for tests: built in memory, a few hundred segments.

#include <string>
#include <vector>

#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/fabric_config.h"
#include "formats/toml_table.h"

namespace heddle::test {

/// A plain weave of loosely packed yarns; `scattering` is the text of the fiber's scattering keys.
inline std::string small_fabric_toml(
    const std::string& notation = "plain", const std::string& light_from = "face",
    const std::string& scattering =
        "color_r = [0.3, 0.2, 0.1]\ncolor_tt = [0.8, 0.6, 0.4]\nbeta_r_deg = 5\n"
        "beta_tt_deg = 10\ngamma_tt_deg = 20\n") {
  const std::string face = notation.starts_with("satin") ? "face = \"warp\"\n" : "";
  const std::string yarn =
      "fiber = \"thread\"\nspacing_mm = 0.3\nwidth_mm = 0.24\nheight_mm = 0.16\nplies = "
      "2\nfibers_per_ply = 6\n"
      "yarn_twist_per_m = 1000\nply_twist_per_m = -2000\nmigration = 0.2\nwander_rms_deg = 4\n";
  return "name = \"small\"\nseed = 7\nlight_from = \"" + light_from +
         "\"\nsegment_um = 60\n[weave]\nnotation = \"" + notation + "\"\n" + face +
         "repeats_x = 1\nrepeats_y = 1\ncrimp_warp = 0.4\n[fiber.thread]\nradius_um = 14\n" +
         scattering + "[warp]\n" + yarn + "[weft]\n" + yarn;
}

inline FabricConfig small_fabric(const std::string& notation = "plain") {
  const TomlTable document = TomlTable::parse(small_fabric_toml(notation), "small.toml");
  FabricConfig config = read_fabric_config(document);
  document.finish();
  return config;
}

/// The same with flyaways on its yarns, 1.2 mm wide and high: hairs, which are open fibers, across
/// every edge of the tile, and loops.
inline FabricConfig small_hairy_fabric() {
  FabricConfig config = small_fabric();
  config.repeats_x = config.repeats_y = 2;
  for (YarnConfig& yarn : config.yarns) {
    yarn.hairs = {4, {0.05, 0.005}, {0.1, 0.03}, {0, 0.1}, {0, 0.5}};
    yarn.loops = {1, {0.1, 0.01}};
  }
  return config;
}

/// A jersey of three courses and two wales, 1 mm wide and 1.2 mm high.
inline FabricConfig small_knit() {
  FabricConfig config = small_fabric();
  config.knit = KnitConfig{KnitStructure::kJersey, 2, 2.5, 2, 3, {0}};
  config.yarns[0].width_mm = config.yarns[0].height_mm = 0.11;
  config.yarns[0].fibers_per_ply = 3;
  return config;
}

/// One of each kind whose geometry is special.
inline std::vector<FabricConfig> kinds_of_cloth() {
  return {small_fabric(), small_hairy_fabric(), small_knit()};
}

/// Straight periodic fibers along x at the given (y, z), `segments` pieces each, on a width x
/// height tile.
inline Exemplar straight_fibers(float width, float height, const std::vector<Vec2>& places,
                                float radius, int segments, const FiberScattering& scattering) {
  Exemplar exemplar;
  exemplar.width_mm = width;
  exemplar.height_mm = height;
  exemplar.scattering = {scattering};
  exemplar.first_point = {0};
  for (const Vec2& place : places) {
    for (int k = 0; k <= segments; ++k) {
      exemplar.points.emplace_back(width * static_cast<float>(k) / static_cast<float>(segments),
                                   place.x(), place.y());
    }
    exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
    exemplar.radius_mm.push_back(radius);
    exemplar.material.push_back(0);
  }
  index_segments(exemplar);
  return exemplar;
}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_SUPPORT_FABRICS_H_
