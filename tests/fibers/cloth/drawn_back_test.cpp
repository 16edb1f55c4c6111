// A weave that is drawn back from its fibers equals the weave that was read.

#include <gtest/gtest.h>

#include <string>

#include "fibers/cloth/synthesize.h"
#include "fibers/cloth/weave_config.h"
#include "tests/support/fabrics.h"
#include "tests/support/mutations.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/weave_of_exemplar.h"

namespace heddle {
namespace {

/// A small fabric with these keys in [weave], read from a file in `folder`.
FabricConfig fabric_with(const std::filesystem::path& folder, const std::string& weave_keys) {
  std::string text = test::small_fabric_toml();
  const std::string plain = "notation = \"plain\"\n";
  text.replace(text.find(plain), plain.size(), weave_keys + "\n");
  const TomlTable document = TomlTable::parse(text, (folder / "fabric.toml").string());
  FabricConfig config = read_fabric_config(document);
  document.finish();
  return config;
}

void expect_drawn_back(const FabricConfig& config) {
  const Exemplar exemplar = synthesize(config);
  const Weave drawn = test::weave_of_exemplar(exemplar, config.weave.ends * config.repeats_x,
                                              config.weave.picks * config.repeats_y);
  int wrong = 0;
  for (int pick = 0; pick < drawn.picks; ++pick) {
    for (int end = 0; end < drawn.ends; ++end)
      wrong += drawn.is_warp_up(end, pick) != config.weave.is_warp_up(end, pick) ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0) << config.weave.notation << ", " << config.weave.warp_up.size();
}

TEST(DrawnBackLaw, EveryNotationLiesInTheFibers) {
  const TemporaryFolder folder;
  for (const char* keys :
       {"notation = \"plain\"", "notation = \"warp rib 2/2\"", "notation = \"weft rib 3/1\"",
        "notation = \"basket 2/2\"", "notation = \"twill 2/2\"",
        "notation = \"twill 3/1\"\ndirection = \"S\"", "notation = \"twill 2/1/1/2\"\nstep = 5",
        "notation = \"herringbone 2/2\"\nwidth = 4", "notation = \"pointed 2/1\"\nwidth = 3",
        "notation = \"satin 5/2\"\nface = \"weft\"", "notation = \"4/1 satin\"",
        "notation = \"2/3 satin\"", "notation = \"1/4 satin\"",
        "matrix = \"1101 0110 1011 0010 0101\""}) {
    expect_drawn_back(fabric_with(folder.path(), keys));
  }
}

TEST(DrawnBackLaw, ADraftAndAPointPaperLieInTheFibers) {
  const TemporaryFolder folder;
  write_bytes(folder.path() / "d.wif",
              "[WIF]\n[WEAVING]\nShafts=4\nTreadles=5\nRising Shed=no\n[WARP]\nThreads=6\n[WEFT]\n"
              "Threads=7\n[THREADING]\n1=1\n2=3\n3=2\n4=4\n5=3\n6=2\n[TIEUP]\n1=1,3\n2=2\n3=1,4\n"
              "4=2,4\n5=3\n[TREADLING]\n1=1\n2=2\n3=3\n4=4\n5=5\n6=1,2\n7=4\n");
  const FabricConfig draft = fabric_with(folder.path(), "draft = \"d.wif\"");
  ASSERT_EQ(draft.weave.warp_up.size(), 42U);
  expect_drawn_back(draft);
  std::vector<std::uint8_t> rgb;
  for (const char c : std::string("1001011010110110"))
    rgb.insert(rgb.end(), 3, c == '1' ? 20 : 240);
  write_png(folder.path() / "p.png", 4, 4, rgb);
  expect_drawn_back(fabric_with(folder.path(), "picture = \"p.png\""));
}

TEST(DrawnBackLaw, RepeatsAreSeenToo) {
  const TemporaryFolder folder;
  FabricConfig config = fabric_with(folder.path(), "notation = \"twill 2/1\"");
  config.repeats_x = 2;
  config.repeats_y = 3;
  expect_drawn_back(config);
}

}  // namespace
}  // namespace heddle
