#include "formats/content_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <cerrno>
#include <fstream>
#include <memory>
#include <system_error>
#include <vector>

#include "formats/input_error.h"

namespace heddle {

namespace {

std::string hexadecimal(XXH128_hash_t hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

struct FreeState {
  void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
};

}  // namespace

std::string content_hash(std::span<const std::byte> bytes) {
  return hexadecimal(XXH3_128bits(bytes.data(), bytes.size()));
}

std::string content_hash(std::string_view text) {
  return content_hash(std::as_bytes(std::span(text)));
}

std::string content_hash_of_file(const std::filesystem::path& path) {
  const auto fail = [&path](const char* what, int reason) {
    throw FileError(
        fmt::format("{}: {}: {}", path.string(), what, std::generic_category().message(reason)));
  };
  std::ifstream file(path, std::ios::binary);
  if (!file) fail("cannot open", errno);
  if (std::filesystem::is_directory(path)) fail("cannot open", EISDIR);
  const std::unique_ptr<XXH3_state_t, FreeState> state(XXH3_createState());
  if (state == nullptr) fail("cannot open", ENOMEM);
  XXH3_128bits_reset(state.get());
  std::vector<char> block(std::size_t{1} << 20);
  while (file) {
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    XXH3_128bits_update(state.get(), block.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (!file.eof()) fail("cannot read", errno);
  return hexadecimal(XXH3_128bits_digest(state.get()));
}

FileSeal seal_of_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw FileError(fmt::format("{}: cannot open: {}", path.string(), error.message()));
  return {size, content_hash_of_file(path)};
}

void verify_seal(const std::filesystem::path& path, const FileSeal& seal,
                 const std::string& source) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error)
    throw FileError(fmt::format("{}: named in {} but: {}", path.string(), source, error.message()));
  if (size != seal.bytes) {
    throw FileError(fmt::format("{}: {} bytes, {} says {}: truncated or replaced", path.string(),
                                size, source, seal.bytes));
  }
  const std::string found = content_hash_of_file(path);
  if (found != seal.xxh3_128) {
    throw FileError(fmt::format("{}: checksum {}, {} says {}: corrupt", path.string(), found,
                                source, seal.xxh3_128));
  }
}

}  // namespace heddle
