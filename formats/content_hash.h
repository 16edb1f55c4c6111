#ifndef HEDDLE_FORMATS_CONTENT_HASH_H_
#define HEDDLE_FORMATS_CONTENT_HASH_H_
// XXH3-128 as 32 lower-case hexadecimal digits: cache keys and checksums (not a security measure).

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace heddle {

std::string content_hash(std::span<const std::byte> bytes);
std::string content_hash(std::string_view text);
/// Hash of a whole file, read in blocks. Errors: FileError.
std::string content_hash_of_file(const std::filesystem::path& path);

/// What a file must hold.
struct FileSeal {
  std::uint64_t bytes = 0;
  std::string xxh3_128;
};
/// Errors: FileError.
FileSeal seal_of_file(const std::filesystem::path& path);
/// Reads the whole file. Errors: FileError if it is absent or differs. `source` is the file that
/// states the seal.
void verify_seal(const std::filesystem::path& path, const FileSeal& seal,
                 const std::string& source);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_CONTENT_HASH_H_
