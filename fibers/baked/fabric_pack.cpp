#include "fibers/baked/fabric_pack.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "fibers/cloth/bundle_tangents.h"
#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/json_text.h"
#include "formats/seal_json.h"

namespace heddle {
namespace {

using Json = nlohmann::json;  // objects sorted by key: equal content, equal text

constexpr char kFormatName[] = "heddle pack";
constexpr int kFormatVersion = 1;
constexpr char kChecksumKey[] = "manifest_xxh3_128";
constexpr std::uintmax_t kMaxManifestBytes = 1 << 20;

constexpr std::array<std::string_view, 6> kKnownFiles = {
    "fibers.safetensors",   "ssdf.safetensors", "sg.safetensors",
    "transfer.safetensors", "volume.vdb",       "far.safetensors"};

bool is_known_file(std::string_view name) {
  return std::find(kKnownFiles.begin(), kKnownFiles.end(), name) != kKnownFiles.end();
}

/// Checksum of everything in the manifest but the checksum itself.
std::string manifest_checksum(Json document) {
  document.erase(kChecksumKey);
  return content_hash(document.dump());
}

Json to_json(const PackManifest& manifest) {
  Json files = Json::object();
  for (const auto& [name, seal] : manifest.files) files[name] = json_of(seal);
  Json document = {{"format", kFormatName},
                   {"version", kFormatVersion},
                   {"name", manifest.name},
                   {"key", manifest.key},
                   {"program_version", manifest.program_version},
                   {"light_from", manifest.light_from_both_sides ? "both" : "face"},
                   {"counts", manifest.counts},
                   {"files", files}};
  document[kChecksumKey] = manifest_checksum(document);
  return document;
}

PackManifest from_json(const Json& document, const std::string& path) {
  if (document.at("format") != kFormatName) throw FileError(path + ": not a pack manifest");
  if (document.at("version") != kFormatVersion) {
    throw FileError(
        fmt::format("{}: written in pack layout {}, this program reads layout {}; run `heddle "
                    "precompute` again",
                    path, document.at("version").dump(), kFormatVersion));
  }
  if (document.at(kChecksumKey) != manifest_checksum(document)) {
    throw FileError(path +
                    ": the manifest was changed after it was written (its own checksum differs)");
  }
  PackManifest manifest;
  manifest.name = document.at("name").get<std::string>();
  manifest.key = document.at("key").get<std::string>();
  manifest.program_version = document.at("program_version").get<std::string>();
  manifest.light_from_both_sides = document.at("light_from") == "both";
  manifest.counts = document.at("counts").get<std::map<std::string, std::uint64_t>>();
  for (const auto& [name, seal] : document.at("files").items())
    manifest.files[name] = seal_of(seal);
  return manifest;
}

PackManifest read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kManifestName;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw FileError(fmt::format("{}: {} (not a pack?)", path.string(), error.message()));
  if (size > kMaxManifestBytes) throw FileError(path.string() + ": too large for a pack manifest");
  const std::vector<std::byte> bytes = read_whole_file(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (is_nested_too_deeply(text)) {
    throw FileError(fmt::format("{}: not a pack manifest: JSON nested deeper than {}",
                                path.string(), kMaxJsonDepth));
  }
  try {
    return from_json(Json::parse(text), path.string());
  } catch (const Json::exception& broken) {
    throw FileError(fmt::format("{}: not a pack manifest: {}", path.string(), broken.what()));
  }
}

}  // namespace

void write_manifest(const std::filesystem::path& folder, PackManifest manifest) {
  for (auto& file : manifest.files) file.second = seal_of_file(folder / file.first);
  write_file_atomically(folder / kManifestName, to_json(manifest).dump(2) + "\n");
}

bool is_pack_file(std::string_view name) {
  return name == kManifestName || is_known_file(name);
}

PackManifest read_verified_manifest(const std::filesystem::path& folder) {
  PackManifest manifest = read_manifest(folder);
  for (const auto& [name, file] : manifest.files) {
    // A closed list of names also keeps paths such as "../x" out.
    if (!is_known_file(name)) {
      throw FileError(fmt::format("{}: names a file that is no part of a pack: {}",
                                  (folder / kManifestName).string(), Json(name).dump()));
    }
  }
  if (!manifest.files.contains("fibers.safetensors")) {
    throw FileError((folder / kManifestName).string() + ": names no fibers.safetensors");
  }
  for (const auto& [name, seal] : manifest.files) verify_seal(folder / name, seal, kManifestName);
  return manifest;
}

FabricPack load_pack(const std::filesystem::path& folder) {
  const PackManifest manifest = read_verified_manifest(folder);
  FabricPack pack;
  pack.folder = folder;
  pack.name = manifest.name;
  pack.key = manifest.key;
  pack.light_from_both_sides = manifest.light_from_both_sides;
  pack.exemplar = read_exemplar(folder / "fibers.safetensors");
  pack.materials = bcsdf_tables(pack.exemplar.scattering);

  const std::size_t segments = pack.exemplar.segment_count();
  const auto require_rows = [&](std::size_t rows, const std::string& name) {
    if (rows != segments) {
      throw FileError(fmt::format("{}: holds {} segments, the fibers have {}",
                                  (folder / name).string(), rows, segments));
    }
  };
  if (manifest.files.contains("ssdf.safetensors")) {
    pack.ssdf = read_ssdf(folder / "ssdf.safetensors");
    require_rows(pack.ssdf->sees_nothing.size(), "ssdf.safetensors");
  }
  if (manifest.files.contains("sg.safetensors")) {
    pack.sgs = read_sg_visibility(folder / "sg.safetensors");
    require_rows(pack.sgs->sees_nothing.size(), "sg.safetensors");
  }
  if (manifest.files.contains("transfer.safetensors")) {
    pack.transfer = read_transfer(folder / "transfer.safetensors");
    require_rows(pack.transfer->cell_of_segment.size(), "transfer.safetensors");
    if (pack.transfer->cones) pack.bundle_tangent = bundle_tangents(pack.exemplar);
  }
  if (manifest.files.contains("far.safetensors")) {
    pack.far = read_far_table(folder / "far.safetensors");
    if (pack.far->both_sides != pack.light_from_both_sides) {
      throw FileError((folder / "far.safetensors").string() +
                      ": its light comes from other sides than the pack's");
    }
  }
  if (manifest.files.contains("volume.vdb")) {
    pack.volume = read_id_volume(folder / "volume.vdb");
    for (const std::int32_t id : pack.volume->ids) {
      if (id < -1 || (id >= 0 && static_cast<std::size_t>(id) >= segments)) {
        throw FileError(fmt::format("{}: segment id {} of {} segments",
                                    (folder / "volume.vdb").string(), id, segments));
      }
    }
  }
  return pack;
}

}  // namespace heddle
