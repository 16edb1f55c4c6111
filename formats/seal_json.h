#ifndef HEDDLE_FORMATS_SEAL_JSON_H_
#define HEDDLE_FORMATS_SEAL_JSON_H_
// How manifests, records and charts state the size and the checksum of a file.

#include <nlohmann/json.hpp>

#include "formats/content_hash.h"

namespace heddle {

inline nlohmann::json json_of(const FileSeal& seal) {
  return {{"bytes", seal.bytes}, {"xxh3_128", seal.xxh3_128}};
}

/// Throws nlohmann::json::exception where `json` is none.
inline FileSeal seal_of(const nlohmann::json& json) {
  return {json.at("bytes").get<std::uint64_t>(), json.at("xxh3_128").get<std::string>()};
}

}  // namespace heddle

#endif  // HEDDLE_FORMATS_SEAL_JSON_H_
