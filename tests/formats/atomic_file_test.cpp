#include "formats/atomic_file.h"

#include <stdexcept>

#include "formats/memory_need.h"
#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class AtomicFileTest : public FileFixture {};

TEST_F(AtomicFileTest, WritesAndReplacesWholeFiles) {
  const auto path = folder_ / "a.txt";
  write_file_atomically(path, "first, and longer");
  EXPECT_EQ(bytes_of(path), "first, and longer");
  write_file_atomically(path, "second");
  EXPECT_EQ(bytes_of(path), "second");
  const std::vector<std::byte> bytes{std::byte{0}, std::byte{255}, std::byte{10}};
  write_file_atomically(path, bytes);
  EXPECT_EQ(read_whole_file(path), bytes);
  write_file_atomically(path, "");
  EXPECT_TRUE(read_whole_file(path).empty());
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(AtomicFileTest, FileNameWithoutFolderMeansTheCurrentOne) {
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder_);
  write_file_atomically("plain", "text");
  std::filesystem::current_path(before);
  EXPECT_EQ(bytes_of(folder_ / "plain"), "text");
}

TEST_F(AtomicFileTest, TheWriterSeesATemporaryNameWithTheSameExtension) {
  const auto path = put("a.exr", "old");
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    EXPECT_EQ(temporary.parent_path(), folder_);
    EXPECT_EQ(temporary.extension(), ".exr");
    EXPECT_NE(temporary, path);
    EXPECT_EQ(bytes_of(path), "old");
    std::ofstream(temporary) << "new";
    EXPECT_EQ(bytes_of(path), "old");
  });
  EXPECT_EQ(bytes_of(path), "new");
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(AtomicFileTest, AnExceptionLeavesTheOldFileAndNothingElse) {
  const auto path = put("a", "old");
  const auto write = [&] {
    write_file_atomically(path, [](const std::filesystem::path& temporary) {
      std::ofstream(temporary) << "half of the new";
      throw std::runtime_error("stop");
    });
  };
  EXPECT_THROW(write(), std::runtime_error);
  EXPECT_EQ(bytes_of(path), "old");
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(AtomicFileTest, SystemErrorsAreNamed) {
  EXPECT_NE(
      error_of([&] { write_file_atomically(folder_ / "no" / "a", "x"); }).find("No such file or directory"),
      std::string::npos);
  // The target is a folder: the rename fails after the temporary file was written.
  std::filesystem::create_directories(folder_ / "taken" / "inside");
  EXPECT_NE(error_of([&] { write_file_atomically(folder_ / "taken", "x"); }).find("cannot replace"),
            std::string::npos);
  EXPECT_EQ(file_count(), 1u);
  EXPECT_NE(error_of([&] { read_whole_file(folder_ / "absent"); }).find("absent: cannot open: No such file"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_whole_file(folder_); }).find("Is a directory"), std::string::npos);
}

TEST_F(AtomicFileTest, FilesThatTheMachineCannotHoldAreRefusedWithNumbers) {
  const auto path = put("sparse", "");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 42);
  try {
    read_whole_file(path);
    FAIL();
  } catch (const MemoryError& error) {
    EXPECT_EQ(std::string(error.what()).find(path.string() + ": needs 4398.0 GB of memory, "), 0U) << error.what();
  }
}

TEST_F(AtomicFileTest, FilesWithoutASizeAreReadToTheirEnd) {
  EXPECT_GT(read_whole_file("/proc/self/maps").size(), 0u);
}

}  // namespace
}  // namespace heddle
