#include "pipeline/render_frames.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "formats/input_error.h"
#include "formats/numbered_file.h"
#include "pipeline/json_file.h"

namespace heddle {

namespace fs = std::filesystem;

FrameRange parse_frames(const std::string& text) {
  FrameRange range;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, range.first);
  auto last = first;
  range.last = range.first;
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == '-')
    last = std::from_chars(first.ptr + 1, end, range.last);
  if (last.ec != std::errc() || last.ptr != end || range.first < 0 || range.last < range.first ||
      range.last > kMostFrames) {
    throw ConfigError("--frames: expected first-last with 0 <= first <= last <= " +
                      std::to_string(kMostFrames) + ", for example 0-95; got \"" + text + "\"");
  }
  return range;
}

fs::path numbered_output(const fs::path& output) {
  if (is_numbered(output)) return output;
  return output.parent_path() / (output.stem().string() + "_####" + output.extension().string());
}

bool is_finished_frame(const fs::path& exr, const std::string& key) {
  // The .json is written last.
  for (const char* extension : {".exr", ".png", ".json"}) {
    std::error_code ignored;
    if (!fs::is_regular_file(fs::path(exr).replace_extension(extension), ignored)) return false;
  }
  try {
    const auto report = read_json(fs::path(exr).replace_extension(".json"));
    return report.is_object() && report.value("heddle.key", "") == key;
  } catch (const std::exception&) {
    return false;  // not ours, or broken: rendered again
  }
}

}  // namespace heddle
