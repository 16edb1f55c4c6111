#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fibers/cloth/synthesize.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "pipeline/chart/xml_text.h"
#include "pipeline/commands.h"
#include "pipeline/fabric_report.h"
#include "pipeline/job.h"
#include "pipeline/swatch_picture.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Report = nlohmann::ordered_json;

// A far picture shows so many times as much cloth as a near one.
constexpr double kFarOfNear = 10;
// A near picture shows this many repeats of the tile's shorter side, at most kNearMm.
constexpr double kNearRepeats = 1.5;
constexpr double kNearMm = 6;

/// Of table 1 and the supplement of Khungurn et al. 2017, as far as they are public in text.
struct PaperFabric {
  const char* file;  // of our counterpart, without its ending
  const char* name;
  double radius_um;
  int order;
  double visibility_minutes;  // on 192 cores
  double transfer_minutes;
};
constexpr PaperFabric kPaper[] = {
    {"fleece", "Fleece", 8.7, 4, 79.79, 5.67},
    {"wool-gabardine", "Gabardine", 16.1, 4, 15.51, 5.25},
    {"silk-satin", "Silk", 4.7, 5, 15.07, 2.19},
    {"satin-4-1", "4/1 Satin", 15.0, 4, 41.33, 8.44},
    {"satin-2-3", "2/3 Satin", 15.0, 4, 31.25, 5.03},
    {"satin-1-4", "1/4 Satin", 15.0, 5, 37.90, 5.57},
    {"shot-silk-a", "Shot Silk A", 1.0, 5, 7.98, 9.75},
    {"shot-silk-b", "Shot Silk B", 1.0, 5, 7.18, 9.43},
};

std::string paper_cells(const std::string& file) {
  for (const PaperFabric& fabric : kPaper) {
    if (file != fabric.file) continue;
    return fmt::format(
        "{}: radius {} um, order {}, visibility {} min, transfer {} min on 192 cores", fabric.name,
        fabric.radius_um, fabric.order, fabric.visibility_minutes, fabric.transfer_minutes);
  }
  return "";
}

/// Bytes and processor minutes of the fabric's stages, as far as the cache holds them.
std::string baked_cells(FabricStages& stages, const Cache& cache) {
  std::string text;
  for (const StageCost& cost : stages.costs(kEverything)) {
    if (!cost.present || cost.seconds < 0) continue;
    const char* extension = cost.stage == "voxelize" ? ".vdb" : ".safetensors";
    const fs::path path = cache.artifact(cost.stage, cost.key, extension);
    text += fmt::format("{}{}: {:.3g} MB, {:.3g} core min", text.empty() ? "" : "; ", cost.stage,
                        static_cast<double>(fs::file_size(path)) * 1e-6, cost.core_seconds / 60);
  }
  return text;
}

std::string rows_of(const Report& report) {
  std::string rows;
  for (const auto& [key, value] : report.items()) {
    if (key == "kind" || key == "tile_repeats" || key == "ray_tracing_bytes") continue;
    std::string name = key;
    std::replace(name.begin(), name.end(), '_', ' ');
    rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", xml_text(name),
                        xml_text(value.is_string() ? value.get<std::string>() : value.dump()));
  }
  return rows;
}

/// Pictures and figures of one fabric; the pictures go into the folder.
std::string section_of(const fs::path& fabric, const CatalogueOptions& options, Job& job) {
  FabricStages stages(fabric, job.context());
  const FabricConfig& config = stages.document().config;
  const std::string file = fabric.stem().string();
  const auto tile = std::make_shared<const TileScene>(read_exemplar(stages.synth().path));
  const double shorter = std::min(tile->exemplar().width_mm, tile->exemplar().height_mm);
  const double near = std::min(kNearRepeats * shorter, kNearMm);
  std::string figures;
  for (const double width : {near, kFarOfNear * near}) {
    const std::string name = fmt::format("{}-{}.png", file, width == near ? "near" : "far");
    Progress progress(job.console(), name, "%", 100);
    write_swatch(
        options.output / name,
        trace_swatch(*tile, config.light_from_both_sides, {width, options.pixels, options.spp},
                     config.seed, percent_of(progress)),
        options.pixels);
    figures += fmt::format(
        "<figure><img src=\"{}\" alt=\"\"><figcaption>{:.3g} mm</figcaption>"
        "</figure>\n",
        xml_text(name), width);
  }
  Report report = fabric_report(stages.document(), tile.get());
  if (const std::string baked = baked_cells(stages, job.context().cache); !baked.empty())
    report["data"] = baked;
  if (const std::string paper = paper_cells(file); !paper.empty()) report["table 1"] = paper;
  return fmt::format("<section><h2>{}</h2>\n<div>{}<table>{}</table></div></section>\n",
                     xml_text(config.name), figures, rows_of(report));
}

constexpr char kPage[] = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Fabrics</title>
<style>
body {{ font: 14px/1.45 system-ui, 'DejaVu Sans', Arial, sans-serif; color: #222; max-width: 1300px; margin: 1.2em auto; padding: 0 1em; }}
section div {{ display: flex; flex-wrap: wrap; gap: 1em; align-items: flex-start; }}
figure {{ margin: 0; }} figcaption {{ color: #555; }}
table {{ font-size: .85em; max-width: 640px; }} td {{ padding: 0 .9em .1em 0; vertical-align: top; overflow-wrap: anywhere; }}
td:first-child {{ color: #666; white-space: nowrap; }}
</style></head><body>
<h1>Fabrics</h1>
{}</body></html>
)";

}  // namespace

int swatch_command(const SwatchOptions& options, const CommonOptions& common) {
  Job job(common);
  require_writable(options.output);
  FabricStages stages(options.fabric, job.context());
  const auto tile = std::make_shared<const TileScene>(read_exemplar(stages.synth().path));
  Progress progress(job.console(), "swatch", "%", 100);
  write_swatch(options.output,
               trace_swatch(*tile, stages.document().config.light_from_both_sides,
                            {options.width_mm, options.pixels, options.spp},
                            stages.document().config.seed, percent_of(progress)),
               options.pixels);
  job.add_artifact(options.output);
  job.finish();
  return 0;
}

int catalogue_command(const CatalogueOptions& options, const CommonOptions& common) {
  Job job(common);
  make_folder(options.output);
  std::string sections;
  for (const fs::path& fabric : options.fabrics) sections += section_of(fabric, options, job);
  const fs::path page = options.output / "index.html";
  const std::string html = fmt::format(kPage, sections);
  write_file_atomically(page, html);
  job.add_artifact(page);
  job.finish();
  return 0;
}

}  // namespace heddle
