#ifndef HEDDLE_FORMATS_FILE_ENDING_H_
#define HEDDLE_FORMATS_FILE_ENDING_H_
// The kind of a file by the end of its name. Tested in tests/formats/image_file_test.cpp.

#include <cctype>
#include <filesystem>
#include <string>

namespace heddle {

/// ".exr" of "dir/Cloth.EXR": the last ending of the name in lower case, with its dot; empty where
/// there is none.
inline std::string lower_case_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

}  // namespace heddle

#endif  // HEDDLE_FORMATS_FILE_ENDING_H_
