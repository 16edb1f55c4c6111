#ifndef HEDDLE_PIPELINE_SEALED_JSON_H_
#define HEDDLE_PIPELINE_SEALED_JSON_H_
// JSON files that hold a checksum of themselves: the XXH3-128 of all other entries, under "seal".
// For files that the program writes for itself and must not misread: with a flipped bit in a number
// they are still JSON. Errors: FileError naming the file. Tested in
// tests/pipeline/artifact_record_test.cpp.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace heddle {

/// `document` is an object without an entry "seal". Written atomically.
void write_sealed_json(const std::filesystem::path& path, nlohmann::json document);

/// The object, without its seal, which holds.
nlohmann::json read_sealed_json(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_SEALED_JSON_H_
