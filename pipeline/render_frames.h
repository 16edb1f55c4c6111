#ifndef HEDDLE_PIPELINE_RENDER_FRAMES_H_
#define HEDDLE_PIPELINE_RENDER_FRAMES_H_
// The names and numbers of `render --frames`: docs/sequences.md. Errors: ConfigError. Tested in
// tests/pipeline/sequence_test.cpp.

#include <filesystem>
#include <string>

namespace heddle {

struct FrameRange {
  int first = 0;
  int last = 0;
};

/// "0-95", or "7" for one frame.
FrameRange parse_frames(const std::string& text);

/// The name of a sequence's pictures: as it is where it holds a '#', else with "_####" before its
/// ending.
std::filesystem::path numbered_output(const std::filesystem::path& output);

/// Does a finished picture of that key lie there: `exr`, and a .png and a .json beside it?
bool is_finished_frame(const std::filesystem::path& exr, const std::string& key);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_RENDER_FRAMES_H_
