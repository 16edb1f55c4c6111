#ifndef HEDDLE_TESTS_FORMATS_FILE_FIXTURE_H_
#define HEDDLE_TESTS_FORMATS_FILE_FIXTURE_H_
// An empty folder for each test, and short ways to fill it and to catch the readers' messages.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "formats/input_error.h"

namespace heddle {

class FileFixture : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("heddle_" + std::string(info->test_suite_name()) + "_" + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path put(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  static std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::size_t file_count() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), {}));
  }
  /// The FileError's text, or "no error".
  template <class Function>
  static std::string error_of(Function function) {
    try {
      function();
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  }

  std::filesystem::path folder_;
};

}  // namespace heddle

#endif  // HEDDLE_TESTS_FORMATS_FILE_FIXTURE_H_
