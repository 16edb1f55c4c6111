#include "fibers/cloth/coarse_fabric.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "fibers/cloth/synthesize.h"

namespace heddle {
namespace {

constexpr int kFibersInOne = 16;

/// Radius squared times length, summed: the volume of all fibers over pi.
double volume_of(const Exemplar& exemplar) {
  double volume = 0;
  for (std::uint32_t fiber = 0; fiber < exemplar.fiber_count(); ++fiber) {
    const double radius = exemplar.radius_mm[fiber];
    for (std::uint32_t k = exemplar.first_point[fiber]; k + 1 < exemplar.first_point[fiber + 1];
         ++k)
      volume += radius * radius * (exemplar.points[k + 1] - exemplar.points[k]).norm();
  }
  return volume;
}

TEST(CoarseFabricLaw, EveryShippedFabricHasATinyFormOfTheSameVolume) {
  int fabrics = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(HEDDLE_SOURCE_DIR) + "/configs/fabrics")) {
    const TomlTable document = TomlTable::load(entry.path());
    if (!document.has("fiber")) continue;
    FabricConfig config = read_fabric_config(document);
    const Exemplar full = synthesize(config);
    if (full.segment_count() < 30'000) continue;  // tiny as it is
    make_coarse(config, kFibersInOne);
    const Exemplar tiny = synthesize(config);
    const std::string name = entry.path().filename().string();
    EXPECT_NO_THROW(validate_exemplar(tiny, name));
    EXPECT_LT(tiny.segment_count(), 16'000U) << name;
    EXPECT_NEAR(volume_of(tiny) / volume_of(full), 1, 0.15) << name;
    EXPECT_EQ(tiny.width_mm, full.width_mm) << name;
    ++fabrics;
  }
  EXPECT_GE(fabrics, 16);
}

TEST(CoarseFabric, AKeyOfTheFabric) {
  const std::string file = std::string(HEDDLE_SOURCE_DIR) + "/configs/fabrics/denim.toml";
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  const FabricConfig full = read_fabric_config(TomlTable::parse(text.str(), file));
  const FabricConfig tiny = read_fabric_config(TomlTable::parse("coarse = 4\n" + text.str(), file));
  EXPECT_DOUBLE_EQ(tiny.segment_mm, 2 * full.segment_mm);
  EXPECT_DOUBLE_EQ(tiny.fibers[0].radius_mm, 2 * full.fibers[0].radius_mm);
  EXPECT_NEAR(tiny.yarns[0].fibers_per_ply, full.yarns[0].fibers_per_ply / 4.0, 0.51);
  EXPECT_DOUBLE_EQ(tiny.yarns[0].hairs.per_mm, full.yarns[0].hairs.per_mm / 4);
}

}  // namespace
}  // namespace heddle
