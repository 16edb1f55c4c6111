#include "pipeline/cache.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "pipeline/artifact_record.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
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

TEST(Cache, ChunksStayUntilRemoved) {
  const TemporaryFolder temporary;
  const Cache cache(temporary.path());
  const PartialChunks chunks(cache, "transfer", "k");
  EXPECT_FALSE(chunks.has(0));
  EXPECT_FALSE(chunks.folder_exists());
  for (const std::uint64_t first : {0, 1024}) {
    publish_artifact(chunks.file(first), chunks.record(first), [](const fs::path& file) {
      write_file_atomically(file, "chunk");
      return BuildCost{};
    });
  }
  EXPECT_TRUE(chunks.has(0));
  EXPECT_TRUE(PartialChunks(cache, "transfer", "k").has(1024));
  EXPECT_FALSE(PartialChunks(cache, "transfer", "other").has(0));
  EXPECT_NO_THROW(chunks.verify(1024));
  write_file_atomically(chunks.file(1024), "chunk that was changed");
  EXPECT_THROW(chunks.verify(1024), FileError);
  EXPECT_THROW(chunks.verify(2048), FileError);
  chunks.remove();
  EXPECT_FALSE(chunks.has(0));
  EXPECT_TRUE(names_in(temporary.path() / "transfer").empty());
}

}  // namespace
}  // namespace heddle
