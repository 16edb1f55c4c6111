#include "formats/content_hash.h"

#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class ContentHashTest : public FileFixture {};

TEST_F(ContentHashTest, KnownAnswers) {
  // Published test values of XXH3-128 with seed 0.
  EXPECT_EQ(content_hash(""), "99aa06d3014798d86001c324468d497f");
  EXPECT_EQ(content_hash("abc"), "06b05ab6733a618578af5f94892f3950");
}

TEST_F(ContentHashTest, FileAndMemoryAgree) {
  // Longer than one block of the file reader, and not a multiple of it.
  std::string text((std::size_t{1} << 21) + 12345, 'x');
  for (std::size_t i = 0; i < text.size(); i += 97) text[i] = static_cast<char>(i);
  EXPECT_EQ(content_hash_of_file(put("long", text)), content_hash(text));
  EXPECT_EQ(content_hash_of_file(put("empty", "")), content_hash(""));
  text[1000000] ^= 1;
  EXPECT_NE(content_hash_of_file(put("other", text)), content_hash_of_file(folder_ / "long"));
}

TEST_F(ContentHashTest, UnreadableFilesAreErrors) {
  EXPECT_NE(error_of([&] { content_hash_of_file(folder_ / "absent"); }).find("absent: cannot open"),
            std::string::npos);
  EXPECT_NE(error_of([&] { content_hash_of_file(folder_); }), "no error");
  // As where another process has just swept the file away.
  EXPECT_NE(error_of([&] { seal_of_file(folder_ / "absent"); }).find("absent: cannot open"),
            std::string::npos);
}

}  // namespace
}  // namespace heddle
