#include "formats/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

TEST(Cryptomatte, HashesAsPublished) {
  // Vectors of MurmurHash3_x86_32 with seed 0, and ids of the specification's example manifest.
  EXPECT_EQ(murmur3(""), 0U);
  EXPECT_EQ(murmur3("hello"), 0x248bfa47U);
  EXPECT_EQ(murmur3("hello, world"), 0x149bbb7fU);
  EXPECT_EQ(murmur3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723U);
  EXPECT_EQ(cryptomatte_id("bunny"), 0x13851a76U);
  EXPECT_EQ(cryptomatte_id("default"), 0x42c9679fU);
}

TEST(Cryptomatte, IdsAreNormalFloats) {
  int mended = 0;
  for (int k = 0; k < 20000; ++k) {
    const std::string name = "yarn" + std::to_string(k);
    const std::uint32_t id = cryptomatte_id(name);
    ASSERT_TRUE(std::isnormal(std::bit_cast<float>(id))) << name;
    if (id != murmur3(name)) {
      ++mended;
      ASSERT_EQ(id ^ murmur3(name), 1U << 23U);
    }
  }
  EXPECT_GT(mended, 50);  // 2 of 256 exponents: 156 expected
  // The empty name hashes to 0, which stands for nothing.
  EXPECT_EQ(cryptomatte_id(""), 1U << 23U);
}

TEST(Cryptomatte, RanksByCoverage) {
  const Cryptomatte::Ranks ranks = ranked({{9, 2}, {3, 5}, {4, 2}, {5, 1}}, 20);
  EXPECT_EQ(ranks[0].id, 3U);
  EXPECT_EQ(ranks[0].coverage, 0.25F);
  EXPECT_EQ(ranks[1].id, 4U) << "of equal ones, the lower id";
  EXPECT_EQ(ranks[2].id, 9U);
  EXPECT_EQ(ranks[3].coverage, 0.05F);
  EXPECT_EQ(ranks[4].id, 0U);
  EXPECT_EQ(ranks[4].coverage, 0.0F);
  std::map<std::uint32_t, double> many;
  for (std::uint32_t id = 1; id <= 9; ++id) many[id] = id;
  EXPECT_EQ(ranked(many, 45).back().id, 4U) << "the largest six are kept";
}

TEST(CryptomatteFormat, LayersAndMetadataAsSpecified) {
  Cryptomatte matte{"CryptoYarn", std::vector<Cryptomatte::Ranks>(2), {}};
  matte.pixels[0] = ranked({{cryptomatte_id("a/warp1"), 3}, {cryptomatte_id("a/warp-2"), 1}}, 4);
  matte.manifest = {{"a/warp1", cryptomatte_id("a/warp1")},
                    {"a/warp-2", cryptomatte_id("a/warp-2")}};
  Image image;
  image.width = 2;
  image.height = 1;
  add_cryptomatte(matte, image);
  TemporaryFolder folder;
  write_exr(folder.path() / "a.exr", image);
  const Image read = read_exr(folder.path() / "a.exr");

  ASSERT_EQ(read.channels.size(), 12U);
  for (const char* name : {"CryptoYarn00.R", "CryptoYarn02.A"})
    EXPECT_EQ(read.channels.at(name).type, ChannelType::kFloat) << name;
  const auto bits = [&](const char* name, std::size_t pixel) {
    return std::bit_cast<std::uint32_t>(read.channels.at(name).values[pixel]);
  };
  EXPECT_EQ(bits("CryptoYarn00.R", 0), cryptomatte_id("a/warp1"));
  EXPECT_EQ(read.channels.at("CryptoYarn00.G").values[0], 0.75F);
  EXPECT_EQ(bits("CryptoYarn00.B", 0), cryptomatte_id("a/warp-2"));
  EXPECT_EQ(read.channels.at("CryptoYarn00.A").values[0], 0.25F);
  EXPECT_EQ(bits("CryptoYarn00.R", 1), 0U);
  const std::string key = "cryptomatte/" + [] {
    char text[9];
    std::snprintf(text, sizeof text, "%08x", murmur3("CryptoYarn"));
    return std::string(text, 7);
  }() + "/";
  EXPECT_EQ(read.metadata.at(key + "name"), "CryptoYarn");
  EXPECT_EQ(read.metadata.at(key + "hash"), "MurmurHash3_32");
  EXPECT_EQ(read.metadata.at(key + "conversion"), "uint32_to_float32");
  char expected[100];
  std::snprintf(expected, sizeof expected, R"({"a/warp-2":"%08x","a/warp1":"%08x"})",
                cryptomatte_id("a/warp-2"), cryptomatte_id("a/warp1"));
  EXPECT_EQ(read.metadata.at(key + "manifest"), expected);

  matte.manifest.reset();
  Image bare;
  add_cryptomatte(matte, bare);
  EXPECT_FALSE(bare.metadata.contains(key + "manifest"));
}

}  // namespace
}  // namespace heddle
