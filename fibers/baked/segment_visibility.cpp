#include "fibers/baked/segment_visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

#include "formats/input_error.h"

namespace heddle {
namespace {

constexpr std::size_t kMostComponents = 128;

// A half's exponent and mantissa, moved to a float's places, are the value times 2^-112, subnormals
// included. Written out because the compiler makes a vector loop of it. Finite values only.
void decode_halfs(const Half* halfs, std::size_t count, float* values) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t bits = halfs[i].bits;
    const float magnitude = std::bit_cast<float>((bits & 0x7fffU) << 13) * 0x1p112F;
    values[i] =
        std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) | (bits & 0x8000U) << 16);
  }
}

void check_flags(const TensorFile& file, const std::vector<std::uint8_t>& flags) {
  if (std::any_of(flags.begin(), flags.end(), [](std::uint8_t flag) { return flag > 1; })) {
    throw FileError(file.path().string() + ": sees_nothing holds values other than 0 and 1");
  }
}

/// The middle extents of a tensor's shape, checked to lie in a sane range.
std::uint64_t checked_extent(const TensorFile& file, const std::string& name, std::size_t rank,
                             std::size_t axis, std::uint64_t min, std::uint64_t max) {
  const std::vector<std::uint64_t>& shape = file.shape(name);
  if (shape.size() != rank || shape[axis] < min || shape[axis] > max) {
    throw FileError(fmt::format("{}: expected {} with {} axes, axis {} from {} to {} long",
                                file.path().string(), name, rank, axis, min, max));
  }
  return shape[axis];
}

}  // namespace

float SsdfVisibility::signed_distance(std::uint32_t segment, const Vec3& direction) const {
  assert(segment < sees_nothing.size());
  if (sees_nothing[segment] != 0) return -kPif;
  const int n = resolution;
  const auto k = static_cast<std::size_t>(components);

  // Cell centres around the direction; beyond a pole the row goes on half a turn away.
  const float polar = std::atan2(std::hypot(direction.x(), direction.y()), direction.z());
  float azimuth = std::atan2(direction.y(), direction.x());
  if (azimuth < 0) azimuth += 2 * kPif;
  const float row = polar * (static_cast<float>(n) / kPif) - 0.5F;
  const float column = azimuth * (static_cast<float>(n) / (2 * kPif)) - 0.5F;
  const float row_floor = std::floor(row);
  const float column_floor = std::floor(column);
  const float row_share = row - row_floor;
  const float column_share = column - column_floor;
  std::array<std::size_t, 4> cells;
  std::array<float, 4> shares;
  for (int i = 0; i < 4; ++i) {
    int r = static_cast<int>(row_floor) + i / 2;
    int c = static_cast<int>(column_floor) + i % 2;
    if (r < 0 || r >= n) {
      r = std::clamp(r, 0, n - 1);
      c += n / 2;
    }
    if (c < 0) c += n;
    if (c >= n) c -= n;
    cells[static_cast<std::size_t>(i)] =
        static_cast<std::size_t>(r) * static_cast<std::size_t>(n) + c;
    shares[static_cast<std::size_t>(i)] =
        (i / 2 != 0 ? row_share : 1 - row_share) * (i % 2 != 0 ? column_share : 1 - column_share);
  }

  std::array<float, kMostComponents> stored;
  decode_halfs(&coefficients[segment * k], k, stored.data());
  float mean_distance = 0;
  for (std::size_t i = 0; i < 4; ++i) mean_distance += shares[i] * mean[cells[i]];
  using Components = Eigen::Map<const Eigen::ArrayXf>;
  auto at = [&](std::size_t i) { return Components(&basis[cells[i] * k], components); };
  return mean_distance +
         (Components(stored.data(), components) *
          (shares[0] * at(0) + shares[1] * at(1) + shares[2] * at(2) + shares[3] * at(3)))
             .sum();
}

void write_ssdf(const std::filesystem::path& path, const SsdfVisibility& ssdf,
                const std::map<std::string, std::string>& metadata) {
  const auto n = static_cast<std::uint64_t>(ssdf.resolution);
  const auto k = static_cast<std::uint64_t>(ssdf.components);
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "signed distance of segment visibility");
  file.add<float>("mean", {n, n}, ssdf.mean);
  file.add<float>("basis", {n, n, k}, ssdf.basis);
  file.add<Half>("coefficients", {ssdf.sees_nothing.size(), k}, ssdf.coefficients);
  file.add<std::uint8_t>("sees_nothing", {ssdf.sees_nothing.size()}, ssdf.sees_nothing);
  file.write(path);
}

SsdfVisibility read_ssdf(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  const std::uint64_t n = checked_extent(file, "basis", 3, 0, 4, 4096);
  const std::uint64_t k = checked_extent(file, "basis", 3, 2, 1, kMostComponents);
  const std::uint64_t segments = checked_extent(file, "coefficients", 2, 0, 0, 0xfffffffe);
  SsdfVisibility ssdf;
  ssdf.resolution = static_cast<int>(n);
  ssdf.components = static_cast<int>(k);
  ssdf.mean = file.get<float>("mean", {n, n});
  ssdf.basis = file.get<float>("basis", {n, n, k});
  ssdf.coefficients = file.get<Half>("coefficients", {0, k});
  ssdf.sees_nothing = file.get<std::uint8_t>("sees_nothing", {0});
  if (ssdf.sees_nothing.size() != segments) {
    throw FileError(path.string() +
                    ": coefficients and sees_nothing differ in their number of segments");
  }
  check_flags(file, ssdf.sees_nothing);
  return ssdf;
}

void write_sg_visibility(const std::filesystem::path& path, const SgVisibility& visibility,
                         const std::map<std::string, std::string>& metadata) {
  const auto lobes = static_cast<std::uint64_t>(visibility.lobes());
  const std::uint64_t segments = visibility.sees_nothing.size();
  std::vector<float> axes;
  for (const Vec3& axis : visibility.axes) axes.insert(axes.end(), axis.data(), axis.data() + 3);
  const std::array<float, 1> sharpness = {visibility.sharpness};
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "spherical Gaussians of segment visibility");
  file.add<float>("sharpness", {1}, sharpness);
  file.add<float>("axes", {lobes, 3}, axes);
  file.add<Half>("weights", {segments, lobes}, visibility.weights);
  file.add<Half>("rotation", {segments}, visibility.rotation);
  file.add<std::uint8_t>("sees_nothing", {segments}, visibility.sees_nothing);
  file.write(path);
}

SgVisibility read_sg_visibility(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  const std::uint64_t lobes = checked_extent(file, "weights", 2, 1, 1, 256);
  const std::uint64_t segments = checked_extent(file, "weights", 2, 0, 0, 0xfffffffe);
  SgVisibility visibility;
  visibility.sharpness = file.get<float>("sharpness", {1})[0];
  if (!(visibility.sharpness > 0)) throw FileError(path.string() + ": sharpness is not positive");
  const std::vector<float> axes = file.get<float>("axes", {lobes, 3});
  for (std::size_t q = 0; q < lobes; ++q) {
    visibility.axes.emplace_back(axes[3 * q], axes[3 * q + 1], axes[3 * q + 2]);
    if (std::abs(visibility.axes.back().norm() - 1) > 1e-3F)
      throw FileError(path.string() + ": an axis has not unit length");
  }
  visibility.weights = file.get<Half>("weights", {0, lobes});
  if (std::any_of(visibility.weights.begin(), visibility.weights.end(),
                  [](Half w) { return float_from_half(w) < 0; })) {
    throw FileError(path.string() + ": a weight is negative");
  }
  visibility.rotation = file.get<Half>("rotation", {0});
  visibility.sees_nothing = file.get<std::uint8_t>("sees_nothing", {0});
  if (visibility.rotation.size() != segments || visibility.sees_nothing.size() != segments) {
    throw FileError(path.string() +
                    ": weights, rotation and sees_nothing differ in their number of segments");
  }
  check_flags(file, visibility.sees_nothing);
  return visibility;
}

}  // namespace heddle
