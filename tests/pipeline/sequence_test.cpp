// Sequences of pictures (docs/sequences.md), and scenes that hold everything at once.

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/image_file.h"
#include "formats/input_error.h"
#include "pipeline/contact_sheet.h"
#include "pipeline/render_frames.h"
#include "tests/pipeline/scene_shop.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

TEST(FrameNumbers, RangesAndSingleFrames) {
  EXPECT_EQ(parse_frames("0-95").last, 95);
  EXPECT_EQ(parse_frames("7").first, 7);
  EXPECT_EQ(parse_frames("7").last, 7);
  for (const char* wrong : {"", "a", "5-2", "1-", "-3", "1-2-3", "1:4", "0-1000000", " 1-2"})
    EXPECT_THROW(parse_frames(wrong), ConfigError) << wrong;
}

TEST(FrameNumbers, OutputsHaveAPlaceForThem) {
  EXPECT_EQ(numbered_output("out/f.exr"), "out/f_####.exr");
  EXPECT_EQ(numbered_output("out/f.##.exr"), "out/f.##.exr");
}

TEST(ContactSheet, FramesStandInRowsUnderTheirNumbers) {
  const TemporaryFolder folder;
  std::vector<SheetFrame> frames;
  for (int k = 0; k < 5; ++k) {
    const fs::path png = folder.path() / ("f" + std::to_string(k) + ".png");
    std::vector<std::uint8_t> rgb;
    for (int pixel = 0; pixel < 600 * 300; ++pixel)
      rgb.insert(rgb.end(), {static_cast<std::uint8_t>(40 * k), 100, 200});
    write_png(png, 600, 300, rgb);
    frames.push_back({k, png});
  }
  const RgbPicture sheet = contact_sheet(frames);
  // 600 pixels become 200, in three columns and two rows.
  EXPECT_EQ(sheet.width, 3 * 204 + 4);
  EXPECT_EQ(sheet.height, 2 * (100 + 4 + 14) + 4);
  const auto pixel = [&](int x, int y) { return &sheet.rgb[3UL * (y * sheet.width + x)]; };
  for (int k = 0; k < 5; ++k) {
    const std::uint8_t* middle = pixel(4 + k % 3 * 204 + 100, 4 + k / 3 * 118 + 50);
    EXPECT_EQ(middle[0], 40 * k);
    EXPECT_EQ(middle[2], 200);
    const std::uint8_t* label = pixel(4 + k % 3 * 204, 4 + k / 3 * 118 + 100);
    EXPECT_NE(std::count(label, label + 3 * 8, 235) +
                  std::count(label + 3 * sheet.width * 6, label + 3 * (sheet.width * 6 + 8), 235),
              0)
        << "a digit";
  }
  EXPECT_EQ(pixel(sheet.width - 10, sheet.height - 60)[0], 24) << "no sixth frame";
}

std::vector<float> green_of(const fs::path& exr) {
  return read_exr(exr).channels.at("G").values;
}

TEST(SequenceEndToEnd, FramesAreThePicturesOfTheirMeshesForAnyThreads) {
  const SequenceShop shop;
  shop.succeed({"render", "scene.toml", "-o", "one/f_##.exr", "--frames", "0-2", "-j", "1"});
  shop.succeed({"render", "scene.toml", "-o", "two/f_##.exr", "--frames", "0-2", "-j", "2"});
  for (const char* file : {"f_00.exr", "f_01.exr", "f_02.exr", "f_01.png", "f_sheet.png"})
    EXPECT_EQ(text_of(shop / "one" / file), text_of(shop / "two" / file)) << file;

  // A scene that says which frame it shows gives the same picture; so does a run that begins there.
  shop.write("second.toml", "frame = 2\n" + text_of(shop / "scene.toml"));
  shop.succeed({"render", "second.toml", "-o", "single.exr"});
  EXPECT_EQ(green_of(shop / "single.exr"), green_of(shop / "one/f_02.exr"));
  shop.succeed({"render", "scene.toml", "-o", "late.exr", "--frames", "2"});
  EXPECT_EQ(text_of(shop / "late_0002.exr"), text_of(shop / "one/f_02.exr"));
  EXPECT_EQ(Json::parse(text_of(shop / "late_0002.json")).at("heddle.frame"), "2");

  // What rests does not flicker: under one seed not a bit of the left square changes.
  const std::vector<float> before = green_of(shop / "one/f_01.exr");
  const std::vector<float> after = green_of(shop / "one/f_02.exr");
  float left = 0;
  int changed = 0;
  for (std::size_t k = 0; k < before.size(); ++k) {
    if (k % 24 < 11) {
      EXPECT_EQ(before[k], after[k]) << k;
      left += before[k];
    } else {
      changed += before[k] != after[k] ? 1 : 0;
    }
  }
  EXPECT_GT(left, 1);
  EXPECT_GT(changed, 50);
}

TEST(SequenceEndToEnd, ResumeKeepsWhatWouldComeOutTheSame) {
  const SequenceShop shop;
  const std::vector<std::string> frames = {"render",   "scene.toml", "-o",      "f_##.exr",
                                           "--frames", "0-2",        "--resume"};
  shop.succeed(frames);
  const auto written = [&](int frame) {
    return fs::last_write_time(shop / ("f_0" + std::to_string(frame) + ".exr"));
  };
  const std::string first = text_of(shop / "f_00.exr");
  const auto before = std::vector{written(0), written(1), written(2)};
  fs::remove(shop / "f_01.exr");
  shop.write("f_02.json", "{ \"heddle.key\": 7 }");
  shop.write("cloth_00.obj", two_squares(9));
  const ProgramResult again = shop.run(frames);
  EXPECT_NE(again.error.find("0 of 3 frames were finished before"), std::string::npos)
      << again.error;
  EXPECT_NE(text_of(shop / "f_00.exr"), first) << "its mesh has changed";
  EXPECT_TRUE(fs::exists(shop / "f_01.exr"));
  EXPECT_GT(written(2), before[2]) << "its report was broken";
  const auto then = std::vector{written(0), written(1), written(2)};
  EXPECT_NE(shop.run(frames).error.find("3 of 3 frames were finished before"), std::string::npos);
  EXPECT_EQ((std::vector{written(0), written(1), written(2)}), then);
}

TEST(SequenceEndToEnd, ASignalKeepsFinishedFrames) {
  const SequenceShop shop;
  const std::vector<std::string> frames = {"render",   "scene.toml", "-o",    "f_##.exr",
                                           "--frames", "0-2",        "--spp", "1500"};
  shop.succeed({"render", "scene.toml", "-o", "f_##.exr", "--frames", "0", "--spp", "1500"});
  fs::remove(shop / "f_00.json");
  Program program = shop.start(frames);
  ASSERT_TRUE(program.signal_when([&] { return fs::exists(shop / "f_00.json"); }, SIGINT));
  const ProgramResult result = program.wait();
  EXPECT_EQ(result.status, 130);
  EXPECT_NE(result.error.find("finished frames are kept"), std::string::npos) << result.error;
  EXPECT_FALSE(fs::exists(shop / "f_02.exr"));
  std::vector<std::string> on = frames;
  on.emplace_back("--resume");
  const ProgramResult rest = shop.run(on);
  EXPECT_EQ(rest.status, 0) << rest.error;
  EXPECT_EQ(rest.error.find("0 of 3 frames"), std::string::npos) << rest.error;
  EXPECT_TRUE(fs::exists(shop / "f_02.exr"));
}

TEST(SequenceEndToEnd, ATurntableComesFullCircle) {
  const SequenceShop shop;
  shop.write("turn.toml",
             edited(kSmallScene, "fov_deg = 25", "fov_deg = 25\nturntable_deg_per_frame = 90"));
  shop.succeed({"render", "turn.toml", "-o", "t_#.exr", "--frames", "0-4"});
  EXPECT_EQ(green_of(shop / "t_0.exr").size(), 24U * 24U);
  EXPECT_NE(green_of(shop / "t_0.exr"), green_of(shop / "t_1.exr"));
  const std::string camera = "heddle.worldToCamera";
  const std::string turned = Json::parse(text_of(shop / "t_1.json")).at(camera);
  EXPECT_NE(turned, Json::parse(text_of(shop / "t_0.json")).at(camera));
  const std::vector<float> start = green_of(shop / "t_0.exr");
  const std::vector<float> end = green_of(shop / "t_4.exr");
  int equal = 0;
  for (std::size_t k = 0; k < start.size(); ++k) equal += start[k] == end[k] ? 1 : 0;
  EXPECT_GT(equal, 550) << "but for rounding, frame 4 is frame 0";
}

TEST(SequenceEndToEnd, WrongFramesAreNamedBeforeAnyWork) {
  const SequenceShop shop;
  const auto error = [&](const std::vector<std::string>& arguments) {
    const ProgramResult result = shop.run(arguments);
    EXPECT_EQ(result.status, 2) << result.error;
    return result.error;
  };
  const std::string missing = error({"render", "scene.toml", "-o", "f_##.exr", "--frames", "1-3"});
  EXPECT_NE(missing.find("scene.toml:27:"), std::string::npos) << missing;
  EXPECT_NE(missing.find("cloth_03.obj', which is frame 3"), std::string::npos) << missing;
  EXPECT_FALSE(fs::exists(shop / "f_01.exr"));
  shop.write("far.toml", "frame = 8\n" + text_of(shop / "scene.toml"));
  EXPECT_NE(error({"render", "far.toml", "-o", "x.exr"}).find("which is frame 8"),
            std::string::npos);
  EXPECT_NE(error({"render", "scene.toml", "-o", "x.exr", "--frames", "2-1"}).find("--frames"),
            std::string::npos);
  EXPECT_NE(error({"render", "scene.toml", "-o", "x.exr", "--resume"}).find("--resume"),
            std::string::npos);
  EXPECT_NE(error({"render", "scene.toml", "-o", "x.exr", "--frames", "0-1", "--tolerance", "0.1"})
                .find("--tolerance"),
            std::string::npos);
}

// ---- Things beside cloth.

TEST(ThingsEndToEnd, EverythingInOneSceneInEveryMethod) {
  const EverythingShop shop;
  for (const char* method : {"exact", "volume", "path", "prt", "dual-scattering"}) {
    const std::string file = std::string(method) + ".exr";
    shop.succeed({"render", "everything.toml", "-o", file, "--method", method, "-j", "2"});
    const std::vector<float> green = green_of(shop / file);
    int lit = 0;
    for (const float value : green) lit += value > 0 ? 1 : 0;
    EXPECT_GT(lit, 350) << method;
    if (std::strlen(method) > 5) continue;
    const std::string again = std::string(method) + "-1.exr";
    shop.succeed({"render", "everything.toml", "-o", again, "--method", method, "-j", "1"});
    EXPECT_EQ(text_of(shop / file), text_of(shop / again)) << method;
  }
}

TEST(ThingsEndToEnd, PlansRefuseColouredMeshesByTheirPlace) {
  const EverythingShop shop;
  shop.write("solid.toml", std::string(kSmallScene) +
                               "[[mesh]]\nmesh = \"square.obj\"\nmesh_unit = \"mm\"\n"
                               "color = \"#ff0000\"\n");
  const ProgramResult result = shop.run({"plan", "solid.toml", "--tolerance", "0.1"});
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.error.find(
                "solid.toml:36:1: 'color': a plan knows no light between cloth and coloured"),
            std::string::npos)
      << result.error;
}

}  // namespace
}  // namespace heddle
