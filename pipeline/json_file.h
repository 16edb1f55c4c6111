#ifndef HEDDLE_PIPELINE_JSON_FILE_H_
#define HEDDLE_PIPELINE_JSON_FILE_H_
// Our own JSON files: reports, records, accuracy tables. Errors: FileError naming a file that is
// unreadable, no JSON, or nested deeper than kMaxJsonDepth. Tested in
// tests/pipeline/json_file_test.cpp.

#include <array>
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "fibers/math/vector.h"

namespace heddle {

nlohmann::json read_json(const std::filesystem::path& path);

/// A colour as JSON takes it.
inline std::array<double, 3> numbers_of(const Rgbd& color) {
  return {color[0], color[1], color[2]};
}

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_JSON_FILE_H_
