#include "fibers/cloth/yarn_config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "fibers/cloth/fabric_config.h"
#include "fibers/cloth/synthesize.h"
#include "formats/input_error.h"
#include "formats/toml_table.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

const std::string kWay =
    "yarn_twist_per_m = 0\nply_twist_per_m = 500\nmigration = 0.1\nwander_rms_deg = 4\n";

/// A plain cloth of the yarns "a" (Ne 50, dyed) and "b" (Ne 25).
std::string cloth(const std::string& warp, const std::string& weave = "notation = \"plain\"",
                  const std::string& repeats = "repeats_x = 2\nrepeats_y = 1\n") {
  return "name = \"cloth\"\nsegment_um = 100\n[weave]\n" + weave + "\n" + repeats +
         "[fiber.cotton]\nmicronaire = 4.2\ndensity_g_cm3 = 1.52\ncolor_r = [0.1, 0.1, 0.1]\n"
         "color_tt = [0.9, 0.9, 0.9]\nbeta_r_deg = 5\nbeta_tt_deg = 10\ngamma_tt_deg = 20\n"
         "[yarn.a]\nfiber = \"cotton\"\ncolor = \"#ff8000\"\ncount = \"Ne 50\"\nplies = 1\n" +
         kWay + "[yarn.b]\nfiber = \"cotton\"\ncount = \"Ne 50/2\"\nspacing_mm = 0.5\n" + kWay +
         "[warp]\n" + warp + "\n[weft]\nyarn = \"a\"\nper_cm = 25\n";
}

FabricConfig read(const std::string& text, const std::string& name = "cloth.toml") {
  return read_fabric_config(TomlTable::parse(text, name));
}

std::string message_of(const std::string& text) {
  try {
    read(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

// Ne 50 is 11.8 tex; cotton of micronaire 4.2 is 0.165 tex; Peirce's diameter is 0.0375 sqrt(tex).
TEST(YarnConfig, CountsGiveFibersAndSection) {
  const FabricConfig config = read(cloth("yarn = \"a\"\nper_cm = 40"));
  EXPECT_EQ(config.yarns[0].fibers_per_ply, 71);
  EXPECT_NEAR(config.yarns[0].width_mm, 0.0375 * std::sqrt(11.8), 0.002);
  EXPECT_EQ(config.yarns[1].plies, 2);
  EXPECT_DOUBLE_EQ(config.warp.spacing_mm, 0.25);
  EXPECT_NEAR(fill_of(config.yarns[0], config.fibers[0]), 0.6, 1e-9);
}

// The dyed fiber is one more material: R = (1 - g) / (1 + g), g = sqrt(1 - a).
TEST(YarnConfig, ColorsDyeTheFiber) {
  const FabricConfig config = read(cloth("yarn = \"a\"\nper_cm = 40"));
  ASSERT_EQ(config.fibers.size(), 2U);
  const Rgbd a = config.fibers[static_cast<std::size_t>(config.yarns[0].fiber)].scattering.color_tt;
  const Rgbd g = (1 - a).max(0.0).sqrt();
  const Rgbd shown = (1 - g) / (1 + g);
  EXPECT_NEAR(shown[0], 1, 1e-12);
  EXPECT_NEAR(shown[1], 0.21586, 1e-5);
  EXPECT_NEAR(shown[2], 0, 1e-12);
  EXPECT_EQ(config.yarns[1].fiber, 0);
}

TEST(YarnConfig, SequencesLayYarnsSideBySide) {
  const FabricConfig config = read(cloth("sequence = [\"3 a\", \"b\"]\nspacing_mm = 0.25"));
  EXPECT_EQ(config.warp.sequence, (std::vector<int>{0, 0, 0, 1}));
  const Exemplar exemplar = synthesize(config);
  EXPECT_FLOAT_EQ(exemplar.width_mm, 3 * 0.25F + 0.5F);
  // Materials tell the yarns apart: fibers of the fourth end are undyed.
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f)
    EXPECT_EQ(exemplar.material[f] == 0, exemplar.yarn[f] == 3) << f;
}

TEST(YarnConfig, ThreadsTakeTheColoursOfTheirDraft) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "d.wif")
      << "[WIF]\nVersion=1.1\n[CONTENTS]\nCOLOR PALETTE=yes\nCOLOR TABLE=yes\nWEAVING=yes\n"
         "WARP=yes\nWEFT=yes\nTHREADING=yes\nLIFTPLAN=yes\nWARP COLORS=yes\n[WEAVING]\nShafts=2\n"
         "Treadles=2\nRising Shed=yes\n[COLOR PALETTE]\nEntries=2\nRange=0,255\n[COLOR TABLE]\n"
         "1=255,0,0\n2=0,0,255\n[WARP]\nThreads=4\nColor=1\n[WEFT]\nThreads=2\nColor=2\n"
         "[WARP COLORS]\n2=2\n[THREADING]\n1=1\n2=2\n3=1\n4=2\n[LIFTPLAN]\n1=1\n2=2\n";
  const std::string text = cloth("yarn = \"b\"\nspacing_mm = 0.3\ncolors = \"draft\"",
                                 "draft = \"d.wif\"", "repeats_x = 1\nrepeats_y = 1\n");
  const FabricConfig config = read(text, (folder.path() / "cloth.toml").string());
  ASSERT_EQ(config.warp.sequence.size(), 4U);
  for (int end = 0; end < 4; ++end) {
    const YarnConfig& yarn = config.yarn(config.warp.yarn_at(end));
    const Rgbd color = config.fibers[static_cast<std::size_t>(yarn.fiber)].scattering.color_tt;
    EXPECT_EQ(color[0] > 0.5, end != 1) << end;
    EXPECT_EQ(color[2] > 0.5, end == 1) << end;
  }
}

TEST(YarnConfig, ErrorsSayWhatWouldDo) {
  EXPECT_NE(message_of(cloth("yarn = \"a\"\nper_cm = 90")).find("at most 78"), std::string::npos)
      << message_of(cloth("yarn = \"a\"\nper_cm = 90"));
  EXPECT_NE(message_of(cloth("sequence = [\"3 a\"]\nspacing_mm = 0.25")).find("a multiple of 3"),
            std::string::npos);
  for (const char* warp :
       {"sequence = [\"0 a\"]\nper_cm = 40", "sequence = [\"4\"]\nper_cm = 40",
        "sequence = [\"4a\"]\nper_cm = 40", "sequence = [\"2000000000 a\"]\nper_cm = 40",
        "sequence = [\"99999999999999999999 a\"]\nper_cm = 40", "sequence = []\nper_cm = 40",
        "yarn = \"c\"\nper_cm = 40", "yarn = \"a\"\nper_cm = 40\nspacing_mm = 0.25",
        "yarn = \"a\"\nper_cm = 40\ncolors = \"draft\""}) {
    EXPECT_TRUE(message_of(cloth(warp)).starts_with("cloth.toml:")) << warp;
  }
}

}  // namespace
}  // namespace heddle
