#ifndef HEDDLE_FORMATS_ATOMIC_FILE_H_
#define HEDDLE_FORMATS_ATOMIC_FILE_H_
// Whole-file writes that readers never see half done: temporary name in the same folder (O_EXCL, process id), write,
// fsync, rename, fsync of the folder. Errors: FileError with file name and the system's reason; the previous file stays.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace heddle {

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// For libraries that insist on writing a file by name: `write` gets a temporary path in the same folder (same
/// extension); on success it is flushed and renamed to `path`, on an exception it is removed.
void write_file_atomically(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path& temporary)>& write);

/// The whole file as bytes. Errors: FileError with the system's reason; MemoryError where the machine has no room for it.
std::vector<std::byte> read_whole_file(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_ATOMIC_FILE_H_
