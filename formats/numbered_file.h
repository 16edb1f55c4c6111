#ifndef HEDDLE_FORMATS_NUMBERED_FILE_H_
#define HEDDLE_FORMATS_NUMBERED_FILE_H_
// Names of files of which there is one per frame: "drape_####.obj" is drape_0007.obj in frame 7.
// Tested in tests/formats/numbered_file_test.cpp.

#include <filesystem>
#include <string_view>

namespace heddle {

/// Largest number of a frame.
inline constexpr int kMostFrames = 999'999;

/// Does the file's own name hold a '#'?
bool is_numbered(const std::filesystem::path& path);

/// The last run of '#' in the file's name replaced by `text`.
std::filesystem::path with_number_as(const std::filesystem::path& path, std::string_view text);

/// The same, replaced by the frame's number, with zeros before it up to the run's length.
std::filesystem::path numbered_path(const std::filesystem::path& path, int frame);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_NUMBERED_FILE_H_
