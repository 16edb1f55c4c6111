#include "fibers/cloth/synthesize.h"

#include <gtest/gtest.h>

#include "formats/toml_table.h"
#include "tests/support/fabrics.h"

namespace heddle {
namespace {

TEST(SynthesizeLaw, EveryWeaveGivesAValidPeriodicExemplar) {
  for (const char* notation : {"plain", "twill 2/2", "satin 5/2"}) {
    const FabricConfig config = test::small_fabric(notation);
    const Exemplar exemplar = synthesize(config);
    EXPECT_NO_THROW(validate_exemplar(exemplar, notation));
    EXPECT_EQ(exemplar.fiber_count(),
              2U * 6U * static_cast<unsigned>(config.weave.ends + config.weave.picks));
    EXPECT_FLOAT_EQ(exemplar.width_mm,
                    static_cast<float>(config.weave.ends * config.warp.spacing_mm));
  }
}

TEST(SynthesizeLaw, SameConfigSameBits) {
  EXPECT_EQ(synthesize(test::small_fabric()).points, synthesize(test::small_fabric()).points);
}

// The shipped fabrics: full size where they claim it, small where the quick start and the tests
// need it.
TEST(SynthesizeLaw, TheForecastCountsTheSegments) {
  for (const char* notation : {"plain", "twill 3/1", "satin 5/2"}) {
    FabricConfig config = test::small_fabric(notation);
    config.repeats_x = 3;
    config.yarns[0].fibers_per_ply = 5;
    EXPECT_EQ(forecast_exemplar(config).segments,
              static_cast<double>(synthesize(config).segment_count()))
        << notation;
  }
}

TEST(SynthesizeLaw, TilesBeyondTheIndicesAreRefused) {
  FabricConfig config = test::small_fabric();
  config.repeats_x = config.repeats_y = 64;
  config.yarns[0].fibers_per_ply = config.yarns[1].fibers_per_ply = 1'000'000;
  EXPECT_THROW(synthesize(config), std::invalid_argument);
}

TEST(Synthesize, ShippedFabricsHaveTheSizeTheyClaim) {
  auto summary_of = [](const std::string& name) {
    const TomlTable document =
        TomlTable::load(std::string(HEDDLE_SOURCE_DIR) + "/configs/fabrics/" + name);
    const Exemplar exemplar = synthesize(read_fabric_config(document));
    EXPECT_NO_THROW(validate_exemplar(exemplar, name));
    return summarize(exemplar);
  };
  for (const char* name : {"cotton-plain.toml", "wool-gabardine.toml", "silk-satin.toml"}) {
    const ExemplarSummary summary = summary_of(name);
    EXPECT_GE(summary.segments, 50000U) << name;
    EXPECT_GT(summary.volume_fraction, 0.2) << name;
    EXPECT_LT(summary.volume_fraction, 0.6) << name;
  }
  EXPECT_LE(summary_of("cotton-quickstart.toml").segments, 15000U);
  for (const char* name : {"cotton-tiny.toml", "wool-tiny.toml", "silk-tiny.toml"}) {
    EXPECT_LE(summary_of(name).segments, 4000U) << name;
  }
}

}  // namespace
}  // namespace heddle
