#include "pipeline/pack_check.h"

#include <fmt/format.h>

#include <cmath>

#include "formats/input_error.h"
#include "formats/tensor_file.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

// Values stored as halves: relative rounding 2^-11, summed over all lobes.
constexpr double kHalfRounding = 1e-3;

[[noreturn]] void fail(const FabricPack& pack, const char* file, int check,
                       const std::string& reason) {
  throw FileError(fmt::format("{}: check {}: {}", (pack.folder / file).string(), check, reason));
}

/// Lengths that were computed in float from the same numbers.
bool nearly_equal(double a, double b) {
  return std::abs(a - b) <= 1e-5 * (std::abs(a) + std::abs(b));
}

void check_origin(const fs::path& path) {
  const TensorFile file = TensorFile::read(path);
  for (const char* key : {"stage", "key", "config", "program_version"}) {
    if (file.metadata_value(key).empty())
      throw FileError(fmt::format("{}: check 5: no {}", path.string(), key));
  }
}

void check_ssdf(const FabricPack& pack) {
  constexpr char kFile[] = "ssdf.safetensors";
  for (const float distance : pack.ssdf->mean) {
    if (!(std::abs(distance) <= 3.1416F))
      fail(pack, kFile, 8, "the mean signed distance is outside [-pi, pi]");
  }
}

void check_sgs(const FabricPack& pack) {
  constexpr char kFile[] = "sg.safetensors";
  const SgVisibility& sgs = *pack.sgs;
  const std::size_t lobes = sgs.axes.size();
  for (std::size_t s = 0; s < sgs.sees_nothing.size(); ++s) {
    double sum = 0;
    for (std::size_t q = 0; q < lobes; ++q) sum += float_from_half(sgs.weights[s * lobes + q]);
    if (sum > 4 * kPi * (1 + kHalfRounding)) {
      fail(pack, kFile, 9,
           fmt::format("segment {} sees {:.4g} sr, more than the whole sphere", s, sum));
    }
  }
}

void check_transfer(const FabricPack& pack) {
  constexpr char kFile[] = "transfer.safetensors";
  const Transfer& transfer = *pack.transfer;
  if (transfer.both_sides != pack.light_from_both_sides) {
    fail(pack, kFile, 10, "light comes from another side than the manifest says");
  }
  for (const float error : transfer.standard_error) {
    if (!(error >= 0)) fail(pack, kFile, 10, "a standard error is negative");
  }
  std::vector<bool> has_segments(transfer.cell_count());
  for (const std::uint32_t cell : transfer.cell_of_segment) has_segments[cell] = true;
  for (std::uint32_t cell = 0; cell < transfer.cell_count(); ++cell) {
    if (!has_segments[cell]) fail(pack, kFile, 10, fmt::format("cell {} has no segments", cell));
    if (transfer.paths[cell] == 0) fail(pack, kFile, 10, fmt::format("cell {} has no paths", cell));
  }
}

void check_volume(const FabricPack& pack) {
  constexpr char kFile[] = "volume.vdb";
  const IdVolume& volume = *pack.volume;
  if (!nearly_equal(volume.size[0] * volume.voxel_mm[0], pack.exemplar.width_mm) ||
      !nearly_equal(volume.size[1] * volume.voxel_mm[1], pack.exemplar.height_mm)) {
    fail(pack, kFile, 11, "the volume does not cover the tile");
  }
}

}  // namespace

void check_pack_contents(const FabricPack& pack) {
  if (pack.ssdf) check_ssdf(pack);
  if (pack.sgs) check_sgs(pack);
  if (pack.transfer) check_transfer(pack);
  if (pack.volume) check_volume(pack);
}

void check_pack(const fs::path& folder) {
  const PackManifest manifest = read_verified_manifest(folder);
  for (const auto& [name, file] : manifest.files) {
    if (name.ends_with(".safetensors")) check_origin(folder / name);
  }
  check_pack_contents(load_pack(folder));
}

}  // namespace heddle
