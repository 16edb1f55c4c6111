#include "pipeline/draft_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "fibers/cloth/weave_config.h"
#include "formats/curve_file.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/mutations.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

const std::string kDraft =
    "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=4\nTreadles=4\nRising Shed=yes\n[TEXT]\nTitle=Twill\n"
    "[COLOR PALETTE]\nRange=0,255\n[COLOR TABLE]\n1=255,0,128\n2=1,2,3\n"
    "[WARP]\nThreads=4\nColor=1\nUnits=Centimeters\nSpacing=0.04\nThickness=0.03\n"
    "[WEFT]\nThreads=4\nUnits=Centimeters\nSpacing=0.05\nThickness=0.02\n"
    "[WARP COLORS]\n2=2\n"
    "[THREADING]\n1=1\n2=2\n3=3\n4=4\n[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=1,4\n"
    "[TREADLING]\n1=1\n2=2\n3=3\n4=4\n";

TEST(DraftReport, DrawsThreadingTieupAndTreadlingAroundTheCloth) {
  EXPECT_EQ(draw_draft(parse_wif(kDraft, "d.wif")),
            (Lines{"---o  --oo", "--o-  -oo-", "-o--  oo--", "o---  o--o", "", "#..#  ---o",
                   "..##  --o-", ".##.  -o--", "##..  o---"}));
}

TEST(DraftReport, LargeWeavesAreCutAndSaySo) {
  Weave weave;
  weave.ends = 100;
  weave.picks = 60;
  weave.warp_up.assign(6000, 1);
  const Lines lines = draw_weave(weave);
  ASSERT_EQ(lines.size(), 49U);
  EXPECT_EQ(lines[0].size(), 64U);
  EXPECT_EQ(lines.back(), "the first 64 of 100 ends, the first 48 of 60 picks");
}

TEST(DraftReport, SaysWhatTheDraftStates) {
  const TemporaryFolder folder;
  write_bytes(folder.path() / "d.wif", kDraft);
  const auto report = describe_draft(folder.path() / "d.wif");
  EXPECT_EQ(report.at("title"), "Twill");
  EXPECT_EQ(report.at("float.warp_face.longest"), 2);
  EXPECT_EQ(report.at("ends_per_cm"), 25.0);
  EXPECT_EQ(report.at("picks_per_cm"), 20.0);
  EXPECT_EQ(report.at("cover.warp"), 0.75);
  EXPECT_EQ(report.at("cover.weft"), 0.4);
  EXPECT_EQ(report.at("cover.cloth"), 0.85);
  EXPECT_EQ(report.at("colors.warp"), "#ff0080 x 3, #010203 x 1");
  EXPECT_EQ(report.at("layers"), 1);
  EXPECT_TRUE(report.at("warnings").empty());
}

TEST(DraftReport, WarnsOfClothThatFallsApart) {
  nlohmann::ordered_json report;
  describe_weave(parse_weave_matrix("1101 0100 0111 0001"), report);
  ASSERT_EQ(report.at("layers"), 2) << report.dump(2);
  EXPECT_NE(report.at("warnings").at(0).get<std::string>().find("falls apart into 2 layers"),
            std::string::npos);
}

class DraftReportEndToEnd : public testing::Test {
 protected:
  ProgramResult run(std::vector<std::string> arguments) {
    for (std::string& argument : arguments) {
      if (argument.find('.') != std::string::npos) argument = (folder_.path() / argument).string();
    }
    return Program(folder_.path(), arguments).wait();
  }
  TemporaryFolder folder_;
};

TEST_F(DraftReportEndToEnd, InfoOfADraftAndOfAFabricWithIt) {
  write_bytes(folder_.path() / "d.wif", kDraft);
  const ProgramResult text = run({"info", "d.wif"});
  EXPECT_EQ(text.status, 0) << text.error;
  EXPECT_NE(text.out.find("#..#  ---o"), std::string::npos) << text.out;
  const auto json = nlohmann::json::parse(run({"info", "d.wif", "--json"}).out);
  EXPECT_EQ(json.at("kind"), "weave draft");
  write_bytes(folder_.path() / "fabric.toml",
              edited(kSmallFabric, "notation = \"plain\"", "draft = \"d.wif\""));
  const auto fabric = nlohmann::json::parse(run({"info", "fabric.toml", "--json"}).out);
  EXPECT_EQ(fabric.at("weave"), "d.wif");
  EXPECT_EQ(fabric.at("smallest_repeat"), "4 x 4");
  write_bytes(folder_.path() / "bad.wif", edited(kDraft, "4=1,4", "4=1,5"));
  const ProgramResult bad = run({"info", "bad.wif"});
  EXPECT_EQ(bad.status, 1);
  EXPECT_NE(bad.error.find("bad.wif:36: expected the number of a shaft"), std::string::npos)
      << bad.error;
}

TEST_F(DraftReportEndToEnd, ADraftEntersTheKeyOfFibersByItsContent) {
  write_bytes(folder_.path() / "d.wif", kDraft);
  write_bytes(folder_.path() / "moved.wif", kDraft);
  write_bytes(folder_.path() / "other.wif", edited(kDraft, "Rising Shed=yes", "Rising Shed=no"));
  std::vector<std::string> artifacts;
  for (const char* name : {"d.wif", "moved.wif", "other.wif"}) {
    write_bytes(folder_.path() / "fabric.toml", edited(kSmallFabric, "notation = \"plain\"",
                                                       std::string("draft = \"") + name + "\""));
    const ProgramResult result = run({"synth", "fabric.toml", "--cache", "the.cache"});
    EXPECT_EQ(result.status, 0) << result.error;
    artifacts.push_back(result.out);
  }
  EXPECT_EQ(artifacts[0], artifacts[1]);
  EXPECT_NE(artifacts[0], artifacts[2]);
}

TEST_F(DraftReportEndToEnd, FibersAreExportedAsCurves) {
  write_bytes(folder_.path() / "fabric.toml", kSmallFabric);
  CurveSet first;
  for (const char* name : {"out.hair", "out.bcc", "out.obj"}) {
    const ProgramResult result = run({"export", "fabric.toml", "-o", name});
    ASSERT_EQ(result.status, 0) << result.error;
    const CurveSet curves = read_curves(folder_.path() / name);
    EXPECT_EQ(curves.curve_count(), 4U * 24U) << name;
    if (first.points.empty()) first = curves;
    EXPECT_EQ(curves.points, first.points) << name;
    // A fiber ends one period after its start.
    const auto fiber = curves.curve(0);
    EXPECT_NEAR(fiber.back()[1] - fiber.front()[1], 0.5, 1e-6);
  }
  EXPECT_EQ(first.thickness.at(0), 0.02F);
  const auto info = nlohmann::json::parse(run({"info", "out.obj", "--json"}).out);
  EXPECT_EQ(info.at("kind"), "curves");
  EXPECT_EQ(info.at("curves"), 96);
  const ProgramResult wrong = run({"export", "fabric.toml", "-o", "out.abc"});
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.error.find("expected a name that ends in .hair"), std::string::npos);
}

}  // namespace
}  // namespace heddle
