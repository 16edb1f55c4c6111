#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "fibers/baked/fabric_pack.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/output_folder.h"
#include "pipeline/swatch_picture.h"
#include "pipeline/work_time.h"
#include "render/tile_preview.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

void require_place_for_pack(const fs::path& folder) {
  require_place_for_folder(folder, "a pack", is_pack_file);
}

/// Copies a pack out of the cache: beside its place, then into it as a whole.
void copy_pack(const fs::path& from, const fs::path& to) {
  const fs::path place = without_slash(to);
  require_place_for_pack(to);
  TemporaryPath copy(place);
  make_folder(copy.path());
  for (const auto& entry : fs::directory_iterator(from)) {
    write_file_atomically(copy.path() / entry.path().filename(), read_whole_file(entry.path()));
  }
  read_verified_manifest(copy.path());
  copy.commit();
}

/// "transfer: 1430 cells, 63 MB of memory, 4 min on 2 threads".
void print_forecast(FabricStages& stages, std::optional<int> order, Job& job) {
  double seconds = 0;
  auto report = nlohmann::ordered_json::array();
  for (const StageForecast& stage : stages.forecast(order)) {
    report.push_back({{"stage", stage.stage},
                      {"in_cache", stage.present},
                      {stage.unit, stage.items},
                      {"memory_bytes", stage.bytes},
                      {"core_seconds", stage.core_seconds}});
    const double own = stage.core_seconds / working_threads();
    if (!stage.present) seconds += own;
    job.console().say(
        stage.present
            ? fmt::format("{}: in the cache", stage.stage)
            : fmt::format("{}: {:.0f} {}, {} of memory{}", stage.stage, stage.items, stage.unit,
                          memory_text(static_cast<std::uint64_t>(stage.bytes)),
                          own > 0 ? fmt::format(", about {}", duration_text(own)) : ""));
  }
  job.console().say(
      fmt::format("about {} on {} threads in all", duration_text(seconds), working_threads()));
  job.add_entry("forecast", report);
}

}  // namespace

int stage_command(const StageOptions& options, const CommonOptions& common) {
  Job job(common);
  if (options.output) require_place_for_pack(*options.output);  // before hours of work
  if (options.preview) require_writable(*options.preview);
  FabricStages stages(options.fabric, job.context());
  if (options.dry_run) {
    print_forecast(stages, options.order, job);
    job.finish();
    return 0;
  }
  std::optional<Artifact> artifact;
  switch (options.target) {
    case StageTarget::kSynth:
      artifact = stages.synth();
      if (options.preview) {
        const auto tile = std::make_shared<const TileScene>(read_exemplar(artifact->path));
        const Exemplar& exemplar = tile->exemplar();
        constexpr int kPixels = 512;
        write_swatch(*options.preview,
                     preview_tile(*tile, std::max(exemplar.width_mm, exemplar.height_mm), kPixels),
                     kPixels);
        job.add_artifact(*options.preview);
      }
      break;
    case StageTarget::kVisibility:
      if (options.shard) {
        stages.visibility_shard(*options.shard);
      } else {
        job.add_artifact(stages.ssdf().path);
        artifact = stages.sgs();
      }
      break;
    case StageTarget::kTransfer:
      if (options.shard) {
        stages.transfer_shard(options.order, *options.shard);
      } else {
        artifact = stages.transfer(options.order);
      }
      break;
    case StageTarget::kFar:
      artifact = stages.far(options.order);
      break;
    case StageTarget::kAccuracy:
      artifact = stages.accuracy();
      break;
    case StageTarget::kPack: {
      Needs needs = kEverything;
      needs.order = options.order;
      artifact = stages.pack(needs);
      if (options.output) {
        copy_pack(artifact->path, *options.output);
        artifact->path = *options.output;
      }
      break;
    }
  }
  if (artifact) job.add_artifact(artifact->path);
  job.finish();
  return 0;
}

}  // namespace heddle
