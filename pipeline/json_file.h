#ifndef HEDDLE_PIPELINE_JSON_FILE_H_
#define HEDDLE_PIPELINE_JSON_FILE_H_
// Our own JSON files: reports, records, accuracy tables. Errors: FileError naming a file that is
// unreadable, no JSON, or nested deeper than kMaxJsonDepth. Tested in
// tests/pipeline/json_file_test.cpp.

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

namespace heddle {

nlohmann::json read_json(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_JSON_FILE_H_
