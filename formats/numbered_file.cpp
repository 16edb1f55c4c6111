#include "formats/numbered_file.h"

#include <fmt/format.h>

#include <cassert>
#include <string>

namespace heddle {
namespace {

/// The last run of '#': where it begins, and its length; 0 without any.
struct Run {
  std::size_t first = 0;
  std::size_t length = 0;
};

Run last_run(const std::string& name) {
  const std::size_t last = name.rfind('#');
  if (last == std::string::npos) return {};
  const std::size_t before = name.find_last_not_of('#', last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  return {first, last + 1 - first};
}

}  // namespace

bool is_numbered(const std::filesystem::path& path) {
  return last_run(path.filename().string()).length > 0;
}

std::filesystem::path with_number_as(const std::filesystem::path& path, std::string_view text) {
  std::string name = path.filename().string();
  const Run run = last_run(name);
  assert(run.length > 0);
  return path.parent_path() / name.replace(run.first, run.length, text);
}

std::filesystem::path numbered_path(const std::filesystem::path& path, int frame) {
  const std::size_t digits = last_run(path.filename().string()).length;
  return with_number_as(path, fmt::format("{:0{}d}", frame, digits));
}

}  // namespace heddle
