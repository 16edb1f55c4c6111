#include "pipeline/json_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/json_text.h"

namespace heddle {

nlohmann::json read_json(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_whole_file(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (is_nested_too_deeply(text)) {
    throw FileError(fmt::format("{}: JSON nested deeper than {}", path.string(), kMaxJsonDepth));
  }
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    throw FileError(fmt::format("{}: not JSON: {}", path.string(), error.what()));
  }
}

}  // namespace heddle
