#ifndef HEDDLE_FORMATS_CHUNK_FILE_H_
#define HEDDLE_FORMATS_CHUNK_FILE_H_
// Large files that are written piece by piece and read back in any order: a text that describes
// them, and numbered chunks of bytes, each with a checksum. Layout, integers little-endian:
//
//   8 bytes     mark of the kind of file
//   u64, text   length of the description, and that
//   bytes       the chunks, one behind the other
//   entries     of each chunk: u64 length, 32 characters XXH3-128
//   u64         number of chunks
//   32 bytes    XXH3-128 of mark, description, entries and number
//
// So every byte is covered by a checksum. Opening a file checks all but the chunks; reading a chunk
// checks that. Errors: FileError with the file and the reason. Tested in
// tests/formats/chunk_file_test.cpp.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/atomic_file.h"

namespace heddle {

class ChunkFileWriter {
 public:
  /// mark: 8 characters.
  ChunkFileWriter(const std::filesystem::path& path, std::string_view mark,
                  std::string_view description);

  void add(std::string_view chunk);
  std::uint64_t bytes() const { return file_.position(); }
  /// Writes what is left; only then does the file appear.
  void commit();

 private:
  void put(std::string_view text) { file_.write(std::as_bytes(std::span(text))); }

  AtomicFile file_;
  std::string sealed_;  // mark and description, then the entries
  std::size_t head_;    // characters of the former
  std::uint64_t count_ = 0;
};

class ChunkFile {
 public:
  /// `kind` names what has that mark: "G-buffer".
  ChunkFile(const std::filesystem::path& path, std::string_view mark, std::string_view kind);
  ~ChunkFile();
  ChunkFile(const ChunkFile&) = delete;
  ChunkFile& operator=(const ChunkFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::string& description() const { return description_; }
  std::uint64_t bytes() const { return bytes_; }
  std::size_t count() const { return chunks_.size(); }
  /// Safe from several threads.
  std::string chunk(std::size_t index) const;

 private:
  struct Chunk {
    std::uint64_t begin;
    std::uint64_t size;
    std::string hash;
  };
  [[noreturn]] void fail(const std::string& reason) const;
  std::string read(std::uint64_t begin, std::uint64_t size) const;
  void read_frame(std::string_view mark, std::string_view kind);

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
  std::string description_;
  std::vector<Chunk> chunks_;
};

}  // namespace heddle

#endif  // HEDDLE_FORMATS_CHUNK_FILE_H_
