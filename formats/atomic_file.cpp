#include "formats/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/fs.h>
#include <signal.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "formats/content_hash.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"

namespace heddle {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = ".heddle-";
constexpr std::string_view kSuffix = ".tmp";
constexpr int kMostLinks = 40;  // as the system's own limit
constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::chrono::hours kForeignLifetime{24};

[[noreturn]] void fail_at(const fs::path& path, const char* what, int reason) {
  throw FileError(
      fmt::format("{}: {}: {}", path.string(), what, std::generic_category().message(reason)));
}

/// Calls the system again where a signal cut it short.
template <class Call>
auto uninterrupted(Call&& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// Eight digits that differ between hosts and between containers that number their processes apart.
const std::string& machine() {
  static const std::string digits = [] {
    char host[256] = {};
    char processes[64] = {};
    ::gethostname(host, sizeof(host) - 1);
    if (::readlink("/proc/self/ns/pid", processes, sizeof(processes) - 1) < 0) processes[0] = '\0';
    return content_hash(fmt::format("{} {}", host, processes)).substr(0, 8);
  }();
  return digits;
}

/// This process's temporary names, and the folders in which it has looked for those of dead
/// processes.
struct Registry {
  std::mutex mutex;
  // temporaries are being removed: what is left of them must not be renamed into place
  bool ended = false;
  std::set<fs::path> names;
  std::set<fs::path> searched;
};
Registry& registry() {
  static auto* const only = new Registry;  // outlives every other object
  return *only;
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// The process in a temporary name of this machine; 0 for those of others; empty for other names.
std::optional<pid_t> process_of(std::string_view name) {
  if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix)) return {};
  name.remove_prefix(kPrefix.size());
  if (!name.starts_with(machine() + "-")) return 0;
  return static_cast<pid_t>(std::atol(std::string(name.substr(machine().size() + 1)).c_str()));
}

/// Did the process that made this file or folder end without removing it?
bool is_left_behind(const fs::path& path) {
  const std::optional<pid_t> process = process_of(path.filename().native());
  if (!process) return false;
  // an earlier process of the same number
  if (*process == ::getpid()) return !registry().names.contains(path);
  if (*process != 0) return ::kill(*process, 0) != 0 && errno == ESRCH;
  std::error_code error;
  const fs::file_time_type written = fs::last_write_time(path, error);
  return !error && fs::file_time_type::clock::now() - written > kForeignLifetime;
}

/// The registry's mutex is held by the caller.
void remove_left_behind(const fs::path& folder) {
  if (!registry().searched.insert(folder).second) return;
  std::error_code ignored;  // what cannot be listed or removed costs space, nothing else
  for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    std::error_code stays;
    if (is_left_behind(entry->path())) fs::remove_all(entry->path(), stays);
  }
}

/// Follows links to the file that they stand for, which need not exist.
fs::path resolved(fs::path target) {
  const fs::path named = target;
  for (int links = 0;; ++links) {
    std::error_code no_link;
    const fs::path next = fs::read_symlink(target, no_link);
    if (no_link) return target;
    if (links == kMostLinks) fail_at(named, "cannot write", ELOOP);
    target = target.parent_path() / next;  // an absolute link replaces all of it
  }
}

/// 0, or the system's reason.
int rename_unless_ended(const fs::path& from, const fs::path& to, unsigned flags = 0) {
  const std::lock_guard lock(registry().mutex);
  if (registry().ended) return EINTR;
  return ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0 ? 0 : errno;
}

/// Makes renames inside a folder durable, where its file system can.
void flush_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
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

 private:
  int number_;
};

}  // namespace

TemporaryPath::TemporaryPath(const fs::path& target) : target_(resolved(target)) {
  static std::atomic<unsigned> counter{0};
  const fs::path folder = folder_of(target_);
  path_ = target_.parent_path() /
          fmt::format("{}{}-{}-{}{}", kPrefix, machine(), ::getpid(), counter++, kSuffix);
  const std::lock_guard lock(registry().mutex);
  remove_left_behind(folder);
  registry().names.insert(path_);
}

TemporaryPath::~TemporaryPath() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(path_, ignored);
  const std::lock_guard lock(registry().mutex);
  registry().names.erase(path_);
}

void TemporaryPath::commit() {
  std::error_code error;
  const bool is_folder = fs::is_directory(path_, error);
  if (is_folder) flush_folder(path_);
  if (is_folder && fs::is_directory(target_, error)) {
    // The old folder takes the temporary name, under which it is removed.
    int reason = rename_unless_ended(path_, target_, RENAME_EXCHANGE);
    if (reason == EINVAL || reason == ENOSYS) {  // a file system that cannot exchange
      const TemporaryPath aside(target_);
      reason = rename_unless_ended(target_, aside.path_);
      if (reason == 0 && (reason = rename_unless_ended(path_, target_)) != 0)
        rename_unless_ended(aside.path_, target_);
    }
    if (reason != 0) fail_at(target_, "cannot replace", reason);
    fs::remove_all(path_, error);
  } else if (const int reason = rename_unless_ended(path_, target_); reason != 0) {
    fail_at(target_, "cannot replace", reason);
  }
  committed_ = true;
  flush_folder(folder_of(target_));
}

AtomicFile::AtomicFile(const fs::path& target) : temporary_(target) {
  descriptor_ = uninterrupted([&] {
    return ::open(temporary_.path().c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  });
  if (descriptor_ < 0) fail_at(temporary_.target(), "cannot create a file in this folder", errno);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void AtomicFile::fail(int reason) {
  failure_ = reason;
  check();
}

void AtomicFile::check() const {
  if (failure_ != 0) fail_at(temporary_.target(), "cannot write", failure_);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) write_buffer();
  if (bytes.size() > kBufferBytes) {
    write_now(bytes);
  } else {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  }
}

void AtomicFile::write_now(std::span<const std::byte> bytes) {
  for (std::span<const std::byte> rest = bytes; !rest.empty();) {
    const ssize_t count =
        uninterrupted([&] { return ::write(descriptor_, rest.data(), rest.size()); });
    if (count <= 0) fail(count < 0 ? errno : ENOSPC);
    rest = rest.subspan(static_cast<std::size_t>(count));
    position_ += static_cast<std::uint64_t>(count);
  }
  size_ = std::max(size_, position_);
}

void AtomicFile::write_buffer() {
  write_now(buffer_);
  buffer_.clear();
}

void AtomicFile::seek(std::uint64_t position) {
  write_buffer();
  assert(position <= size_);
  if (::lseek(descriptor_, static_cast<off_t>(position), SEEK_SET) < 0) fail(errno);
  position_ = position;
}

void AtomicFile::commit() {
  check();
  write_buffer();
  struct stat status {};
  if (uninterrupted([&] { return ::fsync(descriptor_); }) != 0 ||
      ::fstat(descriptor_, &status) != 0) {
    fail(errno);
  }
  if (static_cast<std::uint64_t>(status.st_size) != size_) fail(EIO);
  // Some file systems report a failed write here only. A signal does not keep the descriptor open.
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0 && errno != EINTR) fail(errno);
  temporary_.commit();
}

void require_writable(const fs::path& target) {
  if (fs::is_directory(target)) fail_at(target, "cannot write", EISDIR);
  const AtomicFile removed_at_once(target);
}

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

void remove_own_temporaries() noexcept {
  std::error_code ignored;
  const std::lock_guard lock(registry().mutex);
  registry().ended = true;
  for (const fs::path& name : registry().names) fs::remove_all(name, ignored);
}

std::vector<std::byte> read_whole_file(const fs::path& path) {
  const Descriptor file(uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC); }));
  struct stat status {};
  if (file.number() < 0 || ::fstat(file.number(), &status) != 0)
    fail_at(path, "cannot open", errno);
  if (S_ISDIR(status.st_mode)) fail_at(path, "cannot read", EISDIR);
  require_memory(static_cast<std::uint64_t>(status.st_size), path.string());
  // One byte more than the size, so that the end of the file shows without growing.
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size) + 1);
  std::size_t size = 0;
  while (true) {
    if (size == bytes.size()) {
      require_memory(2 * size, path.string());
      bytes.resize(2 * size);
    }
    const ssize_t count = uninterrupted(
        [&] { return ::read(file.number(), bytes.data() + size, bytes.size() - size); });
    if (count < 0) fail_at(path, "cannot read", errno);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace heddle
