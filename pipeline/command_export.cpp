#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "fibers/cloth/synthesize.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/atomic_file.h"
#include "formats/curve_file.h"
#include "formats/file_ending.h"
#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/json_file.h"
#include "pipeline/output_folder.h"
#include "pipeline/stages.h"
#include "pipeline/stand_in_files.h"
#include "pipeline/swatch_picture.h"
#include "render/stand_in/fit_stand_in.h"
#include "render/stand_in/flat_maps.h"
#include "render/stand_in/flat_response.h"
#include "render/stand_in/stand_in.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

struct NamedExemplar {
  std::string name;
  std::uint64_t seed;
  Exemplar exemplar;
};

NamedExemplar exemplar_of(const fs::path& input, const CommonOptions& common) {
  if (!fs::exists(input)) throw FileError(input.string() + ": no such file or folder");
  const std::uint64_t seed = common.fabric_seed.value_or(0);
  if (fs::is_directory(input)) {
    FabricPack pack = load_pack(input);
    return {pack.name, seed, std::move(pack.exemplar)};
  }
  const std::string ending = lower_case_ending(input);
  if (ending == ".safetensors") return {input.stem().string(), seed, read_exemplar(input)};
  if (ending != ".toml") {
    throw FileError(input.string() +
                    ": expected a fabric .toml, its fibers .safetensors, or a pack");
  }
  const FabricDocument fabric = read_fabric_document(input, common.fabric_seed);
  try {
    return {fabric.config.name, fabric.config.seed, synthesize(fabric.config)};
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

int export_curves(const ExportOptions& options, const CommonOptions& common) {
  require_writable(options.output);
  const Exemplar exemplar = exemplar_of(options.input, common).exemplar;
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

// Pairs of view and light that the stand-in is fitted to, and others that it is judged by.
constexpr int kFitViews = 32;
constexpr int kFitLights = 12;
constexpr int kTestViews = 16;
constexpr int kTestLights = 12;
constexpr int kLightsBelow = 4;
constexpr double kMostDegrees = 75;  // of views and lights from the cloth's normal
constexpr int kRaysPerSample = 32;   // of a view of the reference, per ray of a texel

/// Light from above and below; `turn` gives other directions.
FlatResponse response_of(const TileScene& tile, std::span<const BcsdfTable> materials, int views,
                         int lights, double turn, int rays, std::uint64_t seed, Job& job) {
  std::vector<Vec3> directions = cap_directions(lights, kMostDegrees, turn + 1);
  for (const Vec3& above : cap_directions(kLightsBelow, kMostDegrees, turn + 2))
    directions.emplace_back(above.x(), above.y(), -above.z());
  Progress progress(job.console(), "reference", "%", 100);
  return trace_flat_response(tile, materials, cap_directions(views, kMostDegrees, turn), directions,
                             rays, seed, percent_of(progress));
}

/// What lies in stand_in.json.
nlohmann::ordered_json report_of(const std::string& name, const StandIn& stand_in,
                                 const FlatResponse& tested) {
  const FlatMaps& maps = stand_in.maps();
  const StandInParameters& p = stand_in.parameters();
  const auto [low, high] = maps.relief_range_mm();
  nlohmann::ordered_json report = {
      {"format", "heddle stand-in"},
      {"fabric", name},
      {"repeat_mm", {maps.width_mm, maps.height_mm}},
      {"texels", {maps.width, maps.height}},
      {"cover", maps.cover()},
      {"height_mm", {{"black", low}, {"white", high}}},
      {"model",
       {{"normal_strength", p.normal_strength},
        {"alpha_along", p.alpha_along},
        {"alpha_across", p.alpha_across},
        {"base_color_of_albedo", numbers_of(p.base_scale)},
        {"subsurface", p.subsurface},
        {"subsurface_color_of_base_color", numbers_of(p.subsurface_tint)},
        {"specular_IOR", p.ior()},
        {"specular_color", numbers_of(p.specular_color)},
        {"sheen", p.sheen},
        {"sheen_color", numbers_of(p.sheen_color)},
        {"sheen_roughness", p.sheen_roughness}}}};
  nlohmann::ordered_json errors = {{"against", "path tracing of the fibers, flat cloth"},
                                   {"lights", "directional, up to 75 degrees from the normal"},
                                   {"pairs_of_view_and_light", tested.pair_count()}};
  for (const bool below : {false, true}) {
    const std::optional<StandInError> error = stand_in_error(stand_in, tested, below);
    if (!error) continue;
    errors[below ? "from_below" : "from_above"] = {{"relative_rmse", error->rmse},
                                                   {"relative_mean", error->mean}};
  }
  report["error"] = errors;
  return report;
}

std::string error_text(const nlohmann::ordered_json& error) {
  return fmt::format("RMSE {:.1f} %, mean {:+.1f} %", 100 * error.at("relative_rmse").get<double>(),
                     100 * error.at("relative_mean").get<double>());
}

int export_stand_in(const ExportOptions& options, const CommonOptions& common) {
  Job job(common);
  require_place_for_folder(options.output, "an export", is_stand_in_file);
  const NamedExemplar fabric = exemplar_of(options.input, common);
  const TileScene tile(fabric.exemplar);
  const std::vector<BcsdfTable> materials = bcsdf_tables(fabric.exemplar.scattering);

  const std::vector<Light> lights = swatch_lights(false);
  FlatMapSettings settings{.seed = fabric.seed};
  settings.pixels = options.pixels.value_or(settings.pixels);
  settings.spp = options.spp.value_or(settings.spp);
  const int rays = kRaysPerSample * settings.spp;
  const FlatResponse fitted =
      response_of(tile, materials, kFitViews, kFitLights, 0, rays, fabric.seed, job);
  const FlatResponse tested =
      response_of(tile, materials, kTestViews, kTestLights, 0.5, rays, fabric.seed + 1, job);
  const FlatMaps maps = [&] {
    Progress progress(job.console(), "maps", "%", 100);
    return bake_flat_maps(tile, materials, lights, settings, percent_of(progress));
  }();
  const StandIn stand_in(maps, fit_stand_in(maps, fitted));
  const nlohmann::ordered_json report = report_of(fabric.name, stand_in, tested);

  const fs::path place = without_slash(options.output);
  require_place_for_folder(place, "an export", is_stand_in_file);
  TemporaryPath folder(place);
  make_folder(folder.path());
  constexpr int kDirections = 16;
  write_stand_in(folder.path(), fabric.name, stand_in,
                 picture_from_above(stand_in, lights, kDirections, fabric.seed), report);
  folder.commit();
  const nlohmann::ordered_json& error = report.at("error");
  for (const char* side : {"from_above", "from_below"}) {
    if (!error.contains(side)) continue;
    job.console().say(
        fmt::format("stand-in against path tracing, light {}: {}",
                    side == std::string_view("from_above") ? "from above" : "from below",
                    error_text(error.at(side))));
  }
  job.add_entry("error", error);
  job.add_artifact(place);
  job.finish();
  return 0;
}

}  // namespace

int export_command(const ExportOptions& options, const CommonOptions& common) {
  const std::string ending = lower_case_ending(options.output);
  const bool is_folder = ending.empty();
  if (!is_folder && ending != ".bcc" && ending != ".hair" && ending != ".obj") {
    throw ConfigError(options.output.string() +
                      ": expected a name that ends in .hair, .bcc or .obj, or that of a folder, "
                      "without an ending or with a last slash");
  }
  if (!is_folder && (options.pixels || options.spp))
    throw ConfigError("--pixels and --spp: curves have none; expected a folder as output");
  return is_folder ? export_stand_in(options, common) : export_curves(options, common);
}

}  // namespace heddle
