#include "formats/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

#include "formats/input_error.h"
#include "formats/memory_need.h"

namespace heddle {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const char* what, int reason) {
  throw FileError(fmt::format("{}: {}: {}", path.string(), what, std::generic_category().message(reason)));
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  /// Some file systems report a failed write here only.
  int close() {
    const int result = ::close(number_);
    number_ = -1;
    return result;
  }

 private:
  int number_;
};

/// A new, empty file beside `target` that goes away unless it is renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& target) : target_(target) {
    static std::atomic<unsigned> counter{0};
    // A file left by a killed process may carry the same name; others have a different number.
    for (int attempt = 0; attempt < 1000; ++attempt) {
      const std::string name = fmt::format(".{}.tmp-{}-{}{}", target.stem().string(), ::getpid(), counter++,
                                           target.extension().string());
      path_ = target.parent_path() / name;
      const Descriptor file(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
      if (file.number() >= 0) return;
      if (errno != EEXIST) fail(target, "cannot create a file in this folder", errno);
    }
    fail(target, "cannot create a file in this folder", EEXIST);
  }
  ~TemporaryFile() {
    if (!renamed_) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const fs::path& path() const { return path_; }

  void flush_and_rename() {
    Descriptor file(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.number() < 0) fail(target_, "cannot write", errno);
    if (::fsync(file.number()) != 0 || file.close() != 0) fail(target_, "cannot write", errno);
    if (::rename(path_.c_str(), target_.c_str()) != 0) fail(target_, "cannot replace", errno);
    renamed_ = true;
    const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
    const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    // Some network file systems cannot flush a folder (EINVAL); the rename itself has been done.
    if (directory.number() >= 0 && ::fsync(directory.number()) != 0 && errno != EINVAL) {
      fail(target_, "cannot flush the folder", errno);
    }
  }

 private:
  fs::path target_;
  fs::path path_;
  bool renamed_ = false;
};

}  // namespace

void write_file_atomically(const fs::path& path,
                           const std::function<void(const fs::path& temporary)>& write) {
  TemporaryFile temporary(path);
  write(temporary.path());
  temporary.flush_and_rename();
}

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  write_file_atomically(path, [&](const fs::path& temporary) {
    Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CLOEXEC));
    if (file.number() < 0) fail(path, "cannot write", errno);
    for (std::span<const std::byte> rest = bytes; !rest.empty();) {
      const ssize_t count = ::write(file.number(), rest.data(), rest.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) fail(path, "cannot write", count < 0 ? errno : ENOSPC);
      rest = rest.subspan(static_cast<std::size_t>(count));
    }
    if (file.close() != 0) fail(path, "cannot write", errno);
  });
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

std::vector<std::byte> read_whole_file(const fs::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (file.number() < 0 || ::fstat(file.number(), &status) != 0) fail(path, "cannot open", errno);
  if (S_ISDIR(status.st_mode)) fail(path, "cannot read", EISDIR);
  require_memory(static_cast<std::uint64_t>(status.st_size), path.string());
  // One byte more than the size, so that the end of the file shows without growing.
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size) + 1);
  std::size_t size = 0;
  while (true) {
    if (size == bytes.size()) {
      require_memory(2 * size, path.string());
      bytes.resize(2 * size);
    }
    const ssize_t count = ::read(file.number(), bytes.data() + size, bytes.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, "cannot read", errno);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace heddle
