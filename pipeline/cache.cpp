#include "pipeline/cache.h"

#include <fmt/format.h>

#include <cstdlib>
#include <system_error>

#include "formats/content_hash.h"
#include "formats/input_error.h"
#include "pipeline/artifact_record.h"

namespace heddle {
namespace fs = std::filesystem;

void make_folder(const fs::path& folder) {
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw FileError(
        fmt::format("{}: cannot create the folder: {}", folder.string(), error.message()));
}

fs::path default_cache_folder() {
  const char* from_environment = std::getenv("HEDDLE_CACHE");
  if (from_environment != nullptr && *from_environment != '\0') return from_environment;
  return fs::path("out") / "cache";
}

std::string stage_key(const StageInputs& inputs) {
  // Lengths in front of the texts keep ("ab", "c") and ("a", "bc") apart.
  std::string text =
      fmt::format("{}:{} version {}\n", inputs.stage.size(), inputs.stage, inputs.version);
  for (const auto& [name, value] : inputs.values) {
    text += fmt::format("{}:{} {}:{}\n", name.size(), name, value.size(), value);
  }
  return content_hash(text);
}

fs::path Cache::artifact(std::string_view stage, const std::string& key,
                         std::string_view extension) const {
  return folder_ / stage / (key + std::string(extension));
}

fs::path Cache::record(std::string_view stage, const std::string& key) const {
  return artifact(stage, key, ".record.json");
}

PartialChunks::PartialChunks(const Cache& cache, std::string_view stage, const std::string& key)
    : folder_(cache.artifact(stage, key, ".partial")) {}

fs::path PartialChunks::file(std::uint64_t first) const {
  return folder_ / fmt::format("{:010}.safetensors", first);
}

fs::path PartialChunks::record(std::uint64_t first) const {
  return file(first).replace_extension(".record.json");
}

void PartialChunks::verify(std::uint64_t first) const {
  const ArtifactCheck check = check_artifact(file(first), record(first));
  if (check.state == ArtifactState::kAbsent) throw FileError(file(first).string() + ": vanished");
  if (check.state == ArtifactState::kBroken) throw FileError(check.problem);
}

void PartialChunks::remove() const {
  std::error_code ignored;  // a folder that stays behind costs space, nothing else
  fs::remove_all(folder_, ignored);
}

}  // namespace heddle
