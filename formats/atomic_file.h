#ifndef HEDDLE_FORMATS_ATOMIC_FILE_H_
#define HEDDLE_FORMATS_ATOMIC_FILE_H_
// Files and folders that readers never see half done. They are made under a temporary name in the
// same folder, flushed, checked for size and renamed. The old file or folder stays until then. It
// stays whole if anything fails.
//   - Temporary names are `.heddle-MACHINE-PROCESS-NUMBER.tmp`, however long the target's name is.
//     MACHINE is a hash of the host and the space of process numbers, so that machines and
//     containers can share a folder.
//   - The next process that writes to a folder removes what a killed process left there: at once if
//     that ran on this machine, after a day if it ran on another.
//   - A target that is a symbolic link keeps it. The file that the link points to is replaced.
//   - A folder that cannot be flushed after the rename is no failure: the file is in its place.
// Errors: FileError with the target's name and the system's reason. Tested in
// tests/formats/atomic_file_test.cpp.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace heddle {

/// A free name beside `target`, for a file or a folder. What lies there is removed with the object,
/// unless committed.
class TemporaryPath {
 public:
  explicit TemporaryPath(const std::filesystem::path& target);
  ~TemporaryPath();
  TemporaryPath(const TemporaryPath&) = delete;
  TemporaryPath& operator=(const TemporaryPath&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Links resolved.
  const std::filesystem::path& target() const { return target_; }

  /// Renames to target(), in place of the file or of the whole folder that lies there.
  void commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  bool committed_ = false;
};

/// A file under construction, for libraries that write piece by piece.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::span<const std::byte> bytes);
  /// Where the next byte goes; may lie before the end, never beyond it (assert).
  void seek(std::uint64_t position);
  std::uint64_t position() const { return position_ + buffer_.size(); }

  /// Throws again the error of an earlier write: some libraries swallow it.
  void check() const;
  /// Writes what is left, flushes, checks the size, renames.
  void commit();

 private:
  void fail(int reason);
  void write_now(std::span<const std::byte> bytes);
  void write_buffer();

  TemporaryPath temporary_;
  int descriptor_ = -1;
  std::uint64_t position_ = 0;  // of the buffer's first byte
  std::uint64_t size_ = 0;      // of what was written, without the buffer
  std::vector<std::byte> buffer_;
  int failure_ = 0;  // the system's reason
};

/// FileError if a file could not be put there now. For commands that work long before they write.
void require_writable(const std::filesystem::path& target);

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// Removes what lies under this process's temporary names. From then on nothing is committed any
/// more. For a process that ends without running destructors.
void remove_own_temporaries() noexcept;

/// The whole file as bytes. Errors: FileError with the system's reason; MemoryError if the machine
/// has no room for it.
std::vector<std::byte> read_whole_file(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_ATOMIC_FILE_H_
