#include "pipeline/stages.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "fibers/baked/fabric_pack.h"
#include "fibers/cloth/bundle_tangents.h"
#include "fibers/cloth/synthesize.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/atomic_file.h"
#include "formats/content_hash.h"
#include "formats/id_volume_file.h"
#include "formats/input_error.h"
#include "formats/tensor_file.h"
#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/artifact_record.h"
#include "pipeline/interrupt.h"
#include "pipeline/version.h"
#include "precompute/far_bake.h"
#include "precompute/sg_fit.h"
#include "precompute/ssdf_fit.h"
#include "precompute/visibility_maps.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

// Segments per visibility chunk and cells per transfer chunk: a few seconds of two cores, so that
// little is lost when a job is killed, and enough work for many threads.
constexpr std::uint32_t kSegmentsPerChunk = 256;
constexpr std::uint32_t kCellsPerChunk = 32;
// So many items of a stage are timed for a forecast.
constexpr std::uint32_t kForecastProbes = 24;

// Of every stage, and of the hash of the fibers' shapes. One whose algorithm or file layout changes
// needs a new number: its key holds it, and what the old one made is then found no more.
int version_of(std::string_view stage) {
  static const std::map<std::string_view, int> versions = {
      {"geometry", 1},        {"synth", 3},    {"maps", 3}, {"ssdf", 1},     {"sg", 1},
      {"transfer", 5},        {"voxelize", 2}, {"pack", 1}, {"accuracy", 9}, {"surface-maps", 1},
      {"surface-weights", 2}, {"far", 2},
  };
  return versions.at(stage);
}

void write_transfer_chunk(const fs::path& path, const TransferChunk& chunk, int order) {
  const auto cells = static_cast<std::uint64_t>(chunk.paths.size());
  const auto bands = static_cast<std::uint64_t>(order + 1);
  TensorFileWriter writer;
  writer.add<float>("matrices", {cells, bands * bands, bands * bands, 3}, chunk.matrices);
  writer.add<float>("standard_error", {cells, bands, 3}, chunk.standard_error);
  writer.add<std::uint32_t>("paths", {cells}, chunk.paths);
  if (chunk.cones) add_cones(writer, *chunk.cones, cells, bands * bands);
  writer.write(path);
}

TransferChunk read_transfer_chunk(const fs::path& path, std::uint32_t first_cell,
                                  std::uint64_t cells, int order) {
  const auto bands = static_cast<std::uint64_t>(order + 1);
  const TensorFile file = TensorFile::read(path);
  TransferChunk chunk;
  chunk.first_cell = first_cell;
  chunk.matrices = file.get<float>("matrices", {cells, bands * bands, bands * bands, 3});
  chunk.standard_error = file.get<float>("standard_error", {cells, bands, 3});
  chunk.paths = file.get<std::uint32_t>("paths", {cells});
  chunk.cones = get_cones(file, cells, bands * bands);
  return chunk;
}

void announce(Console* console, const char* stage, double items, const char* unit, double bytes) {
  announce_memory(*console, fmt::format("{}: {:.3g} {}", stage, items, unit),
                  static_cast<std::uint64_t>(bytes));
}

/// Memory for all maps, and two copies while they are written.
double maps_bytes(double segments, bool both_sides) {
  return 3.0 * (both_sides ? 2048 : 1024) * segments;
}

/// Memory for the matrices of all cells: chunks, what is assembled of them, and two copies while
/// that is written.
double transfer_bytes(double cells, int order) {
  const double bands = (order + 1) * (order + 1);
  return 3 * 3 * sizeof(float) * bands * bands * cells;
}

// Circles in a hexagonal pattern fill this share of a plane.
constexpr double kDensestFill = 0.9069;

void warn_of_crowded_yarns(const FabricConfig& config, Console& console) {
  for (const YarnConfig& yarn : config.yarns) {
    const double fill = fill_of(yarn, config.fiber_of(yarn));
    if (fill <= kDensestFill) continue;
    console.warn(fmt::format(
        "{}: the yarn \"{}\" of {:.3g} x {:.3g} mm has room for {:.0f} fibers at most, and holds "
        "{}; "
        "they run through each other",
        config.name, yarn.name, yarn.width_mm, yarn.height_mm,
        kDensestFill / fill * yarn.plies * yarn.fibers_per_ply, yarn.plies * yarn.fibers_per_ply));
  }
}

std::string hash_of_geometry(const Exemplar& exemplar) {
  const auto bytes_of = [](const auto& values) {
    return content_hash(std::as_bytes(std::span(values)));
  };
  return stage_key({"geometry",
                    version_of("geometry"),
                    {{"tile_mm", fmt::format("{} {}", exemplar.width_mm, exemplar.height_mm)},
                     {"first_point", bytes_of(exemplar.first_point)},
                     {"points", bytes_of(exemplar.points)},
                     {"is_open", bytes_of(exemplar.is_open)},
                     {"radius_mm", bytes_of(exemplar.radius_mm)}}});
}

}  // namespace

std::function<void(double)> percent_of(Progress& progress) {
  return [&progress, shown = std::uint64_t{0}](double share) mutable {
    stop_if_interrupted();
    const auto now = static_cast<std::uint64_t>(100 * std::min(share, 1.0));
    progress.advance(now - shown);
    shown = now;
  };
}

FabricDocument read_fabric_document(const fs::path& path, std::optional<std::uint64_t> seed,
                                    const FabricVariant& variant) {
  const TomlTable document = TomlTable::load(path);
  if (document.has("model"))
    document.fail("model", "this fabric has no fibers: a scene names it by the key surface");
  FabricDocument fabric;
  fabric.file = path;
  fabric.config = read_fabric_config(document);
  if (seed) fabric.config.seed = *seed;
  fabric.visibility =
      read_visibility_settings(document.table("visibility"), fabric.config.light_from_both_sides);
  fabric.visibility.seed = fabric.config.seed;
  fabric.transfer = read_transfer_settings(document.table("transfer"));
  fabric.transfer.both_sides = fabric.config.light_from_both_sides;
  fabric.transfer.seed = fabric.config.seed;
  fabric.volume = read_volume_settings(document.table("volume"));
  document.finish();

  // canonical_text() is JSON. Defaults go in as well: an artifact made with another one is another
  // artifact.
  auto cloth = nlohmann::json::parse(document.canonical_text());
  for (const AskedKey& asked : document.asked_keys()) {
    const bool has_default = asked.default_value != "required" && asked.default_value != "optional";
    if (has_default && asked.path != "light_from")
      cloth["defaults"][asked.path] = asked.default_value;
  }
  const auto take_section = [&cloth](const std::string& name) {
    nlohmann::json section = {{"set", cloth.at(name)}};
    cloth.erase(name);
    auto& defaults = cloth["defaults"];
    for (auto entry = defaults.begin(); entry != defaults.end();) {
      const bool inside = entry.key().starts_with(name + ".");
      if (inside) section["defaults"][entry.key()] = entry.value();
      entry = inside ? defaults.erase(entry) : std::next(entry);
    }
    return section;
  };
  // As if the config said so: canonical text writes whole numbers without a point.
  const auto change = [](nlohmann::json& section, const char* key, double& value, double factor) {
    if (factor == 1) return;
    value *= factor;
    section["set"][key] = value;
    if (value == std::round(value)) section["set"][key] = static_cast<std::int64_t>(value);
  };
  fabric.visibility_text = take_section("visibility").dump();
  nlohmann::json transfer = take_section("transfer");
  change(transfer, "cell_mean_free_paths", fabric.transfer.cell_mean_free_paths, variant.cell_size);
  transfer["set"].erase("order");  // part of the key on its own
  fabric.transfer_text = transfer.dump();
  nlohmann::json volume = take_section("volume");
  change(volume, "voxels_per_radius", fabric.volume.voxels_per_radius, variant.voxel_rate);
  fabric.volume_text = volume.dump();
  cloth.erase("name");
  cloth.erase("light_from");
  cloth["seed"] = fabric.config.seed;
  fabric.cloth_text = cloth.dump();
  return fabric;
}

FabricStages::FabricStages(const fs::path& fabric_file, StageContext& context,
                           const FabricVariant& variant, BakeChoices choices)
    : FabricStages(read_fabric_document(fabric_file, context.fabric_seed, variant), context,
                   choices) {}

FabricStages::FabricStages(FabricDocument document, StageContext& context, BakeChoices choices)
    : document_(std::move(document)), context_(&context) {
  if (choices == BakeChoices::kShipped) return;
  if (document_.config.light_from_both_sides) {
    throw ConfigError(
        document_.file.string() +
        ": the printed axes lie above the horizon, and this fabric takes light from both sides");
  }
  origin_choice_ = OriginChoice::kMidpoint;
  document_.visibility.sgs = {FibonacciSet::kPrinted, 48, 128, SgWeights::kVoronoi};
  document_.visibility_text += " printed";
}

FabricStages::~FabricStages() = default;

Stage make_stage(std::string name, std::string extension, const std::string& config,
                 std::vector<std::pair<std::string, std::string>> upstream) {
  upstream.emplace_back("config", config);
  Stage stage;
  stage.key = stage_key({name, version_of(name), std::move(upstream)});
  stage.metadata = {{"stage", name},
                    {"key", stage.key},
                    {"config", config},
                    {"program_version", kProgramVersion}};
  stage.name = std::move(name);
  stage.extension = std::move(extension);
  return stage;
}

void StageContext::report(StageResult result) {
  for (const StageResult& earlier : results) {
    if (earlier.stage == result.stage && earlier.key == result.key) return;
  }
  std::string how =
      result.built ? fmt::format("built in {}", duration_text(result.seconds)) : "cached";
  if (result.resumed > 0) how += fmt::format(", {} chunks were already done", result.resumed);
  console->say(fmt::format("{}: {:<9} {}", result.fabric, result.stage, how));
  results.push_back(std::move(result));
}

bool is_sound(const Stage& stage, StageContext& context) {
  const fs::path path = context.cache.artifact(stage.name, stage.key, stage.extension);
  if (context.sound.contains(path)) return true;
  const ArtifactCheck check = check_artifact(path, context.cache.record(stage.name, stage.key));
  if (check.state == ArtifactState::kBroken && context.broken.insert(path).second) {
    context.console->warn(check.problem + "; it is built again");
  }
  if (check.state == ArtifactState::kSound) context.sound.insert(path);
  return check.state == ArtifactState::kSound;
}

Artifact provide_artifact(const Stage& stage, const std::string& fabric, StageContext& context,
                          const std::function<void(const fs::path&, StageResult&)>& build) {
  Artifact artifact{stage.key, context.cache.artifact(stage.name, stage.key, stage.extension)};
  StageResult result{
      .fabric = fabric, .stage = stage.name, .key = stage.key, .artifact = artifact.path};
  if (!is_sound(stage, context)) {
    stop_if_interrupted();
    const WorkTime outer = std::exchange(context.nested, {});
    const Stopwatch watch;
    result.built = publish_artifact(artifact.path, context.cache.record(stage.name, stage.key),
                                    [&](const fs::path& path) {
                                      build(path, result);
                                      const WorkTime whole = watch.elapsed();
                                      const WorkTime own = whole - context.nested;
                                      context.nested = outer + whole;
                                      result.seconds = own.seconds;
                                      return BuildCost{own + result.earlier, working_threads()};
                                    });
    context.sound.insert(artifact.path);
  }
  context.report(std::move(result));
  return artifact;
}

StageCost recorded_cost(const Stage& stage, const Cache& cache) {
  const BuildCost cost = recorded_build_cost(cache.record(stage.name, stage.key));
  return {.stage = stage.name,
          .key = stage.key,
          .seconds = cost.time.seconds,
          .core_seconds = cost.time.core_seconds,
          .threads = cost.threads,
          .present = fs::exists(cache.artifact(stage.name, stage.key, stage.extension))};
}

Artifact FabricStages::artifact_of(
    const Stage& stage, const std::function<void(const fs::path&, StageResult&)>& build) {
  return provide_artifact(stage, document_.config.name, *context_, build);
}

std::vector<StageCost> FabricStages::costs(const Needs& needs) {
  std::vector<StageCost> costs;
  const auto add = [&](const Stage& stage) {
    costs.push_back(recorded_cost(stage, context_->cache));
  };
  add(synth_stage());
  if (needs.ssdf || needs.sgs) add(maps_stage());
  if (needs.ssdf) add(ssdf_stage());
  if (needs.sgs) add(sg_stage());
  if (needs.transfer) add(transfer_stage(transfer_settings(needs.order)));
  if (needs.volume) add(volume_stage());
  return costs;
}

const Exemplar& FabricStages::exemplar() {
  if (!exemplar_) exemplar_ = read_exemplar(synth().path);
  return *exemplar_;
}

const TileScene& FabricStages::scene() {
  if (!scene_) scene_ = std::make_unique<TileScene>(exemplar());
  return *scene_;
}

const SegmentOrigins& FabricStages::origins() {
  if (!origins_) {
    origins_ = find_segment_origins(scene(), document_.config.light_from_both_sides, origin_choice_,
                                    document_.config.seed);
  }
  return *origins_;
}

const std::string& FabricStages::geometry_key() {
  if (geometry_key_.empty()) geometry_key_ = hash_of_geometry(exemplar());
  return geometry_key_;
}

Stage FabricStages::synth_stage() const {
  return make_stage("synth", ".safetensors", document_.cloth_text, {});
}

Artifact FabricStages::synth() {
  const Stage stage = synth_stage();
  return artifact_of(stage, [&](const fs::path& path, StageResult&) {
    const FabricConfig& config = document_.config;
    for (const std::string& warning : config.weave.warnings) context_->console->warn(warning);
    try {
      warn_of_crowded_yarns(config, *context_->console);
      const ExemplarForecast forecast = forecast_exemplar(config);
      announce(context_->console, "synth", forecast.segments, "segments", forecast.bytes);
      Progress progress(*context_->console, "synth", "yarns", forecast.yarns);
      const auto yarn_done = [&progress] {
        stop_if_interrupted();
        progress.advance(1);
      };
      write_exemplar(path, synthesize(config, yarn_done), stage.metadata);
    } catch (const std::invalid_argument& error) {
      throw ConfigError(fmt::format("{}: {}", document_.file.string(), error.what()));
    }
  });
}

/// Publishes one chunk. The process that publishes the artifact removes the chunks' folder, whoever
/// writes there.
template <class Compute>
bool FabricStages::publish_chunk(const Stage& stage, std::uint32_t first, std::uint32_t end,
                                 Compute&& compute) {
  const PartialChunks chunks(context_->cache, stage.name, stage.key);
  while (!is_sound(stage, *context_)) {
    const Stopwatch watch;
    try {
      publish_artifact(chunks.file(first), chunks.record(first), [&](const fs::path& file) {
        compute(file, first, end);
        return BuildCost{watch.elapsed(), working_threads()};
      });
      return true;
    } catch (const FileError&) {
      if (!is_sound(stage, *context_) && chunks.folder_exists()) throw;
    }
  }
  return false;
}

template <class Compute>
bool FabricStages::finish_chunks(const Stage& stage, std::uint32_t items, std::uint32_t per_chunk,
                                 const std::string& unit, Shard shard, StageResult& result,
                                 Compute&& compute) {
  const PartialChunks chunks(context_->cache, stage.name, stage.key);
  std::vector<std::uint32_t> missing;
  std::uint64_t items_of_shard = 0;
  std::uint64_t items_done = 0;
  for (std::uint32_t first = 0; first < items; first += per_chunk) {
    if (first / per_chunk % shard.count != shard.index) continue;
    const std::uint32_t size = std::min(per_chunk, items - first);
    items_of_shard += size;
    if (chunks.has(first)) {
      ++result.resumed;
      const BuildCost cost = recorded_build_cost(chunks.record(first));
      if (cost.time.seconds > 0) result.earlier = result.earlier + cost.time;
      items_done += size;
    } else {
      missing.push_back(first);
    }
  }
  if (missing.empty()) return true;
  const std::uint64_t abandoned_before = scene().abandoned_rays();
  Progress progress(*context_->console, stage.name, unit, items_of_shard, items_done);
  for (const std::uint32_t first : missing) {
    stop_if_interrupted();
    const std::uint32_t size = std::min(per_chunk, items - first);
    if (!publish_chunk(stage, first, first + size, compute)) return false;
    ++result.chunks;
    progress.advance(size);
  }
  if (const std::uint64_t abandoned = scene().abandoned_rays() - abandoned_before; abandoned > 0) {
    context_->console->warn(fmt::format(
        "{}: {} rays ran on through {} tiles without leaving the cloth; they count as not hit",
        stage.name, abandoned, TileScene::kMaxTiles));
  }
  return true;
}

/// read(file, first, end) for all chunks in order; a chunk that is broken or has vanished is
/// computed again.
template <class Compute, class Read>
bool FabricStages::read_chunks(const Stage& stage, std::uint32_t items, std::uint32_t per_chunk,
                               Compute&& compute, Read&& read) {
  const PartialChunks chunks(context_->cache, stage.name, stage.key);
  for (std::uint32_t first = 0; first < items; first += per_chunk) {
    const std::uint32_t end = std::min(first + per_chunk, items);
    const fs::path file = chunks.file(first);
    try {
      chunks.verify(first);
      read(file, first, end);
    } catch (const FileError& error) {
      if (is_sound(stage, *context_)) return false;
      context_->console->warn(fmt::format("{}; this chunk is computed again", error.what()));
      if (!publish_chunk(stage, first, end, compute)) return false;
      read(file, first, end);
    }
  }
  return true;
}

/// A shard's own line in the report; nothing is published.
template <class Work>
void FabricStages::run_shard(const Stage& stage, Work&& work) {
  StageResult result{.fabric = document_.config.name,
                     .stage = stage.name,
                     .key = stage.key,
                     .artifact = context_->cache.artifact(stage.name, stage.key, stage.extension)};
  if (!is_sound(stage, *context_)) {
    const Stopwatch watch;
    work(result);
    result.built = result.chunks > 0;
    result.seconds = watch.elapsed().seconds;
  }
  context_->report(std::move(result));
}

// Maps do not depend on [visibility], which says how they are compressed.
Stage FabricStages::maps_stage() {
  std::vector<std::pair<std::string, std::string>> upstream = {
      {"geometry", geometry_key()},
      {"light_from", light_from()},
      {"seed", fmt::format("{}", document_.config.seed)}};
  append_origins(upstream);
  return make_stage("maps", ".safetensors", "", std::move(upstream));
}

/// Computes one chunk of maps.
void FabricStages::compute_maps(const Stage& stage, const fs::path& file, std::uint32_t first,
                                std::uint32_t end) {
  write_visibility_maps(
      file,
      bake_visibility_maps(scene(), origins(), document_.config.light_from_both_sides, first, end),
      stage.metadata);
}

Artifact FabricStages::maps() {
  const Stage stage = maps_stage();
  Artifact artifact = artifact_of(stage, [&](const fs::path& path, StageResult& result) {
    const auto segments = static_cast<std::uint32_t>(exemplar().segment_count());
    announce(context_->console, "visibility", segments, "segments",
             maps_bytes(segments, document_.config.light_from_both_sides));
    const auto compute = [&](const fs::path& file, std::uint32_t first, std::uint32_t end) {
      compute_maps(stage, file, first, end);
    };
    VisibilityMaps all;
    all.both_sides = document_.config.light_from_both_sides;
    const auto read = [&](const fs::path& file, std::uint32_t first, std::uint32_t end) {
      const VisibilityMaps chunk = read_visibility_maps(file);
      if (chunk.first_segment != first || chunk.count() != end - first ||
          chunk.both_sides != all.both_sides) {
        throw FileError(file.string() + ": not the chunk that its name says");
      }
      all.append(chunk);
    };
    if (!finish_chunks(stage, segments, kSegmentsPerChunk, "segments", Shard{}, result, compute))
      return;
    if (!read_chunks(stage, segments, kSegmentsPerChunk, compute, read)) return;
    write_visibility_maps(path, all, stage.metadata);
  });
  PartialChunks(context_->cache, stage.name, stage.key).remove();
  return artifact;
}

void FabricStages::visibility_shard(Shard shard) {
  const Stage stage = maps_stage();
  run_shard(stage, [&](StageResult& result) {
    finish_chunks(stage, static_cast<std::uint32_t>(exemplar().segment_count()), kSegmentsPerChunk,
                  "segments", shard, result,
                  [&](const fs::path& file, std::uint32_t first, std::uint32_t end) {
                    compute_maps(stage, file, first, end);
                  });
  });
}

Stage FabricStages::fit_stage(const std::string& name) {
  return make_stage(
      name, ".safetensors", document_.visibility_text,
      {{"maps", maps_stage().key}, {"seed", fmt::format("{}", document_.config.seed)}});
}

Stage FabricStages::ssdf_stage() {
  return fit_stage("ssdf");
}
Stage FabricStages::sg_stage() {
  return fit_stage("sg");
}

Artifact FabricStages::ssdf() {
  const Stage stage = ssdf_stage();
  return artifact_of(stage, [&](const fs::path& path, StageResult&) {
    write_ssdf(path, fit_ssdf(read_visibility_maps(maps().path), document_.visibility),
               stage.metadata);
  });
}

Artifact FabricStages::sgs() {
  const Stage stage = sg_stage();
  return artifact_of(stage, [&](const fs::path& path, StageResult&) {
    write_sg_visibility(path, fit_sgs(read_visibility_maps(maps().path), document_.visibility),
                        stage.metadata);
  });
}

const char* FabricStages::light_from() const {
  return document_.config.light_from_both_sides ? "both" : "face";
}

void FabricStages::append_origins(
    std::vector<std::pair<std::string, std::string>>& upstream) const {
  if (origin_choice_ == OriginChoice::kMidpoint) upstream.emplace_back("origins", "midpoint");
}

TransferSettings FabricStages::transfer_settings(std::optional<int> order) const {
  TransferSettings settings = document_.transfer;
  if (order) settings.order = *order;
  return settings;
}

Stage FabricStages::transfer_stage(const TransferSettings& settings) {
  std::vector<std::pair<std::string, std::string>> upstream = {
      {"fibers", synth_stage().key},
      {"order", fmt::format("{}", settings.order)},
      {"light_from", light_from()},
      {"seed", fmt::format("{}", settings.seed)}};
  append_origins(upstream);
  return make_stage("transfer", ".safetensors", document_.transfer_text, std::move(upstream));
}

/// What the transfer stage and its shards need besides the settings.
struct FabricStages::TransferWork {
  std::vector<BcsdfTable> materials;
  TransferSettings settings;
  SegmentCells cells;
  std::optional<TransferBaker> baker;

  void compute(const fs::path& file, std::uint32_t first, std::uint32_t end) const {
    write_transfer_chunk(file, baker->bake(first, end), settings.order);
  }
};

std::unique_ptr<FabricStages::TransferWork> FabricStages::transfer_work(
    const TransferSettings& settings) {
  auto work = std::make_unique<TransferWork>();
  work->materials = bcsdf_tables(exemplar().scattering);
  work->settings = settings;
  const double mean_free_path = scene().mean_free_path(settings.seed, kMeanFreePathSamples);
  work->cells = make_segment_cells(
      exemplar(), origins(), static_cast<float>(settings.cell_mean_free_paths * mean_free_path));
  work->baker.emplace(scene(), work->materials, origins(), settings, work->cells);
  return work;
}

Artifact FabricStages::transfer(std::optional<int> order) {
  const TransferSettings settings = transfer_settings(order);
  const Stage stage = transfer_stage(settings);
  Artifact artifact = artifact_of(stage, [&](const fs::path& path, StageResult& result) {
    const auto work = transfer_work(settings);
    const std::uint32_t cells = work->baker->cell_count();
    announce(context_->console, "transfer", cells, "cells", transfer_bytes(cells, settings.order));
    const auto compute = [&](const fs::path& file, std::uint32_t first, std::uint32_t end) {
      work->compute(file, first, end);
    };
    std::vector<TransferChunk> chunks;
    const auto read = [&](const fs::path& file, std::uint32_t first, std::uint32_t end) {
      chunks.push_back(read_transfer_chunk(file, first, end - first, settings.order));
    };
    if (!finish_chunks(stage, cells, kCellsPerChunk, "cells", Shard{}, result, compute)) return;
    if (!read_chunks(stage, cells, kCellsPerChunk, compute, read)) return;
    write_transfer(path, work->baker->assemble(chunks), stage.metadata);
  });
  PartialChunks(context_->cache, stage.name, stage.key).remove();
  return artifact;
}

Stage FabricStages::volume_stage() {
  return make_stage("voxelize", ".vdb", document_.volume_text, {{"geometry", geometry_key()}});
}

Artifact FabricStages::volume() {
  const Stage stage = volume_stage();
  return artifact_of(stage, [&](const fs::path& path, StageResult&) {
    write_id_volume(path, voxelize(exemplar(), document_.volume), stage.metadata);
  });
}

Stage FabricStages::far_stage(std::optional<int> order) {
  return make_stage("far", ".safetensors", "",
                    {{"fibers", synth_stage().key},
                     {"ssdf", ssdf_stage().key},
                     {"transfer", transfer_stage(transfer_settings(order)).key}});
}

Artifact FabricStages::far(std::optional<int> order) {
  const Stage stage = far_stage(order);
  return artifact_of(stage, [&](const fs::path& path, StageResult&) {
    const SsdfVisibility visible = read_ssdf(ssdf().path);
    const Transfer light = read_transfer(transfer(order).path);
    const std::vector<BcsdfTable> materials(exemplar().scattering.begin(),
                                            exemplar().scattering.end());
    std::vector<Vec3> bundles;
    if (light.cones) bundles = bundle_tangents(exemplar());
    const FabricConfig& config = document_.config;
    const double repeat_area = static_cast<double>(exemplar().width_mm) * exemplar().height_mm /
                               (config.repeats_x * config.repeats_y);
    FarSettings settings;
    settings.seed = config.seed;
    announce(context_->console, "far", DirectionGrid(settings.resolution).count(), "views",
             static_cast<double>(
                 far_bake_bytes(exemplar().segment_count(), light.both_sides, settings)));
    Progress progress(*context_->console, stage.name, "%", 100);
    write_far_table(
        path,
        bake_far({&scene(), &visible, &light, bundles, materials, std::sqrt(repeat_area)}, settings,
                 percent_of(progress)),
        stage.metadata);
  });
}

Stage FabricStages::pack_stage(const Needs& needs) {
  std::vector<std::pair<std::string, std::string>> upstream = {
      {"fibers.safetensors", synth_stage().key}};
  if (needs.ssdf) upstream.emplace_back("ssdf.safetensors", ssdf_stage().key);
  if (needs.sgs) upstream.emplace_back("sg.safetensors", sg_stage().key);
  if (needs.transfer) {
    upstream.emplace_back("transfer.safetensors",
                          transfer_stage(transfer_settings(needs.order)).key);
  }
  if (needs.volume) upstream.emplace_back("volume.vdb", volume_stage().key);
  if (needs.far) upstream.emplace_back("far.safetensors", far_stage(needs.order).key);
  upstream.emplace_back("light_from", light_from());
  return make_stage("pack", "", document_.config.name, std::move(upstream));
}

Artifact FabricStages::pack(const Needs& needs) {
  const Stage stage = pack_stage(needs);
  return artifact_of(
      stage, [&](const fs::path& folder, StageResult&) { fill_pack(folder, stage.key, needs); });
}

void FabricStages::fill_pack(const fs::path& folder, const std::string& key, const Needs& needs) {
  PackManifest manifest;
  manifest.name = document_.config.name;
  manifest.key = key;
  manifest.program_version = kProgramVersion;
  manifest.light_from_both_sides = document_.config.light_from_both_sides;
  manifest.counts = {{"fibers", exemplar().fiber_count()},
                     {"segments", exemplar().segment_count()}};
  make_folder(folder);
  const auto add = [&](const char* name, const Artifact& artifact) {
    write_file_atomically(folder / name, read_whole_file(artifact.path));
    manifest.files[name] = {};
  };
  add("fibers.safetensors", synth());
  if (needs.ssdf) add("ssdf.safetensors", ssdf());
  if (needs.sgs) add("sg.safetensors", sgs());
  if (needs.transfer) {
    add("transfer.safetensors", transfer(needs.order));
    manifest.counts["cells"] = read_transfer(folder / "transfer.safetensors").cell_count();
  }
  if (needs.volume) add("volume.vdb", volume());
  if (needs.far) add("far.safetensors", far(needs.order));
  write_manifest(folder, std::move(manifest));
}

Stage FabricStages::accuracy_stage(const SurfaceFabric* surface) {
  if (surface != nullptr) {
    return make_stage(
        "accuracy", ".json", surface->text,
        {{"fibers", synth().key}, {"seed", fmt::format("{}", document_.config.seed)}});
  }
  std::vector<std::pair<std::string, std::string>> upstream;
  for (const Stage& stage : {synth_stage(), ssdf_stage(), sg_stage(),
                             transfer_stage(transfer_settings({})), volume_stage()}) {
    upstream.emplace_back(stage.name, stage.key);
  }
  return make_stage("accuracy", ".json", "", std::move(upstream));
}

Artifact FabricStages::accuracy_place(const SurfaceFabric* surface) {
  const Stage stage = accuracy_stage(surface);
  return {stage.key, context_->cache.artifact(stage.name, stage.key, stage.extension)};
}

Artifact FabricStages::accuracy(const SurfaceFabric* surface) {
  const Stage stage = accuracy_stage(surface);
  return artifact_of(stage, [&](const fs::path& path, StageResult&) {
    AccuracyTable table;
    if (surface == nullptr) {
      table = measure_accuracy_table();
    } else {
      Progress progress(*context_->console, stage.name, "%", 100);
      table = measure_surface_accuracy(exemplar(), *surface, document_.config.seed,
                                       percent_of(progress));
    }
    table.fabric = document_.config.name;
    table.key = stage.key;
    write_accuracy(path, table);
  });
}

AccuracyTable FabricStages::measure_accuracy_table() {
  AccuracyData data;
  std::map<CostKey, WorkTime> costs;
  // What is built with one setting changed; the other stages have their own costs.
  const auto note_cost_of = [&costs](FabricStages& stages, const char* stage,
                                     const std::string& setting) {
    for (const StageCost& cost : stages.costs(kEverything)) {
      if (cost.stage == stage && cost.seconds >= 0)
        costs[{stage, setting}] = {cost.seconds, cost.core_seconds};
    }
  };
  data.pack = load_pack(pack(kEverything).path);
  for (const StageCost& cost : this->costs(kEverything)) {
    if (cost.seconds >= 0) costs[{cost.stage}] = {cost.seconds, cost.core_seconds};
  }
  for (const double factor : kOtherCells) {
    FabricStages other(document_.file, *context_, {.cell_size = factor});
    data.cells.emplace(factor, read_transfer(other.transfer({}).path));
    note_cost_of(other, "transfer", cells_setting(factor));
  }
  for (const double factor : kOtherVoxels) {
    FabricStages other(document_.file, *context_, {.voxel_rate = factor});
    data.voxels.emplace(factor, read_id_volume(other.volume().path));
    note_cost_of(other, "voxelize", voxels_setting(factor));
  }
  if (const auto whole = costs.find({"transfer"}); whole != costs.end()) {
    for (const int order : kOtherOrders) {
      if (order >= data.pack.transfer->order) continue;
      const double ratio = transfer_order_ratio(order);
      costs[{"transfer", order_setting(order)}] = {ratio * whole->second.seconds,
                                                   ratio * whole->second.core_seconds};
    }
  }
  Progress progress(*context_->console, "accuracy", "%", 100);
  AccuracyTable table = measure_accuracy(data, document_.config.seed, percent_of(progress));
  table.costs = std::move(costs);
  return table;
}

/// Time of a few cells' transfer to this order, relative to the fabric's own.
double FabricStages::transfer_order_ratio(int order) {
  constexpr std::uint32_t kCells = 16;
  const auto seconds_to = [&](std::optional<int> highest) {
    const auto work = transfer_work(transfer_settings(highest));
    const Stopwatch watch;
    work->baker->bake(0, std::min(kCells, work->baker->cell_count()));
    return watch.elapsed().seconds;
  };
  return seconds_to(order) / seconds_to({});
}

std::vector<StageForecast> FabricStages::forecast(std::optional<int> order) {
  const auto is_present = [this](const Stage& stage) {
    return fs::exists(context_->cache.artifact(stage.name, stage.key, stage.extension));
  };
  const auto time_of = [](std::uint32_t items, const auto& work) {
    const std::uint32_t probes = std::min(items, kForecastProbes);
    const Stopwatch watch;
    for (std::uint32_t k = 0; k < probes; ++k) {
      const auto item = static_cast<std::uint32_t>((static_cast<std::uint64_t>(2 * k + 1) * items) /
                                                   (2 * probes));
      work(item, item + 1);
    }
    return watch.elapsed().core_seconds / probes * items;
  };
  std::vector<StageForecast> forecasts;
  const ExemplarForecast fibers = forecast_exemplar(document_.config);
  forecasts.push_back({.stage = "synth",
                       .present = is_present(synth_stage()),
                       .items = fibers.segments,
                       .unit = "segments",
                       .bytes = fibers.bytes});
  const auto segments = static_cast<std::uint32_t>(exemplar().segment_count());
  const bool both_sides = document_.config.light_from_both_sides;
  StageForecast maps{
      .stage = "maps",
      .present = is_present(maps_stage()) || (is_present(ssdf_stage()) && is_present(sg_stage())),
      .items = static_cast<double>(segments),
      .unit = "segments",
      .bytes = maps_bytes(segments, both_sides)};
  if (!maps.present) {
    // All origins are found once: that is no part of the time per segment.
    const SegmentOrigins& from = origins();
    maps.core_seconds = time_of(segments, [&](std::uint32_t first, std::uint32_t end) {
      bake_visibility_maps(scene(), from, both_sides, first, end);
    });
  }
  forecasts.push_back(maps);
  const TransferSettings settings = transfer_settings(order);
  StageForecast transfer{
      .stage = "transfer", .present = is_present(transfer_stage(settings)), .unit = "cells"};
  if (!transfer.present) {
    const auto work = transfer_work(settings);
    const std::uint32_t cells = work->baker->cell_count();
    transfer.items = cells;
    transfer.bytes = transfer_bytes(cells, settings.order);
    transfer.core_seconds = time_of(
        cells, [&](std::uint32_t first, std::uint32_t end) { work->baker->bake(first, end); });
  }
  forecasts.push_back(transfer);
  Needs needs = kEverything;
  needs.order = order;
  for (const StageCost& cost : costs(needs)) {
    for (StageForecast& stage : forecasts) {
      if (stage.present && stage.stage == cost.stage && cost.seconds >= 0)
        stage.core_seconds = cost.core_seconds;
    }
  }
  return forecasts;
}

void FabricStages::transfer_shard(std::optional<int> order, Shard shard) {
  const TransferSettings settings = transfer_settings(order);
  const Stage stage = transfer_stage(settings);
  run_shard(stage, [&](StageResult& result) {
    const auto work = transfer_work(settings);
    finish_chunks(stage, work->baker->cell_count(), kCellsPerChunk, "cells", shard, result,
                  [&](const fs::path& file, std::uint32_t first, std::uint32_t end) {
                    work->compute(file, first, end);
                  });
  });
}

}  // namespace heddle
