#include "fibers/baked/far_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "fibers/baked/light_from.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

constexpr int kMostDirections = 256;  // along an edge of the grid
constexpr int kMostBands = 11;

}  // namespace

void write_far_table(const std::filesystem::path& path, const FarTable& table,
                     const std::map<std::string, std::string>& metadata) {
  const std::uint64_t views = table.view_count();
  const std::uint64_t lights = table.light_count();
  const auto n = static_cast<std::uint64_t>(table.coefficients());
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "far form");
  set_light_from(file, table.both_sides);
  const std::vector<float> scales = {table.repeat_mm, table.light_variance};
  file.add<float>("scales", {2}, scales);
  file.add<std::int32_t>("sizes", {2}, std::vector<std::int32_t>{table.resolution, table.order});
  file.add<float>("coverage", {views}, table.coverage);
  file.add<float>("height", {views}, table.height);
  file.add<Half>("single", {views, lights, 3}, table.single);
  file.add<float>("multiple", {views, n, 3}, table.multiple);
  if (table.has_cones()) {
    file.add<float>("on_cones", {views, n, 3}, table.on_cones);
    file.add<Half>("cones", {views, lights, 3}, table.cones);
  }
  file.write(path);
}

FarTable read_far_table(const std::filesystem::path& path) {
  const TensorFile file = TensorFile::read(path);
  FarTable table;
  table.both_sides = get_light_from(file);
  const std::vector<std::int32_t> sizes = file.get<std::int32_t>("sizes", {2});
  if (sizes[0] < 1 || sizes[0] > kMostDirections || sizes[1] < 0 || sizes[1] >= kMostBands) {
    throw FileError(fmt::format("{}: expected sizes up to {} and {}, found {} and {}",
                                path.string(), kMostDirections, kMostBands - 1, sizes[0],
                                sizes[1]));
  }
  table.resolution = sizes[0];
  table.order = sizes[1];
  const std::vector<float> scales = file.get<float>("scales", {2});
  if (!(scales[0] > 0) || !(scales[1] >= 0))
    throw FileError(path.string() + ": expected scales > 0 and >= 0");
  table.repeat_mm = scales[0];
  table.light_variance = scales[1];
  const std::uint64_t views = table.view_count();
  const std::uint64_t lights = table.light_count();
  const auto n = static_cast<std::uint64_t>(table.coefficients());
  table.coverage = file.get<float>("coverage", {views});
  if (std::any_of(table.coverage.begin(), table.coverage.end(),
                  [](float share) { return !(share >= 0) || share > 1; })) {
    throw FileError(path.string() + ": coverage holds values outside [0, 1]");
  }
  table.height = file.get<float>("height", {views});
  table.single = file.get<Half>("single", {views, lights, 3});
  table.multiple = file.get<float>("multiple", {views, n, 3});
  if (file.entries().contains("cones")) {
    table.on_cones = file.get<float>("on_cones", {views, n, 3});
    table.cones = file.get<Half>("cones", {views, lights, 3});
  }
  return table;
}

}  // namespace heddle
