#include "pipeline/fabric_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "fibers/cloth/interpenetration.h"
#include "fibers/cloth/synthesize.h"
#include "fibers/cloth/yarn_count.h"
#include "fibers/cloth/yarn_paths.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/input_error.h"
#include "pipeline/draft_report.h"

namespace heddle {
namespace {

using Report = nlohmann::ordered_json;

double tex_of(const YarnConfig& yarn, const FabricConfig& config) {
  const FiberType& fiber = config.fiber_of(yarn);
  return yarn.plies * yarn.fibers_per_ply * fiber_tex(fiber.radius_mm, fiber.density_g_cm3);
}

Report yarn_report(const YarnConfig& yarn, const FabricConfig& config) {
  const FiberType& fiber = config.fiber_of(yarn);
  Report report = {{"fiber", fiber.name},
                   {"fibers", yarn.plies * yarn.fibers_per_ply},
                   {"fiber_radius_um", rounded(1000 * fiber.radius_mm)},
                   {"section_mm", {rounded(yarn.width_mm), rounded(yarn.height_mm)}},
                   {"filled", rounded(fill_of(yarn, fiber))}};
  if (fiber.density_g_cm3 > 0) {
    const double tex = tex_of(yarn, config);
    report["tex"] = rounded(tex);
    report["cotton_count_ne"] = rounded(590.54 / tex);
  }
  return report;
}

/// What one system of threads brings to the cloth.
struct SystemFacts {
  double cover = 0;  // share of the cloth's plane
  double crimp = 0;  // mean
  double grams_per_m2 = 0;
};

SystemFacts facts_of(const FabricConfig& config, const ThreadSystem& system,
                     const YarnPlaces& places, const std::vector<YarnPath>& paths) {
  SystemFacts facts;
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const YarnConfig& yarn = config.yarn(system.yarn_at(static_cast<int>(k)));
    facts.cover += yarn.width_mm / places.period_mm;
    const double crimp = paths[k].shape->crimp();
    facts.crimp += crimp / static_cast<double>(paths.size());
    // A yarn per millimetre of period: tex is g / km, so that 1 tex at one yarn per mm is 1 g /
    // m^2.
    facts.grams_per_m2 += tex_of(yarn, config) * (1 + crimp) / places.period_mm;
  }
  return facts;
}

void describe_threads(const FabricConfig& config, const YarnPaths& paths, Report& report) {
  const YarnPlaces warp_place = warp_places(config);
  const YarnPlaces weft_place = weft_places(config);
  const SystemFacts warp = facts_of(config, config.warp, warp_place, paths.warp);
  const SystemFacts weft = facts_of(config, config.weft, weft_place, paths.weft);
  const auto per_cm = [](const YarnPlaces& places) {
    return rounded(10 * static_cast<double>(places.centre_mm.size()) / places.period_mm);
  };
  report["ends_per_cm"] = per_cm(warp_place);
  report["picks_per_cm"] = per_cm(weft_place);
  report["warp_crimp_percent"] = rounded(100 * warp.crimp);
  report["weft_crimp_percent"] = rounded(100 * weft.crimp);
  report["cover_factor"] = rounded(warp.cover + weft.cover - warp.cover * weft.cover);
  if (warp.grams_per_m2 + weft.grams_per_m2 > 0)
    report["grams_per_m2"] = rounded(warp.grams_per_m2 + weft.grams_per_m2);
}

void describe_knit(const KnitConfig& knit, const FabricConfig& config, Report& report) {
  const double thickest = thickest_yarn_mm(config, knit.sequence);
  const LoopForm loop = solve_loop(knit, thickest);
  const double length = loop_length(loop);
  report["knit"] = knit.structure == KnitStructure::kRib1x1 ? "rib 1x1" : "jersey";
  report["wales_per_cm"] = rounded(10 * knit.wales_per_mm);
  report["courses_per_cm"] = rounded(10 * knit.courses_per_mm);
  report["loop_length_mm"] = rounded(length);
  // Munden 1959: 19 to 23 in relaxed plain knits.
  report["loop_constant"] = rounded(knit.wales_per_mm * knit.courses_per_mm * length * length);
}

void describe_curves(const CurvesConfig& curves, const FabricConfig& config, Report& report) {
  CurveCut cut;
  const std::size_t pieces = curves_on_tile(curves, config.segment_mm, &cut).size();
  report["curves"] = pieces;
  report["curves_cut_percent"] = rounded(100 * (1 - cut.kept_mm / cut.whole_mm));
  report["ends_at_the_border"] = cut.ends;
}

}  // namespace

double rounded(double value) {
  return std::stod(fmt::format("{:.4g}", value));
}

void describe_exemplar(const TileScene& scene, std::uint64_t seed, Report& report) {
  const Exemplar& exemplar = scene.exemplar();
  const ExemplarSummary summary = summarize(exemplar);
  report["fibers"] = summary.fibers;
  report["segments"] = summary.segments;
  report["tile_mm"] = {rounded(exemplar.width_mm), rounded(exemplar.height_mm)};
  report["tile_repeats"] = fmt::format(
      "endless: a ray marches from tile to tile until it hits, leaves the cloth or has "
      "crossed {} tiles",
      TileScene::kMaxTiles);
  report["thickness_mm"] = rounded(summary.thickness_mm);
  report["volume_fraction"] = rounded(summary.volume_fraction);
  report["mean_free_path_mm"] = rounded(scene.mean_free_path(seed, kMeanFreePathSamples));
  report["mean_segment_mm"] = rounded(summary.mean_segment_mm);
  report["fiber_length_mm_per_mm2"] = rounded(summary.areal_fiber_length_per_mm2);
  report["fiber_wander_rms_deg"] = rounded(summary.wander_rms_deg);
  const Interpenetration overlap = measure_interpenetration(exemplar);
  report["interpenetration"] = {{"percent_of_segments", rounded(100 * overlap.share)},
                                {"mean_depth_radii", rounded(overlap.mean_depth)},
                                {"deepest_radii", rounded(overlap.deepest)}};
  report["ray_tracing_bytes"] = scene.memory_bytes();
}

Report fabric_report(const FabricDocument& fabric, const TileScene* fibers) {
  const FabricConfig& config = fabric.config;
  Report report = {{"kind", "fabric config"}, {"name", config.name}};
  report["light_from"] = config.light_from_both_sides ? "both" : "face";
  report["seed"] = config.seed;
  try {
    if (config.knit) {
      describe_knit(*config.knit, config, report);
    } else if (config.curves) {
      describe_curves(*config.curves, config, report);
    } else {
      report["weave"] = config.weave.notation;
      Weave crossings = config.weave;
      // What a draft says of its threads is not what the config makes of them.
      crossings.warp = crossings.weft = {};
      describe_weave(crossings, report);
      describe_threads(config, lay_yarns(config), report);
    }
    for (const YarnConfig& yarn : config.yarns)
      report["yarns"][yarn.name] = yarn_report(yarn, config);
    if (fibers != nullptr) {
      describe_exemplar(*fibers, config.seed, report);
    } else {
      describe_exemplar(TileScene(synthesize(config)), config.seed, report);
    }
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: {}", fabric.file.string(), error.what()));
  }
  return report;
}

}  // namespace heddle
