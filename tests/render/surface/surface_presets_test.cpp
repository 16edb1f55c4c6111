#include "render/surface/surface_presets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "formats/input_error.h"
#include "render/surface/surface_model.h"

namespace heddle {
namespace {

TEST(SurfacePresets, AreTheConfigsWithAModel) {
  std::vector<std::string> expected;
  for (const auto& entry :
       std::filesystem::directory_iterator(HEDDLE_SOURCE_DIR "/configs/fabrics")) {
    if (entry.path().extension() != ".toml" || !TomlTable::load(entry.path()).has("model"))
      continue;
    expected.push_back(entry.path().stem().string());
    EXPECT_EQ(surface_preset(expected.back()).canonical_text(),
              TomlTable::load(entry.path()).canonical_text());
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(surface_preset_names(), expected);
}

TEST(SurfacePresets, EachIsOfItsModelAndCanBeRead) {
  for (const std::string& name : surface_preset_names()) {
    const TomlTable document = surface_preset(name);
    const std::vector<std::string> alike = surface_preset_names(document.string("model"));
    EXPECT_NE(std::find(alike.begin(), alike.end(), name), alike.end());
    EXPECT_NO_THROW(read_surface_model(document)) << name;
  }
  EXPECT_TRUE(surface_preset_names("velour").empty());
}

TEST(SurfacePresetsFormat, AnUnknownNameListsTheKnownOnes) {
  try {
    surface_preset("denim");
    FAIL();
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("denim"), std::string::npos);
    for (const std::string& name : surface_preset_names())
      EXPECT_NE(message.find(name), std::string::npos);
  }
}

}  // namespace
}  // namespace heddle
