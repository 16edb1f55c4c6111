#include "pipeline/artifact_record.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "pipeline/sealed_json.h"
#include "tests/pipeline/program.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

class ArtifactRecordTest : public testing::Test {
 protected:
  bool publish_file(const std::string& text) const {
    return publish_artifact(artifact_, record_, [&](const fs::path& temporary) {
      EXPECT_FALSE(fs::exists(temporary));
      write_file_atomically(temporary, text);
      return BuildCost{{1.5, 2.5}, 3};
    });
  }
  bool publish_folder(const std::string& text) const {
    return publish_artifact(artifact_, record_, [&](const fs::path& temporary) {
      fs::create_directories(temporary);
      write_file_atomically(temporary / "a", text);
      write_file_atomically(temporary / "b", "more");
      return BuildCost{};
    });
  }
  ArtifactState state() const { return check_artifact(artifact_, record_).state; }
  std::string problem() const { return check_artifact(artifact_, record_).problem; }
  std::set<std::string> names() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(artifact_.parent_path()))
      names.insert(entry.path().filename());
    return names;
  }
  static void overwrite(const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
  }

  TemporaryFolder folder_;
  fs::path artifact_ = folder_.path() / "stage" / "key.bin";
  fs::path record_ = folder_.path() / "stage" / "key.record.json";
};

TEST_F(ArtifactRecordTest, WhatWasPublishedIsSoundAndKnowsItsCost) {
  EXPECT_EQ(state(), ArtifactState::kAbsent);
  EXPECT_LT(recorded_build_cost(record_).time.seconds, 0);
  EXPECT_TRUE(publish_file("text"));
  EXPECT_EQ(state(), ArtifactState::kSound) << problem();
  EXPECT_EQ(text_of(artifact_), "text");
  EXPECT_EQ(recorded_build_cost(record_).time.seconds, 1.5);
  EXPECT_EQ(recorded_build_cost(record_).time.core_seconds, 2.5);
  EXPECT_EQ(recorded_build_cost(record_).threads, 3);
  EXPECT_EQ(names(), (std::set<std::string>{"key.bin", "key.record.json"}));
}

TEST_F(ArtifactRecordTest, EveryBitOfArtifactAndRecordCounts) {
  publish_file("some text");
  for (const fs::path& file : {artifact_, record_}) {
    const std::string bytes = text_of(file);
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      std::string flipped = bytes;
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
      overwrite(file, flipped);
      // White space between the entries of the record says nothing.
      const bool is_space =
          file == record_ && std::isspace(flipped[bit / 8]) && std::isspace(bytes[bit / 8]);
      if (is_space) continue;
      ASSERT_EQ(state(), ArtifactState::kBroken) << file << ", bit " << bit << "\n" << flipped;
      ASSERT_NE(problem().find(file.filename().string()), std::string::npos) << problem();
    }
    overwrite(file, bytes.substr(0, bytes.size() / 2));
    EXPECT_EQ(state(), ArtifactState::kBroken);
    overwrite(file, "");
    EXPECT_EQ(state(), ArtifactState::kBroken);
    overwrite(file, bytes);
    EXPECT_EQ(state(), ArtifactState::kSound);
  }
  fs::remove(record_);
  EXPECT_EQ(state(), ArtifactState::kBroken);
}

TEST_F(ArtifactRecordTest, EveryFileOfAFolderCounts) {
  publish_folder("text");
  EXPECT_EQ(state(), ArtifactState::kSound) << problem();
  overwrite(artifact_ / "b", "mope");
  EXPECT_EQ(state(), ArtifactState::kBroken);
  EXPECT_NE(problem().find("key.bin/b"), std::string::npos) << problem();
  fs::remove(artifact_ / "b");
  EXPECT_EQ(state(), ArtifactState::kBroken);
}

TEST_F(ArtifactRecordTest, BrokenArtifactsAreReplacedAndSoundOnesStay) {
  for (const bool as_folder : {false, true}) {
    const auto publish = [&](const std::string& text) {
      return as_folder ? publish_folder(text) : publish_file(text);
    };
    const fs::path file = as_folder ? artifact_ / "a" : artifact_;
    fs::remove_all(artifact_);
    publish("first");
    publish("second");  // another process that was late: the same bytes, were it real
    EXPECT_EQ(text_of(file), "first");
    overwrite(file, "fjrst");
    publish("third");
    EXPECT_EQ(text_of(file), "third");
    EXPECT_EQ(state(), ArtifactState::kSound) << problem();
    EXPECT_EQ(names().size(), 2U);
  }
  // A file where a folder belongs, and the other way round.
  fs::remove_all(artifact_);
  overwrite(artifact_, "file");
  publish_folder("folder");
  EXPECT_EQ(text_of(artifact_ / "a"), "folder");
  fs::remove_all(artifact_);
  publish_file("file");
  fs::remove(artifact_);
  fs::create_directories(artifact_ / "inside");
  publish_file("file again");
  EXPECT_EQ(text_of(artifact_), "file again");
}

TEST_F(ArtifactRecordTest, WhoBuildsNothingFindsWhatAnotherProcessPublished) {
  const auto nothing = [&] {
    return publish_artifact(artifact_, record_, [](const fs::path&) { return BuildCost{}; });
  };
  EXPECT_THROW(nothing(), FileError);
  publish_file("text");
  EXPECT_FALSE(nothing());
}

TEST_F(ArtifactRecordTest, AFailureLeavesNothing) {
  EXPECT_THROW(publish_artifact(artifact_, record_,
                                [&](const fs::path& temporary) -> BuildCost {
                                  write_file_atomically(temporary, "half");
                                  throw FileError("disk full");
                                }),
               FileError);
  EXPECT_TRUE(names().empty());
}

}  // namespace
}  // namespace heddle
