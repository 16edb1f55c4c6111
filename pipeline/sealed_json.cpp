#include "pipeline/sealed_json.h"

#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/content_hash.h"
#include "formats/input_error.h"
#include "pipeline/json_file.h"

namespace heddle {
namespace {

constexpr char kSeal[] = "seal";

}  // namespace

void write_sealed_json(const std::filesystem::path& path, nlohmann::json document) {
  document[kSeal] = content_hash(document.dump());
  write_file_atomically(path, document.dump(1) + "\n");
}

nlohmann::json read_sealed_json(const std::filesystem::path& path) {
  nlohmann::json document = read_json(path);
  if (document.is_object() && document.contains(kSeal)) {
    const nlohmann::json seal = document.at(kSeal);
    document.erase(kSeal);
    if (seal ==
        content_hash(document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)))
      return document;
  }
  throw FileError(path.string() + ": corrupt (its own checksum differs)");
}

}  // namespace heddle
