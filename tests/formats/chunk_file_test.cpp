#include "formats/chunk_file.h"

#include "tests/formats/file_fixture.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

class ChunkFileFormat : public FileFixture {
 protected:
  std::filesystem::path write(const std::vector<std::string>& chunks) const {
    const std::filesystem::path path = folder_ / "kept";
    ChunkFileWriter writer(path, "KINDMARK", "what it is");
    for (const std::string& chunk : chunks) writer.add(chunk);
    writer.commit();
    return path;
  }
};

TEST_F(ChunkFileFormat, ChunksComeBackInAnyOrder) {
  const std::vector<std::string> chunks = {"first", "", std::string(3000, 'x') + '\0'};
  const ChunkFile file(write(chunks), "KINDMARK", "kind");
  EXPECT_EQ(file.description(), "what it is");
  EXPECT_EQ(file.bytes(), std::filesystem::file_size(file.path()));
  ASSERT_EQ(file.count(), chunks.size());
  for (const std::size_t k : {2UL, 0UL, 1UL}) EXPECT_EQ(file.chunk(k), chunks[k]);
}

TEST_F(ChunkFileFormat, AFileAppearsOnlyWhenItIsWhole) {
  {
    ChunkFileWriter writer(folder_ / "kept", "KINDMARK", "");
    writer.add("chunk");
  }
  EXPECT_EQ(file_count(), 0U);
}

TEST_F(ChunkFileFormat, EveryDamageIsFound) {
  const std::string whole = FileFixture::bytes_of(write({"first", "second"}));
  int damaged = 0;
  for_each_mutation(whole, 1, "", [&](const std::string& bytes) {
    const std::filesystem::path path = put("damaged", bytes);
    const std::string error = error_of([&] {
      const ChunkFile file(path, "KINDMARK", "kind of file");
      for (std::size_t k = 0; k < file.count(); ++k) file.chunk(k);
    });
    EXPECT_NE(error.find("damaged: "), std::string::npos) << damaged << error;
    EXPECT_NE(error, "no error") << damaged;
    ++damaged;
  });
  EXPECT_EQ(damaged, static_cast<int>(2 * whole.size()));
}

TEST_F(ChunkFileFormat, AnotherKindOfFileIsNamed) {
  const auto path = put("other", std::string(200, 'o'));
  EXPECT_NE(error_of([&] { ChunkFile(path, "KINDMARK", "kind of file"); }).find("no kind of file"),
            std::string::npos);
}

}  // namespace
}  // namespace heddle
