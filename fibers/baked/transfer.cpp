#include "fibers/baked/transfer.h"

#include <fmt/format.h>

#include "fibers/baked/light_from.h"
#include "formats/input_error.h"
#include "formats/tensor_file.h"

namespace heddle {

namespace {

using RowMajorMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The `index`-th of matrices of `rows` x `columns` stored one after the other.
Eigen::Map<const RowMajorMatrix> matrix_at(const std::vector<float>& values, std::size_t index,
                                           int rows, int columns) {
  return {values.data() + index * static_cast<std::size_t>(rows * columns), rows, columns};
}

/// result [j1][rgb] += factor times the sum over j0 of light [j0][rgb] matrix [j0][j1][rgb].
void add_colored_product(float factor, const float* light, const float* matrix, int n,
                         float* result) {
  // Four coefficients in three colours fill whole vectors.
  using Lanes = Eigen::Array<float, 12, 1>;
  const int whole = 3 * n / 12 * 12;
  for (int j0 = 0; j0 < n; ++j0, light += 3, matrix += 3 * n) {
    const Eigen::Array3f color = factor * Eigen::Map<const Eigen::Array3f>(light);
    const Lanes colors = color.replicate<4, 1>();
    for (int k = 0; k < whole; k += 12)
      Eigen::Map<Lanes>(result + k) += colors * Eigen::Map<const Lanes>(matrix + k);
    for (int k = whole; k < 3 * n; ++k) result[k] += color[k % 3] * matrix[k];
  }
}

}  // namespace

void Transfer::add_incoming(std::uint32_t cell, const float* light, float* result) const {
  const int n = coefficients();
  add_colored_product(1, light, matrix_at(matrices, cell, n, 3 * n).data(), n, result);
}

void Transfer::subtract_incoming_of_cones(std::uint32_t cell, const float* light,
                                          float* result) const {
  const int n = coefficients();
  add_colored_product(-1, light, matrix_at(cones->harmonics, cell, n, 3 * n).data(), n, result);
}

void Transfer::incoming(std::uint32_t cell, const float* light, float* result) const {
  const int n = coefficients();
  Eigen::Map<const Eigen::RowVectorXf> c_light(light, n);
  Eigen::Map<Eigen::RowVectorXf>(result, 3 * n).noalias() =
      c_light * matrix_at(matrices, cell, n, 3 * n);
}

void Transfer::incoming(std::uint32_t cell, const float* light, float cone_share,
                        float* result) const {
  incoming(cell, light, result);
  if (!cones || !(cone_share > 0)) return;
  const int n = coefficients();
  Eigen::Map<const Eigen::RowVectorXf> c_light(light, n);
  Eigen::Map<Eigen::RowVectorXf>(result, 3 * n).noalias() -=
      cone_share * c_light * matrix_at(cones->harmonics, cell, n, 3 * n);
}

void Transfer::incoming_on_cones(std::uint32_t cell, const float* light, float* result) const {
  constexpr int kRow = 3 * ConeTransfer::kAzimuths;
  const int n = coefficients();
  Eigen::Map<const Eigen::RowVectorXf> c_light(light, n);
  for (int width = 0; width < ConeTransfer::kWidths; ++width) {
    const std::size_t index =
        static_cast<std::size_t>(cell) * ConeTransfer::kWidths + static_cast<std::size_t>(width);
    Eigen::Map<Eigen::RowVectorXf>(result + width * kRow, kRow).noalias() =
        c_light * matrix_at(cones->moments, index, n, kRow);
  }
}

void add_cones(TensorFileWriter& file, const ConeTransfer& cones, std::uint64_t cells,
               std::uint64_t n) {
  file.add<float>("cone_harmonics", {cells, n, n, 3}, cones.harmonics);
  file.add<float>("cone_moments", {cells, ConeTransfer::kWidths, n, ConeTransfer::kAzimuths, 3},
                  cones.moments);
}

std::optional<ConeTransfer> get_cones(const TensorFile& file, std::uint64_t cells,
                                      std::uint64_t n) {
  if (!file.entries().contains("cone_moments")) return {};
  return ConeTransfer{file.get<float>("cone_harmonics", {cells, n, n, 3}),
                      file.get<float>("cone_moments", {cells, ConeTransfer::kWidths, n,
                                                       ConeTransfer::kAzimuths, 3})};
}

Transfer cut_to_order(const Transfer& transfer, int order) {
  if (order >= transfer.order) return transfer;
  Transfer result = transfer;
  result.order = order;
  const auto all = static_cast<std::size_t>(transfer.coefficients());
  const auto kept = static_cast<std::size_t>(result.coefficients());
  // The first kept_rows of every `rows` rows, and the first kept_columns of every row.
  const auto cut = [](std::vector<float>& values, std::size_t rows, std::size_t columns,
                      std::size_t kept_rows, std::size_t kept_columns) {
    std::vector<float> low;
    for (std::size_t row = 0; row < values.size() / columns; ++row) {
      if (row % rows >= kept_rows) continue;
      const auto first = values.begin() + static_cast<std::ptrdiff_t>(row * columns);
      low.insert(low.end(), first, first + static_cast<std::ptrdiff_t>(kept_columns));
    }
    values = std::move(low);
  };
  cut(result.matrices, all, 3 * all, kept, 3 * kept);
  cut(result.standard_error, 1, 3 * static_cast<std::size_t>(transfer.order + 1), 1,
      3 * static_cast<std::size_t>(order + 1));
  if (result.cones) {
    constexpr std::size_t kOnCone = 3 * ConeTransfer::kAzimuths;
    cut(result.cones->harmonics, all, 3 * all, kept, 3 * kept);
    cut(result.cones->moments, all, kOnCone, kept, kOnCone);
  }
  return result;
}

void write_transfer(const std::filesystem::path& path, const Transfer& t,
                    const std::map<std::string, std::string>& metadata) {
  const auto n = static_cast<std::uint64_t>(t.coefficients());
  const auto bands = static_cast<std::uint64_t>(t.order + 1);
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "transfer");
  set_light_from(file, t.both_sides);
  file.add<std::uint32_t>("cell_of_segment", {t.cell_of_segment.size()}, t.cell_of_segment);
  file.add<float>("matrices", {t.cell_count(), n, n, 3}, t.matrices);
  file.add<float>("standard_error", {t.cell_count(), bands, 3}, t.standard_error);
  file.add<std::uint32_t>("paths", {t.cell_count()}, t.paths);
  if (t.cones) add_cones(file, *t.cones, t.cell_count(), n);
  file.write(path);
}

Transfer read_transfer(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  Transfer t;
  t.both_sides = get_light_from(file);
  const std::uint64_t count = file.get<std::uint32_t>("paths", {0}).size();
  if (count == 0) throw FileError(path.string() + ": no cells");
  const std::vector<std::uint64_t>& error_shape = file.shape("standard_error");
  if (error_shape.size() != 3 || error_shape[1] < 1 || error_shape[1] > 11) {
    throw FileError(path.string() +
                    ": expected standard_error of shape [cell][band][3] with 1 to 11 bands");
  }
  t.order = static_cast<int>(error_shape[1]) - 1;
  const auto n = static_cast<std::uint64_t>(t.coefficients());
  t.matrices = file.get<float>("matrices", {count, n, n, 3});
  t.standard_error = file.get<float>("standard_error", {count, error_shape[1], 3});
  t.paths = file.get<std::uint32_t>("paths", {count});
  t.cones = get_cones(file, count, n);
  t.cell_of_segment = file.get<std::uint32_t>("cell_of_segment", {0});
  for (const std::uint32_t cell : t.cell_of_segment) {
    if (cell >= count)
      throw FileError(fmt::format("{}: cell {} of {}", path.string(), cell, count));
  }
  return t;
}

}  // namespace heddle
