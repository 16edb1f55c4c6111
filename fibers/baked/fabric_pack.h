#ifndef HEDDLE_FIBERS_BAKED_FABRIC_PACK_H_
#define HEDDLE_FIBERS_BAKED_FABRIC_PACK_H_
// A pack is one folder with everything that a renderer needs of one fabric. Its manifest.json holds
// the size and the XXH3-128 of every other file, and a checksum of itself. fibers.safetensors is
// always there. ssdf.safetensors, sg.safetensors, transfer.safetensors, volume.vdb and
// far.safetensors are there if the pack was made with them.
//
// Before any file but the manifest is opened, these are checked in order. The first that fails is
// the message:
//   1. manifest.json is JSON in the layout of this version and its own checksum holds;
//   2. every file name is a plain name of a file this version knows;
//   3. every file exists and has the size stated;
//   4. every file has the checksum stated.
// Errors: FileError naming the file. Tested in tests/fibers/baked/fabric_pack_test.cpp.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fibers/baked/far_table.h"
#include "fibers/baked/segment_visibility.h"
#include "fibers/baked/transfer.h"
#include "fibers/cloth/exemplar.h"
#include "fibers/scattering/bcsdf_table.h"
#include "formats/content_hash.h"
#include "formats/id_volume_file.h"

namespace heddle {

inline constexpr char kManifestName[] = "manifest.json";

struct PackManifest {
  std::string name;             // of the fabric
  std::string key;              // of the pack stage
  std::string program_version;  // that wrote it
  bool light_from_both_sides = false;
  // "fibers", "segments", "cells"; for people and for `heddle check`
  std::map<std::string, std::uint64_t> counts;
  std::map<std::string, FileSeal> files;  // by file name, without the manifest
};

struct FabricPack {
  std::filesystem::path folder;
  std::string name;
  std::string key;
  Exemplar exemplar;
  bool light_from_both_sides = false;
  std::optional<SsdfVisibility> ssdf;
  std::optional<SgVisibility> sgs;
  std::optional<Transfer> transfer;
  std::vector<Vec3> bundle_tangent;  // [segment], where the transfer has cones
  std::optional<IdVolume> volume;
  std::optional<FarTable> far;
  std::vector<BcsdfTable> materials;  // [material]
};

/// Hashes the files named in `manifest.files` inside `folder` (their sizes and checksums are filled
/// in) and writes manifest.json, atomically, last.
void write_manifest(const std::filesystem::path& folder, PackManifest manifest);

/// Is this the name of a file that a pack may hold, the manifest included?
bool is_pack_file(std::string_view name);

/// Reads manifest.json and makes checks 1 to 4.
PackManifest read_verified_manifest(const std::filesystem::path& folder);

/// Verifies, then opens every file of the pack.
FabricPack load_pack(const std::filesystem::path& folder);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_FABRIC_PACK_H_
