#include "pipeline/cache.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <thread>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  return names;
}

TEST(StageKey, ChangesWithEverythingThatGoesIn) {
  const StageInputs base{"synth", 1, {{"config", "a = 1"}, {"fibers", "00ff"}}};
  std::set<std::string> keys = {stage_key(base)};
  StageInputs changed = base;
  changed.stage = "pack";
  keys.insert(stage_key(changed));
  changed = base;
  changed.version = 2;
  keys.insert(stage_key(changed));
  changed = base;
  changed.values[0].second = "a = 2";
  keys.insert(stage_key(changed));
  changed = base;
  changed.values[1].second = "00fe";
  keys.insert(stage_key(changed));
  changed = base;
  changed.values.pop_back();
  keys.insert(stage_key(changed));
  // The same characters, cut elsewhere.
  keys.insert(stage_key({"synth", 1, {{"config", "a = 1\n6:fibers 4:00ff"}}}));
  keys.insert(stage_key({"synth", 1, {{"configa", " = 1"}, {"fibers", "00ff"}}}));
  EXPECT_EQ(keys.size(), 8U);
  EXPECT_EQ(stage_key(base), stage_key(base));
  EXPECT_EQ(stage_key(base).size(), 32U);
}

TEST(Cache, DefaultFolderFollowsTheEnvironment) {
  ::setenv("HEDDLE_CACHE", "/somewhere/else", 1);
  EXPECT_EQ(default_cache_folder(), "/somewhere/else");
  ::unsetenv("HEDDLE_CACHE");
  EXPECT_EQ(default_cache_folder(), "out/cache");
}

TEST(Cache, FolderArtifactsAppearWholeOrNotAtAll) {
  const TemporaryFolder temporary;
  const Cache cache(temporary.path());
  const fs::path target = cache.artifact("pack", "k", "");
  EXPECT_THROW(cache.publish_folder("pack", "k",
                                    [&](const fs::path& folder) {
                                      write_file_atomically(folder / "a", "1");
                                      EXPECT_FALSE(fs::exists(target));
                                      throw FileError("disk full");
                                    }),
               FileError);
  EXPECT_TRUE(names_in(temporary.path() / "pack").empty());

  cache.publish_folder("pack", "k", [](const fs::path& folder) { write_file_atomically(folder / "a", "1"); });
  EXPECT_EQ(names_in(temporary.path() / "pack"), std::vector<std::string>{"k"});
  EXPECT_EQ(names_in(target), std::vector<std::string>{"a"});

  // A second process that built the same key meanwhile: the first stays, nothing is left over.
  cache.publish_folder("pack", "k", [](const fs::path& folder) { write_file_atomically(folder / "a", "1"); });
  EXPECT_EQ(names_in(temporary.path() / "pack"), std::vector<std::string>{"k"});
}

TEST(Cache, ChunksStayUntilRemoved) {
  const TemporaryFolder temporary;
  const Cache cache(temporary.path());
  const PartialChunks chunks(cache, "transfer", "k");
  EXPECT_FALSE(chunks.has(0));
  write_file_atomically(chunks.prepare(0), "0");
  write_file_atomically(chunks.prepare(1024), "1");
  EXPECT_TRUE(chunks.has(0));
  EXPECT_TRUE(PartialChunks(cache, "transfer", "k").has(1024));
  EXPECT_FALSE(PartialChunks(cache, "transfer", "other").has(0));
  chunks.remove();
  EXPECT_FALSE(chunks.has(0));
  EXPECT_TRUE(names_in(temporary.path() / "transfer").empty());
}

TEST(Cache, UnwritableFolderIsNamed) {
  const TemporaryFolder temporary;
  write_file_atomically(temporary.path() / "file", "x");
  const Cache cache(temporary.path() / "file");
  try {
    cache.prepare("synth", "k", ".safetensors");
    FAIL() << "a file taken for a folder";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("file/synth"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace heddle
