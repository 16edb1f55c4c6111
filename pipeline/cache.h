#ifndef HEDDLE_PIPELINE_CACHE_H_
#define HEDDLE_PIPELINE_CACHE_H_
// The cache of stage artifacts. Each stage has a folder CACHE/STAGE/. An artifact is named by its
// key, a hash of everything that went into it. An artifact appears whole (it is renamed into place)
// and never changes. It is used only if it agrees with its record (artifact_record.h). Several
// processes may share a cache: those that build the same key write the same bytes.
//
//   CACHE/STAGE/KEY.safetensors      the artifact (or .vdb, .json, or a folder KEY/)
//   CACHE/STAGE/KEY.record.json      its checksum, and what it took to build it
//   CACHE/STAGE/KEY.partial/         finished chunks of a long stage, kept until it is published:
//                                    FIRST.safetensors, FIRST.record.json
//
// Default folder: $HEDDLE_CACHE, else out/cache below the working directory. Errors: FileError with
// the system's reason. Tested in tests/pipeline/cache_test.cpp.

#include <cstdint>
#include <filesystem>
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
  // of the stage's algorithm and file layout
  int version = 0;
  // (name, canonical text or upstream key)
  std::vector<std::pair<std::string, std::string>> values;
};

/// 32 hexadecimal digits.
std::string stage_key(const StageInputs& inputs);

class Cache {
 public:
  explicit Cache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  /// extension with its dot; empty for an artifact that is a folder.
  std::filesystem::path artifact(std::string_view stage, const std::string& key,
                                 std::string_view extension) const;

  std::filesystem::path record(std::string_view stage, const std::string& key) const;

 private:
  std::filesystem::path folder_;
};

/// The finished chunks of one long stage.
class PartialChunks {
 public:
  PartialChunks(const Cache& cache, std::string_view stage, const std::string& key);

  /// File of the chunk that starts at item `first`.
  std::filesystem::path file(std::uint64_t first) const;
  std::filesystem::path record(std::uint64_t first) const;
  bool has(std::uint64_t first) const { return std::filesystem::exists(file(first)); }
  /// FileError if the chunk is absent or differs from its record.
  void verify(std::uint64_t first) const;
  bool folder_exists() const { return std::filesystem::exists(folder_); }
  /// Removes the folder; called once the artifact is published.
  void remove() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CACHE_H_
