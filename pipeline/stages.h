#ifndef HEDDLE_PIPELINE_STAGES_H_
#define HEDDLE_PIPELINE_STAGES_H_
// The stages of one fabric, from its config to its pack. A stage is a pure function from (its
// section of the config, upstream artifacts) to one artifact; a stage whose key is in the cache is
// not run, and nothing is built that the caller does not ask for (directly or through what it asks
// for).
//
//   synth       config without the sections below           fibers.safetensors       Exemplar
//   maps        geometry, light_from, seed  in chunks       maps.safetensors         VisibilityMaps
//   ssdf        maps, [visibility]                          ssdf.safetensors         SsdfVisibility
//   sg          maps, [visibility]                          sg.safetensors           SgVisibility
//   transfer    fibers, [transfer], light_from   in chunks  transfer.safetensors     Transfer
//   voxelize    geometry, [volume]                          volume.vdb               IdVolume
//   far         fibers, ssdf, transfer                      far.safetensors          FarTable
//   pack        what the pack is to hold                    folder                   FabricPack
//   accuracy    all of the above                            KEY.json                 AccuracyTable
//
// "Geometry" is a hash of the fibers' shapes: a fabric that differs in its dyes only shares maps,
// ssdf, sg and volume. Keys hold the values of defaults too. An algorithm or a layout that changes
// needs a new version number of its stage (stages.cpp). Errors: ConfigError, FileError,
// Interrupted. Tested in tests/pipeline/end_to_end_test.cpp.

#include <compare>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/fabric_config.h"
#include "fibers/tracing/segment_origins.h"
#include "fibers/tracing/tile_scene.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/cache.h"
#include "pipeline/console.h"
#include "pipeline/work_time.h"
#include "precompute/transfer_bake.h"
#include "precompute/visibility_settings.h"
#include "precompute/voxelize.h"
#include "render/methods.h"
#include "render/scene_config.h"

namespace heddle {

/// All but the far form, which scenes ask for.
inline constexpr Needs kEverything{
    .ssdf = true, .sgs = true, .transfer = true, .volume = true, .far = false, .order = {}};

/// kPrinted: segment origins on the fiber's axis, and sums of Gaussians by the paper's axes,
/// Voronoi weights and sharpness 128, whatever [visibility] says of them (Khungurn 2017,
/// section 4.1). Cells are the leaves of our tree in both.
enum class BakeChoices : std::uint8_t { kShipped, kPrinted };

/// Which of the chunks of a long stage this process does: chunk c where c % count == index.
struct Shard {
  std::uint32_t index = 0;
  std::uint32_t count = 1;
};

/// One line of the job's report.
struct StageResult {
  std::string fabric;
  std::string stage;
  std::string key;
  std::filesystem::path artifact;
  bool built = false;         // false: found in the cache
  std::uint64_t chunks = 0;   // finished by this process
  std::uint64_t resumed = 0;  // chunks found finished
  WorkTime earlier = {};      // that other processes spent on the chunks found
  double seconds = 0;         // of this stage alone
};

/// What stages of several fabrics share during one command.
struct StageContext {
  Cache cache;
  Console* console;
  std::optional<std::uint64_t> fabric_seed;   // in place of every fabric's
  std::optional<std::uint64_t> picture_seed;  // in place of the scene's
  std::vector<StageResult> results;
  WorkTime nested = {};                         // spent by stages that the running stage asked for
  std::set<std::filesystem::path> sound = {};   // artifacts that this command has verified or built
  std::set<std::filesystem::path> broken = {};  // those that it has found broken and named

  /// Says how a stage went, once per key, and notes it for the report.
  void report(StageResult result);
};

/// Settings of a fabric changed for one purpose (a chart), as factors of what its config says; keys
/// change with them.
struct FabricVariant {
  double cell_size = 1;   // of [transfer] cell_mean_free_paths
  double voxel_rate = 1;  // of [volume] voxels_per_radius
  auto operator<=>(const FabricVariant&) const = default;
};

/// Advances a progress of 100 items by the share done; throws where the command was interrupted.
std::function<void(double)> percent_of(Progress& progress);

/// What it took to build an artifact, without what it read, as its record says.
struct StageCost {
  std::string stage;
  std::string key;
  double seconds = 0;
  double core_seconds = 0;  // processor time of all threads
  int threads = 0;
  bool present = false;  // the artifact is in the cache
};

/// What building an artifact is expected to take.
struct StageForecast {
  std::string stage;
  bool present = false;  // in the cache; then its time is that which it took
  double items = 0;
  std::string unit;
  double bytes = 0;         // of memory, at the peak of the stage
  double core_seconds = 0;  // processor time; 0 where it is not known
};

/// A fabric file, read and checked.
struct FabricDocument {
  std::filesystem::path file;
  FabricConfig config;
  VisibilitySettings visibility;
  TransferSettings transfer;
  VolumeSettings volume;
  std::string cloth_text;       // canonical text of what the synth stage depends on
  std::string visibility_text;  // of [visibility]
  std::string transfer_text;    // of [transfer] without order
  std::string volume_text;      // of [volume]
};
FabricDocument read_fabric_document(const std::filesystem::path& path,
                                    std::optional<std::uint64_t> seed,
                                    const FabricVariant& variant = {});

/// Where a stage's artifact lies.
struct Artifact {
  std::string key;
  std::filesystem::path path;
};

/// One stage: where its artifact lies, and what the artifact says of its origin.
struct Stage {
  std::string name;
  std::string extension;
  std::string key;
  std::map<std::string, std::string> metadata;
};
/// `name` is one of the table of versions in stages.cpp.
Stage make_stage(std::string name, std::string extension, const std::string& config,
                 std::vector<std::pair<std::string, std::string>> upstream);

/// Is the artifact in the cache, and as it was written? Reads all of it the first time. A broken
/// one is named on the console.
bool is_sound(const Stage& stage, StageContext& context);

/// The stage's artifact; where the cache lacks it or holds a broken one, build(path, result) makes
/// it under a temporary path, or makes nothing where another process has published it meanwhile.
/// `fabric`: for the report.
Artifact provide_artifact(
    const Stage& stage, const std::string& fabric, StageContext& context,
    const std::function<void(const std::filesystem::path&, StageResult&)>& build);

/// What the artifact took to build, by whatever process; seconds < 0 where there is no record of
/// it.
StageCost recorded_cost(const Stage& stage, const Cache& cache);

/// Rays from which the mean free path of a fabric is estimated: good to about 1 %.
inline constexpr int kMeanFreePathSamples = 20000;

class FabricStages {
 public:
  /// `context` outlives the object. A relative path is taken from the working directory.
  /// Errors: ConfigError where the printed axes, which lie above the horizon, meet light from both
  /// sides.
  FabricStages(const std::filesystem::path& fabric_file, StageContext& context,
               const FabricVariant& variant = {}, BakeChoices choices = BakeChoices::kShipped);
  /// Of a fabric that no file states: it has no accuracy table.
  FabricStages(FabricDocument document, StageContext& context,
               BakeChoices choices = BakeChoices::kShipped);
  ~FabricStages();

  const FabricDocument& document() const { return document_; }
  /// Hash of the fibers' shapes, which are built where missing.
  const std::string& geometry_key();

  /// Each builds its artifact, and what that needs, where the cache lacks it.
  Artifact synth();
  Artifact ssdf();
  Artifact sgs();
  Artifact transfer(std::optional<int> order);
  Artifact volume();
  Artifact far(std::optional<int> order);
  Artifact pack(const Needs& needs);
  /// Key of that pack, which is not built.
  std::string pack_key(const Needs& needs) { return pack_stage(needs).key; }

  /// What the methods are worth on this fabric (pipeline/accuracy/measure_accuracy.h). With a
  /// surface model: what that is worth in place of the fibers.
  Artifact accuracy(const SurfaceFabric* surface = nullptr);
  /// Where that lies, built or not; builds the fibers only.
  Artifact accuracy_place(const SurfaceFabric* surface = nullptr);

  /// What the stages behind pack(needs) took when they were built, by whatever process; seconds < 0
  /// where an artifact came without its record, or is not there. Builds the fibers only.
  std::vector<StageCost> costs(const Needs& needs);

  /// What a pack of everything would take. Builds the fibers, and times the long stages on a few of
  /// their items, spread over all; fits to maps are not told.
  std::vector<StageForecast> forecast(std::optional<int> order);

  /// Computes this shard's chunks and leaves them in the cache; a later run of the stage finds
  /// them.
  void visibility_shard(Shard shard);
  void transfer_shard(std::optional<int> order, Shard shard);

 private:
  struct TransferWork;
  Artifact artifact_of(
      const Stage& stage,
      const std::function<void(const std::filesystem::path&, StageResult&)>& build);
  void fill_pack(const std::filesystem::path& folder, const std::string& key, const Needs& needs);
  template <class Work>
  void run_shard(const Stage& stage, Work&& work);
  template <class Compute>
  bool publish_chunk(const Stage& stage, std::uint32_t first, std::uint32_t end, Compute&& compute);
  /// compute(file, first, end) for those of the shard's chunks that are not on disk. False, as from
  /// the other two, where another process has published the artifact meanwhile.
  template <class Compute>
  bool finish_chunks(const Stage& stage, std::uint32_t items, std::uint32_t per_chunk,
                     const std::string& unit, Shard shard, StageResult& result, Compute&& compute);
  template <class Compute, class Read>
  bool read_chunks(const Stage& stage, std::uint32_t items, std::uint32_t per_chunk,
                   Compute&& compute, Read&& read);

  const Exemplar& exemplar();
  const TileScene& scene();
  const SegmentOrigins& origins();
  const char* light_from() const;
  /// What a key holds besides where the origins are not the default's.
  void append_origins(std::vector<std::pair<std::string, std::string>>& upstream) const;
  Stage maps_stage();
  Artifact maps();
  void compute_maps(const Stage& stage, const std::filesystem::path& file, std::uint32_t first,
                    std::uint32_t end);
  Stage synth_stage() const;
  Stage pack_stage(const Needs& needs);
  Stage fit_stage(const std::string& name);
  Stage ssdf_stage();
  Stage sg_stage();
  Stage volume_stage();
  Stage far_stage(std::optional<int> order);
  Stage accuracy_stage(const SurfaceFabric* surface);
  AccuracyTable measure_accuracy_table();
  double transfer_order_ratio(int order);
  TransferSettings transfer_settings(std::optional<int> order) const;
  Stage transfer_stage(const TransferSettings& settings);
  std::unique_ptr<TransferWork> transfer_work(const TransferSettings& settings);

  FabricDocument document_;
  StageContext* context_;
  OriginChoice origin_choice_ = OriginChoice::kExposed;
  std::optional<Exemplar> exemplar_;
  std::unique_ptr<TileScene> scene_;
  std::optional<SegmentOrigins> origins_;
  std::string geometry_key_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_STAGES_H_
