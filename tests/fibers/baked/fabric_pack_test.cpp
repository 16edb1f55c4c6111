#include "fibers/baked/fabric_pack.h"

#include <gtest/gtest.h>

#include <fstream>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

/// A pack with fibers only.
class FabricPackFormat : public testing::Test {
 protected:
  FabricPackFormat() {
    write_exemplar(folder_.path() / "fibers.safetensors", crossed_layers(test_cotton()), {});
    manifest_.name = "crossed \"layers\"";
    manifest_.key = "00ff";
    manifest_.program_version = "1.2.3";
    manifest_.light_from_both_sides = true;
    manifest_.counts = {{"fibers", 8}};
    manifest_.files = {{"fibers.safetensors", {}}};
  }
  std::string refusal() const {
    try {
      load_pack(folder_.path());
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  }
  void replace_in_manifest(const std::string& from, const std::string& to) const {
    const auto bytes = read_whole_file(folder_.path() / kManifestName);
    std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file_atomically(folder_.path() / kManifestName, text.replace(at, from.size(), to));
  }
  TemporaryFolder folder_;
  PackManifest manifest_;
};

TEST_F(FabricPackFormat, ComesBackAsWritten) {
  write_manifest(folder_.path(), manifest_);
  const FabricPack pack = load_pack(folder_.path());
  EXPECT_EQ(pack.name, manifest_.name);
  EXPECT_EQ(pack.key, "00ff");
  EXPECT_TRUE(pack.light_from_both_sides);
  EXPECT_EQ(pack.exemplar.points, crossed_layers(test_cotton()).points);
  EXPECT_EQ(pack.materials.size(), 1U);
  EXPECT_FALSE(pack.ssdf || pack.sgs || pack.transfer || pack.volume);
}

TEST_F(FabricPackFormat, NamesOutsideThePackAreRefused) {
  // Files that exist, with sizes and checksums that are right: only the names tell.
  const std::filesystem::path folder = folder_.path() / "sub.pack";
  std::filesystem::create_directories(folder / "below");
  for (const char* name :
       {"../fibers.safetensors", "below/fibers.safetensors", "extra.safetensors"}) {
    std::filesystem::copy_file(folder_.path() / "fibers.safetensors", folder / "fibers.safetensors",
                               std::filesystem::copy_options::overwrite_existing);
    if (!std::filesystem::exists(folder / name))
      std::filesystem::copy_file(folder / "fibers.safetensors", folder / name);
    PackManifest hostile = manifest_;
    hostile.files[name] = {};
    write_manifest(folder, hostile);
    try {
      load_pack(folder);
      ADD_FAILURE() << name << " was opened";
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find("no part of a pack"), std::string::npos)
          << error.what();
    }
  }
}

TEST_F(FabricPackFormat, EveryChangeOfTheManifestIsSeen) {
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"crossed", "crosses"},
                                                        {"00ff", "00fe"},
                                                        {"1.2.3", "1.2.4"},
                                                        {"\"both\"", "\"face\""},
                                                        {"\"fibers\": 8", "\"fibers\": 9"}}) {
    write_manifest(folder_.path(), manifest_);
    replace_in_manifest(from, to);
    EXPECT_NE(refusal().find("manifest.json"), std::string::npos) << from;
  }
  write_manifest(folder_.path(), manifest_);
  replace_in_manifest("\"version\": 1", "\"version\": 2");
  EXPECT_NE(refusal().find("layout 2"), std::string::npos) << refusal();
}

TEST_F(FabricPackFormat, MissingTruncatedAndFlippedFilesAreNamed) {
  const std::filesystem::path file = folder_.path() / "fibers.safetensors";
  write_manifest(folder_.path(), manifest_);
  const std::vector<std::byte> bytes = read_whole_file(file);

  write_file_atomically(file, std::span(bytes).first(bytes.size() - 1));
  EXPECT_NE(refusal().find("fibers.safetensors"), std::string::npos);
  EXPECT_NE(refusal().find("truncated"), std::string::npos);
  for (const std::size_t place : {std::size_t{0}, bytes.size() / 2, bytes.size() - 1}) {
    std::vector<std::byte> flipped = bytes;
    flipped[place] ^= std::byte{1};
    write_file_atomically(file, flipped);
    EXPECT_NE(refusal().find("fibers.safetensors"), std::string::npos);
    EXPECT_NE(refusal().find("checksum"), std::string::npos);
  }
  std::filesystem::remove(file);
  EXPECT_NE(refusal().find("fibers.safetensors"), std::string::npos);
  std::filesystem::remove(folder_.path() / kManifestName);
  EXPECT_NE(refusal().find("manifest.json"), std::string::npos);
}

TEST_F(FabricPackFormat, DeeplyNestedManifestsAreRefusedByName) {
  for (const std::size_t depth : {65, 70'000, 250'000}) {
    const std::string text =
        "{\"format\": \"heddle pack\", \"version\": 1, \"x\": " + std::string(depth, '[') +
        std::string(depth, ']') + ", \"manifest_xxh3_128\": \"x\"}";
    write_file_atomically(folder_.path() / kManifestName, text);
    EXPECT_NE(refusal().find("manifest.json: not a pack manifest: JSON nested deeper than 64"),
              std::string::npos)
        << refusal();
  }
}

TEST_F(FabricPackFormat, ManifestsThatAreNone) {
  for (const char* text :
       {"", "{", "[]", "null", "{}", "{\"format\": 3}",
        "{\"format\": \"heddle pack\", \"version\": 1}",
        "{\"format\": \"heddle pack\", \"version\": 1, \"manifest_xxh3_128\": []}"}) {
    write_file_atomically(folder_.path() / kManifestName, std::string_view(text));
    EXPECT_NE(refusal().find("manifest"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace heddle
