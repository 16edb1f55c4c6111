#ifndef HEDDLE_PIPELINE_CACHE_H_
#define HEDDLE_PIPELINE_CACHE_H_
// The cache of stage artifacts: a folder CACHE/STAGE/ per stage, an artifact named by its key, which is a hash of all
// that went into it. An artifact that exists is complete (it was renamed into place) and never changes, so several
// processes may share a cache: two that build the same key write the same bytes, and the last rename wins.
//
//   CACHE/STAGE/KEY.safetensors (or .vdb, or a folder KEY/)    the artifact
//   CACHE/STAGE/KEY.cost.json                                  what it took to build it (stages.h, StageCost)
//   CACHE/STAGE/KEY.partial/FIRST.safetensors                  finished chunks of a long stage, kept until it is published
//
// Default folder: $HEDDLE_CACHE, else out/cache below the working directory.
// Errors: FileError with the system's reason. Tested in tests/pipeline/cache_test.cpp.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace heddle {

std::filesystem::path default_cache_folder();

/// Creates a folder and those above it; nothing to do for an empty path (the working directory).
void make_folder(const std::filesystem::path& folder);

/// What a stage's artifact depends on. Order matters; names keep neighbouring values apart.
struct StageInputs {
  std::string stage;
  int version = 0;                                          // of the stage's algorithm and file layout
  std::vector<std::pair<std::string, std::string>> values;  // (name, canonical text or upstream key)
};

/// 32 hexadecimal digits.
std::string stage_key(const StageInputs& inputs);

class Cache {
 public:
  explicit Cache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  /// extension with its dot; empty for an artifact that is a folder.
  std::filesystem::path artifact(std::string_view stage, const std::string& key, std::string_view extension) const;

  /// Creates the stage's folder, so that artifact() can be written (atomically, by the caller).
  std::filesystem::path prepare(std::string_view stage, const std::string& key, std::string_view extension) const;

  /// For artifacts that are folders: `fill` writes into a temporary folder, which is then renamed to artifact().
  void publish_folder(std::string_view stage, const std::string& key,
                      const std::function<void(const std::filesystem::path& temporary)>& fill) const;

 private:
  std::filesystem::path folder_;
};

/// The finished chunks of one long stage.
class PartialChunks {
 public:
  PartialChunks(const Cache& cache, std::string_view stage, const std::string& key);

  /// File of the chunk that starts at item `first`.
  std::filesystem::path file(std::uint64_t first) const;
  bool has(std::uint64_t first) const { return std::filesystem::exists(file(first)); }
  /// Creates the folder, so that file() can be written (atomically, by the caller).
  std::filesystem::path prepare(std::uint64_t first) const;
  /// Removes the folder; called once the artifact is published.
  void remove() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CACHE_H_
