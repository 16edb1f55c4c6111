#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "fibers/baked/fabric_pack.h"
#include "fibers/cloth/synthesize.h"
#include "formats/atomic_file.h"
#include "formats/curve_file.h"
#include "formats/file_ending.h"
#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/stages.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

Exemplar exemplar_of(const fs::path& input, const CommonOptions& common) {
  if (!fs::exists(input)) throw FileError(input.string() + ": no such file or folder");
  if (fs::is_directory(input)) return load_pack(input).exemplar;
  const std::string ending = lower_case_ending(input);
  if (ending == ".safetensors") return read_exemplar(input);
  if (ending != ".toml") {
    throw FileError(input.string() +
                    ": expected a fabric .toml, its fibers .safetensors, or a pack");
  }
  const FabricDocument fabric = read_fabric_document(input, common.fabric_seed);
  try {
    return synthesize(fabric.config);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: {}", input.string(), error.what()));
  }
}

CurveSet curves_of(const Exemplar& exemplar) {
  CurveSet curves;
  curves.up = UpAxis::kZ;
  curves.info = "millimetres, thickness is the diameter";
  curves.points.reserve(exemplar.points.size());
  curves.thickness.reserve(exemplar.points.size());
  curves.first_point.assign(exemplar.first_point.begin(), exemplar.first_point.end());
  curves.closed.assign(exemplar.fiber_count(), false);
  for (const Vec3& point : exemplar.points)
    curves.points.push_back({point.x(), point.y(), point.z()});
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f)
    curves.thickness.resize(exemplar.first_point[f + 1], 2 * exemplar.radius_mm[f]);
  return curves;
}

}  // namespace

int export_command(const ExportOptions& options, const CommonOptions& common) {
  const std::string ending = lower_case_ending(options.output);
  if (ending != ".bcc" && ending != ".hair" && ending != ".obj") {
    throw ConfigError(options.output.string() +
                      ": expected a name that ends in .hair, .bcc or .obj");
  }
  require_writable(options.output);
  const Exemplar exemplar = exemplar_of(options.input, common);
  write_curves(options.output, curves_of(exemplar));
  if (common.json) {
    std::cout << nlohmann::ordered_json{{"file", options.output.string()},
                                        {"curves", exemplar.fiber_count()},
                                        {"points", exemplar.points.size()},
                                        {"unit", "mm"},
                                        {"period_mm", {exemplar.width_mm, exemplar.height_mm}}}
                     .dump(2)
              << '\n';
  } else {
    std::cout << options.output.string() << '\n';
  }
  return 0;
}

}  // namespace heddle
