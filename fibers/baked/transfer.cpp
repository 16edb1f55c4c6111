#include "fibers/baked/transfer.h"

#include <fmt/format.h>

#include "formats/input_error.h"
#include "formats/tensor_file.h"

namespace heddle {

void Transfer::incoming(std::uint32_t cell, const float* light, float* result) const {
  const int n = coefficients();
  const int row = 3 * n;
  const float* a = matrices.data() + static_cast<std::size_t>(cell) * static_cast<std::size_t>(n * row);
  Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> matrix(a, n, row);
  Eigen::Map<const Eigen::RowVectorXf> c_light(light, n);
  Eigen::Map<Eigen::RowVectorXf>(result, row).noalias() = c_light * matrix;
}

void write_transfer(const std::filesystem::path& path, const Transfer& t,
                    const std::map<std::string, std::string>& metadata) {
  const auto n = static_cast<std::uint64_t>(t.coefficients());
  const auto bands = static_cast<std::uint64_t>(t.order + 1);
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "transfer");
  file.set_metadata("light_from", t.both_sides ? "both" : "face");
  const std::vector<std::int32_t> cells(t.grid.cells.begin(), t.grid.cells.end());
  const std::vector<float> box = {t.grid.width_mm, t.grid.height_mm, t.grid.z_min, t.grid.z_max};
  file.add<std::int32_t>("cells", {3}, cells);
  file.add<float>("grid_mm", {4}, box);
  file.add<float>("matrices", {t.grid.count(), n, n, 3}, t.matrices);
  file.add<float>("standard_error", {t.grid.count(), bands, 3}, t.standard_error);
  file.add<std::uint32_t>("paths", {t.grid.count()}, t.paths);
  file.write(path);
}

Transfer read_transfer(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  Transfer t;
  const auto cells = file.get<std::int32_t>("cells", {3});
  const auto box = file.get<float>("grid_mm", {4});
  for (int axis = 0; axis < 3; ++axis) {
    if (cells[static_cast<std::size_t>(axis)] < 1 || cells[static_cast<std::size_t>(axis)] > 4096) {
      throw FileError(fmt::format("{}: expected 1 to 4096 cells along each axis", path.string()));
    }
    t.grid.cells[static_cast<std::size_t>(axis)] = cells[static_cast<std::size_t>(axis)];
  }
  t.grid.width_mm = box[0];
  t.grid.height_mm = box[1];
  t.grid.z_min = box[2];
  t.grid.z_max = box[3];
  if (!(box[0] > 0 && box[1] > 0 && box[3] > box[2])) throw FileError(path.string() + ": the cell grid has no volume");
  const std::string& sides = file.metadata_value("light_from");
  if (sides != "face" && sides != "both") throw FileError(path.string() + ": light_from is neither face nor both");
  t.both_sides = sides == "both";
  const std::uint64_t count = t.grid.count();
  const std::vector<std::uint64_t>& error_shape = file.shape("standard_error");
  if (error_shape.size() != 3 || error_shape[1] < 1 || error_shape[1] > 11) {
    throw FileError(path.string() + ": expected standard_error of shape [cell][band][3] with 1 to 11 bands");
  }
  t.order = static_cast<int>(error_shape[1]) - 1;
  const auto n = static_cast<std::uint64_t>(t.coefficients());
  t.matrices = file.get<float>("matrices", {count, n, n, 3});
  t.standard_error = file.get<float>("standard_error", {count, error_shape[1], 3});
  t.paths = file.get<std::uint32_t>("paths", {count});
  return t;
}

}  // namespace heddle
