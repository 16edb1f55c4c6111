#include "formats/chunk_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <bit>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "formats/content_hash.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::uint64_t kMarkBytes = 8;
constexpr std::uint64_t kNumberBytes = sizeof(std::uint64_t);
constexpr std::uint64_t kHashBytes = 32;
constexpr std::uint64_t kEntryBytes = kNumberBytes + kHashBytes;

std::string text_of_number(std::uint64_t number) {
  std::string text(kNumberBytes, '\0');
  std::memcpy(text.data(), &number, kNumberBytes);
  return text;
}

std::uint64_t number_of_text(std::string_view text) {
  std::uint64_t number = 0;
  std::memcpy(&number, text.data(), kNumberBytes);
  return number;
}

}  // namespace

ChunkFileWriter::ChunkFileWriter(const std::filesystem::path& path, std::string_view mark,
                                 std::string_view description)
    : file_(path),
      sealed_(std::string(mark) + text_of_number(description.size()) + std::string(description)),
      head_(sealed_.size()) {
  assert(mark.size() == kMarkBytes);
  put(sealed_);
}

void ChunkFileWriter::add(std::string_view chunk) {
  put(chunk);
  sealed_ += text_of_number(chunk.size()) + content_hash(chunk);
  ++count_;
}

void ChunkFileWriter::commit() {
  sealed_ += text_of_number(count_);
  put(std::string_view(sealed_).substr(head_));
  put(content_hash(sealed_));
  file_.commit();
}

ChunkFile::ChunkFile(const std::filesystem::path& path, std::string_view mark,
                     std::string_view kind)
    : path_(path) {
  do {
    descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  } while (descriptor_ < 0 && errno == EINTR);
  if (descriptor_ < 0) fail(std::generic_category().message(errno));
  try {
    read_frame(mark, kind);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

ChunkFile::~ChunkFile() {
  ::close(descriptor_);
}

void ChunkFile::fail(const std::string& reason) const {
  throw FileError(fmt::format("{}: {}", path_.string(), reason));
}

void ChunkFile::read_frame(std::string_view mark, std::string_view kind) {
  const off_t end = ::lseek(descriptor_, 0, SEEK_END);
  if (end < 0) fail(std::generic_category().message(errno));
  bytes_ = static_cast<std::uint64_t>(end);
  constexpr std::uint64_t kHead = kMarkBytes + kNumberBytes;
  constexpr std::uint64_t kTail = kNumberBytes + kHashBytes;
  if (bytes_ < kHead + kTail || read(0, kMarkBytes) != mark) fail(fmt::format("no {}", kind));
  const std::string damaged = fmt::format("damaged or cut off: {} ends wrongly", kind);
  const std::uint64_t text = number_of_text(read(kMarkBytes, kNumberBytes));
  const std::uint64_t count = number_of_text(read(bytes_ - kTail, kNumberBytes));
  const std::uint64_t room = bytes_ - kHead - kTail;
  if (text > room || count > (room - text) / kEntryBytes) fail(damaged);
  const std::uint64_t entries = bytes_ - kTail - count * kEntryBytes;
  const std::string head = read(0, kHead + text);
  const std::string table = read(entries, count * kEntryBytes + kNumberBytes);
  if (content_hash(head + table) != read(bytes_ - kHashBytes, kHashBytes)) fail(damaged);
  description_ = head.substr(kHead);
  std::uint64_t begin = kHead + text;
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::string_view entry = std::string_view(table).substr(k * kEntryBytes, kEntryBytes);
    const std::uint64_t size = number_of_text(entry);
    if (size > entries - begin) fail(damaged);
    chunks_.push_back({begin, size, std::string(entry.substr(kNumberBytes))});
    begin += size;
  }
  if (begin != entries) fail(damaged);
}

std::string ChunkFile::read(std::uint64_t begin, std::uint64_t size) const {
  std::string bytes(size, '\0');
  for (std::uint64_t done = 0; done < size;) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, size - done, static_cast<off_t>(begin + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(std::generic_category().message(errno));
    if (got == 0) fail("cut off while it was read");
    done += static_cast<std::uint64_t>(got);
  }
  return bytes;
}

std::string ChunkFile::chunk(std::size_t index) const {
  const Chunk& chunk = chunks_.at(index);
  std::string bytes = read(chunk.begin, chunk.size);
  if (content_hash(bytes) != chunk.hash)
    fail(fmt::format("damaged: chunk {} of {} differs from its checksum", index + 1, count()));
  return bytes;
}

}  // namespace heddle
