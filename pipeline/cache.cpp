#include "pipeline/cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <system_error>

#include "formats/content_hash.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

/// Makes renames inside `folder` durable.
void flush_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;  // a file system that cannot open folders has nothing to flush
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

void make_folder(const fs::path& folder) {
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", folder.string(), error.message()));
}

fs::path default_cache_folder() {
  const char* from_environment = std::getenv("HEDDLE_CACHE");
  if (from_environment != nullptr && *from_environment != '\0') return from_environment;
  return fs::path("out") / "cache";
}

std::string stage_key(const StageInputs& inputs) {
  // Lengths in front of the texts keep ("ab", "c") and ("a", "bc") apart.
  std::string text = fmt::format("{}:{} version {}\n", inputs.stage.size(), inputs.stage, inputs.version);
  for (const auto& [name, value] : inputs.values) {
    text += fmt::format("{}:{} {}:{}\n", name.size(), name, value.size(), value);
  }
  return content_hash(text);
}

fs::path Cache::artifact(std::string_view stage, const std::string& key, std::string_view extension) const {
  return folder_ / stage / (key + std::string(extension));
}

fs::path Cache::prepare(std::string_view stage, const std::string& key, std::string_view extension) const {
  make_folder(folder_ / stage);
  return artifact(stage, key, extension);
}

void Cache::publish_folder(std::string_view stage, const std::string& key,
                           const std::function<void(const fs::path&)>& fill) const {
  const fs::path target = prepare(stage, key, "");
  const fs::path temporary = target.string() + fmt::format(".tmp.{}", ::getpid());
  fs::remove_all(temporary);  // left by a killed process that had the same id
  make_folder(temporary);
  try {
    fill(temporary);
  } catch (...) {
    fs::remove_all(temporary);
    throw;
  }
  flush_folder(temporary);
  std::error_code error;
  fs::rename(temporary, target, error);
  if (error) {
    fs::remove_all(temporary);
    // Another process published the same key first: its bytes are ours.
    if (fs::exists(target)) return;
    throw FileError(fmt::format("{}: cannot rename into place: {}", target.string(), error.message()));
  }
  flush_folder(target.parent_path());
}

PartialChunks::PartialChunks(const Cache& cache, std::string_view stage, const std::string& key)
    : folder_(cache.artifact(stage, key, ".partial")) {}

fs::path PartialChunks::file(std::uint64_t first) const {
  return folder_ / fmt::format("{:010}.safetensors", first);
}

fs::path PartialChunks::prepare(std::uint64_t first) const {
  make_folder(folder_);
  return file(first);
}

void PartialChunks::remove() const {
  std::error_code ignored;  // a folder that stays behind costs space, nothing else
  fs::remove_all(folder_, ignored);
}

}  // namespace heddle
