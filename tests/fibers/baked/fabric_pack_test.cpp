#include "fibers/baked/fabric_pack.h"

#include <gtest/gtest.h>

#include <fstream>

#include "fibers/cloth/bundle_tangents.h"
#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

constexpr const char* kFiles[] = {"fibers.safetensors", "ssdf.safetensors", "sg.safetensors",
                                  "transfer.safetensors", "volume.vdb"};

/// A pack with all that one can hold; numbers that mean nothing, but fit together and differ.
class FabricPackFormat : public testing::Test {
 protected:
  FabricPackFormat() {
    write_exemplar(folder_.path() / "fibers.safetensors", crossed_layers(test_cotton()), {});
    write_visibility(crossed_layers(test_cotton()).segment_count());
    write_transfer_of(crossed_layers(test_cotton()).segment_count());
    write_volume(static_cast<std::int32_t>(crossed_layers(test_cotton()).segment_count()) - 1);
    manifest_.name = "crossed \"layers\"";
    manifest_.key = "00ff";
    manifest_.program_version = "1.2.3";
    manifest_.light_from_both_sides = true;
    manifest_.counts = {{"fibers", 8}};
    for (const char* name : kFiles) manifest_.files[name] = {};
  }
  void write_visibility(std::size_t segments) const {
    SsdfVisibility ssdf;
    ssdf.resolution = 4;
    ssdf.components = 1;
    for (int k = 0; k < 16; ++k) ssdf.mean.push_back(0.1F * static_cast<float>(k));
    ssdf.basis.assign(16, 0.5F);
    ssdf.coefficients.assign(segments, half_from_float(0.25F));
    ssdf.sees_nothing.assign(segments, 0);
    write_ssdf(folder_.path() / "ssdf.safetensors", ssdf, {});
    SgVisibility sgs;
    sgs.sharpness = 40;
    sgs.axes = {Vec3(0, 0, 1), Vec3(0.6F, 0, 0.8F)};
    sgs.weights.assign(2 * segments, half_from_float(0.5F));
    sgs.rotation.assign(segments, half_from_float(1));
    sgs.sees_nothing.assign(segments, 0);
    write_sg_visibility(folder_.path() / "sg.safetensors", sgs, {});
  }
  void write_transfer_of(std::size_t segments, bool with_cones = false) const {
    Transfer transfer;
    transfer.order = 1;
    transfer.both_sides = true;
    transfer.cell_of_segment.assign(segments, 1);
    for (int k = 0; k < 2 * 4 * 4 * 3; ++k)
      transfer.matrices.push_back(0.01F * static_cast<float>(k));
    transfer.standard_error.assign(2 * 2 * 3, 0.001F);
    transfer.paths = {1024, 2048};
    if (with_cones) {
      transfer.cones.emplace();
      transfer.cones->harmonics = transfer.matrices;
      transfer.cones->moments.assign(2 * ConeTransfer::kWidths * 4 * ConeTransfer::kAzimuths * 3,
                                     0.5F);
    }
    write_transfer(folder_.path() / "transfer.safetensors", transfer, {});
  }
  void write_volume(std::int32_t id) const {
    IdVolume volume;
    volume.size = {2, 1, 1};
    volume.voxel_mm = {0.1, 0.25, 0.1};
    volume.origin_mm = {0, 0, -0.05};
    volume.ids = {-1, id};
    write_id_volume(folder_.path() / "volume.vdb", volume, {});
  }
  std::vector<std::byte> bytes_of_file(const char* name) const {
    return read_whole_file(folder_.path() / name);
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
  const Exemplar exemplar = crossed_layers(test_cotton());
  EXPECT_EQ(pack.exemplar.points, exemplar.points);
  EXPECT_EQ(pack.materials.size(), 1U);
  ASSERT_TRUE(pack.ssdf && pack.sgs && pack.transfer && pack.volume);
  EXPECT_EQ(pack.ssdf->mean[7], 0.7F);
  EXPECT_EQ(float_from_half(pack.ssdf->coefficients.back()), 0.25F);
  EXPECT_EQ(pack.sgs->sharpness, 40);
  EXPECT_EQ(float_from_half(pack.sgs->weights.back()), 0.5F);
  EXPECT_EQ(pack.transfer->matrices[95], 0.95F);
  EXPECT_EQ(pack.transfer->paths[1], 2048U);
  EXPECT_TRUE(pack.transfer->both_sides);
  EXPECT_EQ(pack.volume->ids[1], static_cast<std::int32_t>(exemplar.segment_count()) - 1);
  EXPECT_TRUE(pack.bundle_tangent.empty()) << "needed with cones only";
}

// A pack holds what its manifest names: a file that lies there unnamed is not read.
TEST_F(FabricPackFormat, EachPartCanBeLeftOut) {
  for (const char* name : kFiles) {
    PackManifest without = manifest_;
    without.files.erase(name);
    write_manifest(folder_.path(), without);
    if (std::string(name) == "fibers.safetensors") {
      EXPECT_NE(refusal().find("names no fibers.safetensors"), std::string::npos) << refusal();
      continue;
    }
    const FabricPack pack = load_pack(folder_.path());
    EXPECT_EQ(pack.ssdf.has_value(), std::string(name) != "ssdf.safetensors");
    EXPECT_EQ(pack.sgs.has_value(), std::string(name) != "sg.safetensors");
    EXPECT_EQ(pack.transfer.has_value(), std::string(name) != "transfer.safetensors");
    EXPECT_EQ(pack.volume.has_value(), std::string(name) != "volume.vdb");
  }
}

TEST_F(FabricPackFormat, ConesComeWithTheTangentsOfTheirBundles) {
  const Exemplar exemplar = crossed_layers(test_cotton());
  write_transfer_of(exemplar.segment_count(), true);
  write_manifest(folder_.path(), manifest_);
  const FabricPack pack = load_pack(folder_.path());
  ASSERT_TRUE(pack.transfer->cones);
  EXPECT_EQ(pack.bundle_tangent, bundle_tangents(exemplar));
}

// Files that are sound, but not of the same cloth.
TEST_F(FabricPackFormat, FilesOfOtherFibersAreNamed) {
  const std::size_t segments = crossed_layers(test_cotton()).segment_count();
  const std::vector<std::byte> sound_ssdf = bytes_of_file("ssdf.safetensors");
  const auto expect_named = [&](const char* name) {
    write_manifest(folder_.path(), manifest_);
    const std::string said = refusal();
    EXPECT_NE(said.find(name), std::string::npos) << said;
    EXPECT_NE(said.find("segment"), std::string::npos) << said;
  };
  for (const std::size_t other : {segments - 1, segments + 1}) {
    write_visibility(other);
    expect_named("ssdf.safetensors");
    write_file_atomically(folder_.path() / "ssdf.safetensors", sound_ssdf);
    expect_named("sg.safetensors");
    write_visibility(segments);
    write_transfer_of(other);
    expect_named("transfer.safetensors");
    write_transfer_of(segments);
  }
  write_volume(static_cast<std::int32_t>(segments));
  expect_named("volume.vdb");
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
    hostile.files = {{"fibers.safetensors", {}}, {name, {}}};
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
  write_manifest(folder_.path(), manifest_);
  ASSERT_EQ(refusal(), "no error");
  for (const char* name : kFiles) {
    SCOPED_TRACE(name);
    const std::filesystem::path file = folder_.path() / name;
    const std::vector<std::byte> bytes = bytes_of_file(name);
    const auto expect_refused = [&](const char* reason) {
      const std::string said = refusal();
      EXPECT_NE(said.find(name), std::string::npos) << said;
      EXPECT_NE(said.find(reason), std::string::npos) << said;
    };
    write_file_atomically(file, std::span(bytes).first(bytes.size() - 1));
    expect_refused("truncated");
    for (const std::size_t place : {std::size_t{0}, bytes.size() / 2, bytes.size() - 1}) {
      std::vector<std::byte> flipped = bytes;
      flipped[place] ^= std::byte{1};
      write_file_atomically(file, flipped);
      expect_refused("checksum");
    }
    std::filesystem::remove(file);
    expect_refused("");
    write_file_atomically(file, bytes);
    EXPECT_EQ(refusal(), "no error");
  }
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
