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
  file.add<std::uint32_t>("cell_of_segment", {t.cell_of_segment.size()}, t.cell_of_segment);
  file.add<float>("matrices", {t.cell_count(), n, n, 3}, t.matrices);
  file.add<float>("standard_error", {t.cell_count(), bands, 3}, t.standard_error);
  file.add<std::uint32_t>("paths", {t.cell_count()}, t.paths);
  file.write(path);
}

Transfer read_transfer(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  Transfer t;
  const std::string& sides = file.metadata_value("light_from");
  if (sides != "face" && sides != "both") throw FileError(path.string() + ": light_from is neither face nor both");
  t.both_sides = sides == "both";
  const std::uint64_t count = file.shape("paths").at(0);
  const std::vector<std::uint64_t>& error_shape = file.shape("standard_error");
  if (error_shape.size() != 3 || error_shape[1] < 1 || error_shape[1] > 11) {
    throw FileError(path.string() + ": expected standard_error of shape [cell][band][3] with 1 to 11 bands");
  }
  t.order = static_cast<int>(error_shape[1]) - 1;
  const auto n = static_cast<std::uint64_t>(t.coefficients());
  t.matrices = file.get<float>("matrices", {count, n, n, 3});
  t.standard_error = file.get<float>("standard_error", {count, error_shape[1], 3});
  t.paths = file.get<std::uint32_t>("paths", {count});
  t.cell_of_segment = file.get<std::uint32_t>("cell_of_segment", {file.shape("cell_of_segment").at(0)});
  for (const std::uint32_t cell : t.cell_of_segment) {
    if (cell >= count) throw FileError(fmt::format("{}: cell {} of {}", path.string(), cell, count));
  }
  return t;
}

}  // namespace heddle
