// What the machine cannot hold and what cannot be written is refused before the work, with numbers
// and names.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/pipeline/program.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

class LimitsEndToEnd : public testing::Test {
 protected:
  LimitsEndToEnd() {
    write("fabric.toml", kSmallFabric);
    write("scene.toml", kSmallScene);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
  }
  /// With at most 4 GB of address space, as by `ulimit -v`.
  ProgramResult run(const std::vector<std::string>& arguments) const {
    return Program(
               folder_.path(), arguments, "",
               [&] {
                 const rlimit limit = {std::uint64_t{4} << 30, std::uint64_t{4} << 30};
                 if (::chdir(folder_.path().c_str()) != 0 || ::setrlimit(RLIMIT_AS, &limit) != 0)
                   ::_exit(125);
                 ::setenv("HEDDLE_CACHE", "cache", 1);
               })
        .wait();
  }
  bool built_anything() const { return fs::exists(folder_.path() / "cache"); }

  TemporaryFolder folder_;
};

TEST_F(LimitsEndToEnd, APictureThatDoesNotFitIsRefusedWithNumbersAndTheOldOneStays) {
  write("large.toml", edited(kSmallScene, "[24, 24]", "[16384, 16384]"));
  write("picture.exr", "an old picture");
  const ProgramResult result = run({"render", "large.toml", "-o", "picture.exr"});
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.error.find("render: 16384 x 16384 pixels: needs 6"), std::string::npos)
      << result.error;
  EXPECT_NE(result.error.find("GB of memory"), std::string::npos) << result.error;
  EXPECT_NE(result.error.find("are available"), std::string::npos) << result.error;
  EXPECT_EQ(text_of(folder_.path() / "picture.exr"), "an old picture");
  EXPECT_FALSE(built_anything());
}

TEST_F(LimitsEndToEnd, FibersThatDoNotFitAreRefusedWithNumbers) {
  const std::string many = edited(edited(kSmallFabric, "repeats_x = 1", "repeats_x = 64"),
                                  "repeats_y = 1", "repeats_y = 64");
  write("many.toml", edited(many, "fibers_per_ply = 24", "fibers_per_ply = 2000"));
  const ProgramResult result = run({"synth", "many.toml"});
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.error.find("segments: needs "), std::string::npos) << result.error;
  EXPECT_NE(result.error.find("are available"), std::string::npos) << result.error;
}

TEST_F(LimitsEndToEnd, WhatCannotBeWrittenIsRefusedBeforeTheWork) {
  fs::create_directories(folder_.path() / "taken.exr" / "inside");
  fs::create_directories(folder_.path() / "notes");
  write("notes/notes.txt", "to keep");
  write("file", "no folder");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"render", "scene.toml", "-o", "taken.exr"}, "taken.exr: cannot write: Is a directory"},
      {{"render", "scene.toml", "-o", "file/picture.exr"}, "file: cannot create the folder"},
      {{"run", "scene.toml", "-o", "file/pictures"}, "file/pictures: cannot create the folder"},
      {{"chart", "scene.toml", "-o", "file/chart"}, "cannot create the folder"},
      {{"precompute", "fabric.toml", "-o", "file"}, "file: exists and is not a folder"},
      {{"precompute", "fabric.toml", "-o", "notes"}, "notes/notes.txt: is no part of a pack"},
  };
  for (const auto& [arguments, message] : cases) {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.status, 1) << arguments[0] << " " << arguments.back() << ": " << result.error;
    EXPECT_NE(result.error.find(message), std::string::npos) << result.error;
    EXPECT_FALSE(built_anything()) << arguments[0] << " " << arguments.back();
  }
  EXPECT_EQ(text_of(folder_.path() / "notes" / "notes.txt"), "to keep");
}

}  // namespace
}  // namespace heddle
