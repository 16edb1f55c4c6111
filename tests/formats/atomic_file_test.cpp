#include "formats/atomic_file.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <set>
#include <span>

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

TEST_F(AtomicFileTest, TheOldFileStaysUntilTheNewOneIsCommitted) {
  const auto path = put("a", "old");
  {
    AtomicFile file(path);
    file.write(std::as_bytes(std::span("new", 3)));
    EXPECT_EQ(bytes_of(path), "old");
    EXPECT_EQ(file_count(), 2u);
  }
  EXPECT_EQ(bytes_of(path), "old");  // abandoned
  EXPECT_EQ(file_count(), 1u);
  AtomicFile file(path);
  file.write(std::as_bytes(std::span("new", 3)));
  file.commit();
  EXPECT_EQ(bytes_of(path), "new");
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(AtomicFileTest, BytesCanBeWrittenOverEarlierOnes) {
  const auto path = folder_ / "a";
  AtomicFile file(path);
  file.write(std::as_bytes(std::span("0000 and the rest", 17)));
  EXPECT_EQ(file.position(), 17U);
  file.seek(1);
  file.write(std::as_bytes(std::span("12", 2)));
  EXPECT_EQ(file.position(), 3U);
  file.seek(17);
  file.write(std::as_bytes(std::span("!", 1)));
  file.commit();
  EXPECT_EQ(bytes_of(path), "0120 and the rest!");
}

TEST_F(AtomicFileTest, AFullDiskIsSeenAtTheLastByte) {
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  rlimit full = old;
  full.rlim_cur = 100;
  const auto ignored = signal(SIGXFSZ, SIG_IGN);  // a write past the limit then fails with EFBIG
  const auto path = put("a", "old");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const std::string fits = error_of([&] { write_file_atomically(path, std::string(100, 'x')); });
  const std::string last_byte =
      error_of([&] { write_file_atomically(path, std::string(101, 'y')); });
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
  signal(SIGXFSZ, ignored);
  EXPECT_EQ(fits, "no error");
  EXPECT_NE(last_byte.find("a: cannot write: File too large"), std::string::npos) << last_byte;
  EXPECT_EQ(bytes_of(path), std::string(100, 'x'));
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(AtomicFileTest, AFailureThatALibrarySwallowedIsThrownAtTheEnd) {
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  rlimit full = old;
  full.rlim_cur = 100;
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  const auto path = put("a", "old");
  AtomicFile file(path);
  file.write(std::as_bytes(std::span<const char>(std::string(200, 'x'))));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  EXPECT_NE(error_of([&] { file.seek(0); }), "no error");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
  signal(SIGXFSZ, ignored);
  EXPECT_NE(error_of([&] { file.commit(); }).find("cannot write"), std::string::npos);
  EXPECT_EQ(bytes_of(path), "old");
}

TEST_F(AtomicFileTest, NamesMayBeAsLongAsTheSystemAllows) {
  const auto path = folder_ / std::string(250, 'n');
  write_file_atomically(path, "text");
  EXPECT_EQ(bytes_of(path), "text");
}

TEST_F(AtomicFileTest, ALinkStaysAndItsFileIsReplaced) {
  std::filesystem::create_directories(folder_ / "elsewhere");
  put("elsewhere/file", "old");
  std::filesystem::create_symlink("elsewhere/file", folder_ / "relative");
  std::filesystem::create_symlink(folder_ / "relative", folder_ / "twice");
  write_file_atomically(folder_ / "twice", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "twice"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "relative"));
  EXPECT_EQ(bytes_of(folder_ / "elsewhere/file"), "new");
  std::filesystem::create_symlink("elsewhere/not yet", folder_ / "dangling");
  write_file_atomically(folder_ / "dangling", "made");
  EXPECT_EQ(bytes_of(folder_ / "elsewhere/not yet"), "made");
  std::filesystem::create_symlink("loop", folder_ / "loop");
  EXPECT_NE(error_of([&] { write_file_atomically(folder_ / "loop", "x"); }).find("symbolic links"),
            std::string::npos);
}

TEST_F(AtomicFileTest, AFolderReplacesAFolderAsAWhole) {
  const auto target = folder_ / "pack";
  for (const char* text : {"first", "second"}) {
    TemporaryPath temporary(target);
    std::filesystem::create_directories(temporary.path());
    write_file_atomically(temporary.path() / text, text);
    temporary.commit();
    EXPECT_EQ(bytes_of(target / text), text);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(target), {}), 1);
    EXPECT_EQ(file_count(), 1u);
  }
  {
    const TemporaryPath abandoned(target);
    std::filesystem::create_directories(abandoned.path() / "deep");
    EXPECT_EQ(file_count(), 2u);
  }
  EXPECT_EQ(file_count(), 1u);
  EXPECT_TRUE(std::filesystem::exists(target / "second"));
}

TEST_F(AtomicFileTest, WhatADeadProcessLeftGoesAndWhatOthersWriteStays) {
  // Names as another process of this machine would choose them.
  std::string prefix;
  {
    const TemporaryPath own(folder_ / "any");
    prefix = own.path().filename().string();
    prefix.resize(prefix.find('-', 9) + 1);
  }
  const pid_t dead = fork();
  if (dead == 0) _exit(0);
  ASSERT_EQ(waitpid(dead, nullptr, 0), dead);
  // A folder that this process has not searched yet.
  const auto folder = folder_ / "fresh";
  std::filesystem::create_directories(folder / (prefix + std::to_string(dead) + "-0.tmp") /
                                      "inside");
  const auto put_here = [&](const std::string& name) { put("fresh/" + name, "x"); };
  put_here(prefix + std::to_string(dead) + "-1.tmp");
  // of an earlier process with our number
  put_here(prefix + std::to_string(getpid()) + "-99999.tmp");
  put_here(prefix + std::to_string(getppid()) + "-0.tmp");  // alive
  put_here(".heddle-00000000-1-0.tmp");                     // of another machine, new
  put_here(".heddle-00000000-1-1.tmp");                     // of another machine, old
  put_here("picture.tmp");
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(25);
  std::filesystem::last_write_time(folder / ".heddle-00000000-1-1.tmp", old);

  write_file_atomically(folder / "a", "text");
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename());
  const std::set<std::string> expected = {"a", "picture.tmp", ".heddle-00000000-1-0.tmp",
                                          prefix + std::to_string(getppid()) + "-0.tmp"};
  EXPECT_EQ(names, expected);
}

TEST_F(AtomicFileTest, AProcessThatEndsAtOnceCanRemoveItsTemporaries) {
  const auto path = put("a", "old");
  const pid_t ending = fork();
  if (ending == 0) {
    AtomicFile file(path);
    const bool was_there = file_count() == 2;
    remove_own_temporaries();
    // What another thread is about to rename would be half a file or a folder half emptied.
    const std::string error = error_of([&] { file.commit(); });
    _exit(was_there && file_count() == 1 && error.find("cannot replace") != std::string::npos ? 0
                                                                                              : 1);
  }
  int status = 1;
  ASSERT_EQ(waitpid(ending, &status, 0), ending);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(file_count(), 1u);
  EXPECT_EQ(bytes_of(path), "old");
}

TEST_F(AtomicFileTest, SystemErrorsAreNamed) {
  EXPECT_NE(error_of([&] {
              write_file_atomically(folder_ / "no" / "a", "x");
            }).find("No such file or directory"),
            std::string::npos);
  // The target is a folder: the rename fails after the temporary file was written.
  std::filesystem::create_directories(folder_ / "taken" / "inside");
  EXPECT_NE(error_of([&] { write_file_atomically(folder_ / "taken", "x"); }).find("cannot replace"),
            std::string::npos);
  EXPECT_EQ(file_count(), 1u);
  EXPECT_NE(error_of([&] {
              read_whole_file(folder_ / "absent");
            }).find("absent: cannot open: No such file"),
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
    EXPECT_EQ(std::string(error.what()).find(path.string() + ": needs 4398.0 GB of memory, "), 0U)
        << error.what();
  }
}

TEST_F(AtomicFileTest, FilesWithoutASizeAreReadToTheirEnd) {
  EXPECT_GT(read_whole_file("/proc/self/maps").size(), 0u);
}

}  // namespace
}  // namespace heddle
