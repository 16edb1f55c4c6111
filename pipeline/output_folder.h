#ifndef HEDDLE_PIPELINE_OUTPUT_FOLDER_H_
#define HEDDLE_PIPELINE_OUTPUT_FOLDER_H_
// Folders that a command writes and exchanges as a whole. Tested in
// tests/pipeline/end_to_end_test.cpp and tests/pipeline/export_test.cpp.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace heddle {

/// A last slash is no part of a folder's name.
std::filesystem::path without_slash(const std::filesystem::path& folder);

/// For commands that work long before they write. The folder may replace another one that holds
/// files of the same kind only, whole or cut short; it must not destroy anything else. Its parent
/// is made where it is missing. `kind`: "a pack". Errors: FileError.
void require_place_for_folder(const std::filesystem::path& folder, const std::string& kind,
                              const std::function<bool(std::string_view)>& is_of_kind);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_OUTPUT_FOLDER_H_
