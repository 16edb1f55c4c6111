#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fibers/baked/transfer.h"
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

const PaperFabric* paper_counterpart(const std::string& file) {
  const auto* const end = std::end(kPaper);
  const auto* const found = std::find_if(
      std::begin(kPaper), end, [&](const PaperFabric& fabric) { return file == fabric.file; });
  return found == end ? nullptr : found;
}

constexpr double kPaperCores = 192;
constexpr const char* kColumns[] = {
    "segments", "fiber radius, um",     "mean free path, um", "cells", "order",
    "MB",       "visibility, core min", "transfer, core min"};
using Cells = std::array<std::string, std::size(kColumns)>;

std::string summary_row(const std::string& name, const char* style, const Cells& cells) {
  std::string row = fmt::format("<tr class=\"{}\"><th>{}</th>", style, xml_text(name));
  for (const std::string& cell : cells) row += fmt::format("<td>{}</td>", cell);
  return row + "</tr>\n";
}

/// A row of the table at the top: what the fabric is, and what its data took as far as the cache
/// holds them. Below it, its counterpart of table 1.
std::string summary_of(FabricStages& stages, const TileScene& tile, const Cache& cache) {
  const FabricConfig& config = stages.document().config;
  const auto [thinnest, thickest] =
      std::minmax_element(tile.exemplar().radius_mm.begin(), tile.exemplar().radius_mm.end());
  Cells cells;
  cells[0] = fmt::format("{}", tile.exemplar().segment_count());
  cells[1] = *thinnest == *thickest
                 ? fmt::format("{:.3g}", 1000 * *thinnest)
                 : fmt::format("{:.3g} to {:.3g}", 1000 * *thinnest, 1000 * *thickest);
  cells[2] = fmt::format("{:.3g}", 1000 * tile.mean_free_path(config.seed, kMeanFreePathSamples));
  double bytes = 0;
  double visibility = 0;
  bool whole = true;
  for (const StageCost& cost : stages.costs(kEverything)) {
    const char* extension = cost.stage == "voxelize" ? ".vdb" : ".safetensors";
    const fs::path path = cache.artifact(cost.stage, cost.key, extension);
    whole = whole && cost.present && cost.seconds >= 0;
    if (!whole) break;
    if (cost.stage != "maps") bytes += static_cast<double>(fs::file_size(path));
    if (cost.stage == "transfer") {
      const Transfer transfer = read_transfer(path);
      cells[3] = fmt::format("{}", transfer.cell_count());
      cells[4] = fmt::format("{}", transfer.order);
      cells[7] = fmt::format("{:.1f}", cost.core_seconds / 60);
    } else if (cost.stage == "maps" || cost.stage == "ssdf" || cost.stage == "sg") {
      visibility += cost.core_seconds / 60;
    }
  }
  if (whole) {
    cells[5] = fmt::format("{:.0f}", bytes * 1e-6);
    cells[6] = fmt::format("{:.1f}", visibility);
  }
  std::string rows = summary_row(config.name, "ours", cells);
  if (const PaperFabric* paper = paper_counterpart(stages.document().file.stem().string())) {
    rows += summary_row(
        fmt::format("{}, Khungurn et al. 2017", paper->name), "paper",
        {"", fmt::format("{:g}", paper->radius_um), "", "", fmt::format("{}", paper->order), "",
         fmt::format("{:.0f}", kPaperCores * paper->visibility_minutes),
         fmt::format("{:.0f}", kPaperCores * paper->transfer_minutes)});
  }
  return rows;
}

std::string text_of(const Report& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (const auto& [key, part] : value.items()) {
    text += text.empty() ? "" : ", ";
    text += (value.is_object() ? key + ": " : "") + text_of(part);
  }
  return text;
}

std::string rows_of(const Report& report) {
  std::string rows;
  for (const auto& [key, value] : report.items()) {
    if (key == "kind" || key == "tile_repeats" || key == "ray_tracing_bytes") continue;
    if (value.is_array() && value.empty()) continue;
    std::string name = key;
    std::replace(name.begin(), name.end(), '_', ' ');
    std::string text = xml_text(text_of(value));
    if (key == "drawing") {
      text = "<pre>";
      for (const Report& line : value) text += xml_text(line.get<std::string>()) + "\n";
      text += "</pre>";
    }
    rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", xml_text(name), text);
  }
  return rows;
}

struct Section {
  std::string summary;  // rows of the table at the top
  std::string body;
};

/// Pictures and figures of one fabric; the pictures go into the folder.
Section section_of(const fs::path& fabric, const CatalogueOptions& options, Job& job) {
  FabricStages stages(fabric, job.context());
  const FabricConfig& config = stages.document().config;
  const std::string file = fabric.stem().string();
  const TileScene tile(read_exemplar(stages.synth().path));
  const double shorter = std::min(tile.exemplar().width_mm, tile.exemplar().height_mm);
  const double near = std::min(kNearRepeats * shorter, kNearMm);
  std::string figures;
  for (const double width : {near, kFarOfNear * near}) {
    const std::string name = fmt::format("{}-{}.png", file, width == near ? "near" : "far");
    Progress progress(job.console(), name, "%", 100);
    write_swatch(
        options.output / name,
        trace_swatch(tile, config.light_from_both_sides, {width, options.pixels, options.spp},
                     config.seed, percent_of(progress)),
        options.pixels);
    figures += fmt::format(
        "<figure><img src=\"{}\" alt=\"\"><figcaption>{:.3g} mm</figcaption>"
        "</figure>\n",
        xml_text(name), width);
  }
  const Report report = fabric_report(stages.document(), &tile);
  return {summary_of(stages, tile, job.context().cache),
          fmt::format("<section><h2>{}</h2>\n<div>{}<table>{}</table></div></section>\n",
                      xml_text(config.name), figures, rows_of(report))};
}

constexpr char kPage[] = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Fabrics</title>
<style>
body {{ font: 14px/1.45 system-ui, 'DejaVu Sans', Arial, sans-serif; color: #222; max-width: 1300px; margin: 1.2em auto; padding: 0 1em; }}
section div {{ display: flex; flex-wrap: wrap; gap: 1em; align-items: flex-start; }}
figure {{ margin: 0; }} figcaption {{ color: #555; }}
table {{ font-size: .85em; max-width: 640px; }} td {{ padding: 0 .9em .1em 0; vertical-align: top; overflow-wrap: anywhere; }}
section td:first-child {{ color: #666; white-space: nowrap; }}
pre {{ line-height: 1; margin: 0; }} .summary {{ max-width: none; }} .summary th {{ text-align: left; font-weight: normal; padding-right: .9em; }}
.paper {{ color: #888; }} .summary .ours > th {{ font-weight: 600; }}
</style></head><body>
<h1>Fabrics</h1>
<table class="summary"><tr><th></th>{}</tr>
{}</table>
<p>Data that were not baked leave their places empty. Table 1 counts minutes on 192 cores.</p>
{}</body></html>
)";

}  // namespace

int swatch_command(const SwatchOptions& options, const CommonOptions& common) {
  Job job(common);
  require_writable(options.output);
  FabricStages stages(options.fabric, job.context());
  const TileScene tile(read_exemplar(stages.synth().path));
  Progress progress(job.console(), "swatch", "%", 100);
  write_swatch(options.output,
               trace_swatch(tile, stages.document().config.light_from_both_sides,
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
  std::string names;
  for (const char* column : kColumns) names += fmt::format("<th>{}</th>", column);
  Section page_of_all;
  for (const fs::path& fabric : options.fabrics) {
    const Section one = section_of(fabric, options, job);
    page_of_all.summary += one.summary;
    page_of_all.body += one.body;
  }
  const fs::path page = options.output / "index.html";
  const std::string html = fmt::format(kPage, names, page_of_all.summary, page_of_all.body);
  write_file_atomically(page, html);
  job.add_artifact(page);
  job.finish();
  return 0;
}

}  // namespace heddle
