#include "fibers/cloth/fabric_config.h"

#include <gtest/gtest.h>

#include "formats/input_error.h"
#include "tests/support/fabrics.h"

namespace heddle {
namespace {

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(FabricConfig, ReadsUnitsIntoMillimetresAndRadians) {
  const FabricConfig config = test::small_fabric("twill 2/2");
  EXPECT_EQ(config.weave.ends, 4);
  EXPECT_DOUBLE_EQ(config.fibers[0].radius_mm, 0.014);
  EXPECT_DOUBLE_EQ(config.fibers[0].scattering.beta_tt, radians(10));
  EXPECT_DOUBLE_EQ(config.yarns[0].ply_turns_per_mm, -2);
  EXPECT_DOUBLE_EQ(config.yarns[1].wander_rms, radians(4));
}

TEST(FabricConfig, EachClassOfErrorNamesPlaceAndExpectation) {
  const std::string good = test::small_fabric_toml();
  std::string many_fibers;
  for (int k = 0; k < 64; ++k) {
    many_fibers +=
        "[fiber.f" + std::to_string(k) + "]\nradius_um = 14\nscattering = \"white-isotropic\"\n";
  }
  const std::vector<std::array<std::string, 3>> cases = {
      // changed text, replacement, what the message must hold
      {"radius_um = 14", "radius_mm = 0.014", "radius_um"},
      {"radius_um = 14", "radius_um = nan", "fabric.toml:11:"},
      {"radius_um = 14", "radius_um = \"14\"", "number"},
      {"radius_um = 14", "radius_um = -3", "0.1"},
      {"radius_um = 14", "radius_um = 14\nradius_km = 2", "fabric.toml:12:"},
      {"segment_um = 60", "", "segment_um"},
      {"\"plain\"", "\"basket\"", "twill UP/DOWN"},
      {"\"plain\"", "\"satin 6/2\"", "face"},
      {"fiber = \"thread\"", "fiber = \"wool\"", "thread"},
      {"width_mm = 0.24", "width_mm = 0.31", "spacing_mm"},
      {"height_mm = 0.16", "height_mm = 0.02", "thickness of one fiber"},
      {"color_r = [0.3, 0.2, 0.1]", "color_r = [0.3, 0.2]", "color_r"},
      {"color_r = [0.3, 0.2, 0.1]", "color_r = [0.3, 0.2, 1.1]", "1"},
      {"plies = 2", "plies = 2.5", "integer"},
      {"[fiber.thread]", many_fibers + "[fiber.thread]", "1 to 64 tables [fiber.NAME]"},
      {"light_from = \"face\"", "light_from = \"above\"", "both"},
  };
  for (const auto& [from, to, expected] : cases) {
    try {
      const TomlTable document = TomlTable::parse(with(good, from, to), "fabric.toml");
      read_fabric_config(document);
      document.finish();
      ADD_FAILURE() << to << " was accepted";
    } catch (const ConfigError& error) {
      const std::string message = error.what();
      EXPECT_TRUE(message.starts_with("fabric.toml:")) << message;
      EXPECT_NE(message.find(expected), std::string::npos) << to << "\n" << message;
    }
  }
}

TEST(FabricConfig, TilesAreAtMostTenMetres) {
  const auto message = [](const std::string& key, const std::string& yarn) {
    std::string text = with(test::small_fabric_toml(), key + " = 1", key + " = 64");
    const std::size_t at = text.find("spacing_mm = 0.3", text.find(yarn));
    text.replace(at, 16, "spacing_mm = 78.2");
    try {
      read_fabric_config(TomlTable::parse(text, "fabric.toml"));
    } catch (const ConfigError& error) {
      return std::string(error.what()).substr(0, 110);
    }
    return std::string();
  };
  EXPECT_EQ(message("repeats_x", "[warp]")
                .find("fabric.toml:7:1: 'repeats_x': expected a tile of at most 10000 mm, found "
                      "10009.6 mm"),
            0U)
      << message("repeats_x", "[warp]");
  EXPECT_EQ(message("repeats_y", "[weft]")
                .find("fabric.toml:8:1: 'repeats_y': expected a tile of at most 10000 mm, found "
                      "10009.6 mm"),
            0U);
  EXPECT_EQ(message("repeats_y", "[warp]"), "");
}

}  // namespace
}  // namespace heddle
