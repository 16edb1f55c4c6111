// The corpora of the fuzz targets, and damaged copies of what they hold.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

class FuzzCorpusFormat : public testing::TestWithParam<fuzz::NamedTarget> {};

TEST_P(FuzzCorpusFormat, EveryFileAndDamagedCopiesEndInAResultOrAnError) {
  std::vector<fs::path> files;
  for (const auto& entry :
       fs::directory_iterator(fs::path(HEDDLE_SOURCE_DIR) / "tests/fuzz/corpus" / GetParam().name))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ASSERT_GE(files.size(), 3U);
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.filename().string());
    const std::string whole = bytes_of(file);
    GetParam().run(std::as_bytes(std::span(whole)));
    // A few hundred damaged copies of each.
    const std::size_t step = std::max<std::size_t>(1, whole.size() / 60);
    for_each_mutation(
        whole, step, std::string_view("\0\xff\n-9", 5),
        [](const std::string& damaged) { GetParam().run(std::as_bytes(std::span(damaged))); });
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzCorpusFormat, testing::ValuesIn(fuzz::kTargets),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace heddle
