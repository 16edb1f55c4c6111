#ifndef HEDDLE_PIPELINE_COMMANDS_H_
#define HEDDLE_PIPELINE_COMMANDS_H_
// What the subcommands do, apart from the parsing of their options (main.cpp). Each returns the
// exit status: 0 done, 1 beyond a limit that was asked for. Failures are exceptions: ConfigError
// (2), FileError (1), Interrupted (128 + signal). Data goes to standard output, messages and
// progress to standard error. Tested in tests/pipeline/end_to_end_test.cpp.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/stages.h"

namespace heddle {

struct CommonOptions {
  std::filesystem::path cache;
  // In place of the fabric's seed, which draws its fibers and what is precomputed for them.
  std::optional<std::uint64_t> fabric_seed;
  // In place of the scene's seed, which draws the noise of its pictures.
  std::optional<std::uint64_t> picture_seed;
  bool quiet = false;
  bool json = false;  // a report for programs on standard output
};

enum class StageTarget { kSynth, kVisibility, kTransfer, kFar, kPack, kAccuracy };

struct StageOptions {
  std::filesystem::path fabric;
  StageTarget target = StageTarget::kPack;
  std::optional<int> order;
  std::optional<Shard> shard;                    // visibility and transfer
  std::optional<std::filesystem::path> preview;  // synth: a picture of the tile
  bool dry_run = false;                          // precompute: only say what it would take
  std::optional<std::filesystem::path> output;   // pack: a copy outside the cache
};
/// Prints the path of the artifact.
int stage_command(const StageOptions& options, const CommonOptions& common);

struct SwatchOptions {
  std::filesystem::path fabric;
  std::filesystem::path output;  // .png
  double width_mm = 4;
  int pixels = 256;
  int spp = 16;
};
/// A path-traced picture of a fabric, without a scene (swatch_picture.h).
int swatch_command(const SwatchOptions& options, const CommonOptions& common);

struct CatalogueOptions {
  std::vector<std::filesystem::path> fabrics;
  std::filesystem::path output;  // folder
  int pixels = 256;
  int spp = 32;
};
/// Writes index.html in `output`: of every fabric pictures near and far, its figures, and those of
/// its data as far as the cache holds them, beside table 1 of Khungurn et al. 2017. Builds the
/// fibers only.
int catalogue_command(const CatalogueOptions& options, const CommonOptions& common);

struct RunOptions {
  std::filesystem::path scene;
  std::filesystem::path output;  // folder; out/SCENE where empty
  std::optional<int> order;
};
/// Makes NAME.exr, NAME.png and NAME.json in `output` for every view of the scene. A view that asks
/// for a reference also gets NAME.reference.* (path-traced) and NAME.difference.* of a crop.
/// Pictures are cached like artifacts of stages.
int run_command(const RunOptions& options, const CommonOptions& common);

struct RenderOptions {
  std::filesystem::path scene;
  std::filesystem::path output;
  std::string view;
  std::string method;  // the scene's where empty
  std::optional<int> spp;
  std::optional<double> seconds;  // the path tracer's time
  std::vector<int> crop;          // x0, y0, x1, y1, or empty
  bool local = false;
  std::optional<int> bounces;
  std::string estimator;  // "mis" where empty
  std::optional<int> order;
  std::optional<double> noise;      // at which each block of pixels ends
  std::optional<double> tolerance;  // method, samples and data by a plan
  int pictures = 1;                 // that the plan reckons with
  std::string frames;               // "first-last"; empty: one picture
  bool resume = false;              // with frames: those that are finished stay
  std::string keep;                 // of the samples, for relight: "rays" or "light"
};
/// With frames: NAME_0000.exr and so on, and NAME_sheet.png (docs/sequences.md). Status 1 if no way
/// meets the tolerance; then nothing is rendered.
int render_command(const RenderOptions& options, const CommonOptions& common);

struct RelightOptions {
  std::filesystem::path kept;    // .gbuffer
  std::filesystem::path scene;   // .toml
  std::filesystem::path output;  // .exr
};
/// The picture that `render` would make of a scene which differs in its lights only from the one
/// that the samples were kept from (docs/relight.md). ConfigError naming what else differs.
int relight_command(const RelightOptions& options, const CommonOptions& common);

struct PlanOptions {
  std::filesystem::path scene;
  std::string view;
  std::vector<int> crop;
  double tolerance = 0;  // relative RMSE
  int pictures = 1;
};
/// Prints what would be built and used, what it costs and why (docs/plan.md). Builds missing
/// accuracy tables unless path tracing is cheaper than that. Status 1 if no way meets the
/// tolerance.
int plan_command(const PlanOptions& options, const CommonOptions& common);

struct CompareOptions {
  std::filesystem::path a;
  std::filesystem::path b;
  std::optional<std::filesystem::path> output;
  std::string layer;  // the beauty where empty
  std::optional<double> max_rmse;
  std::optional<double> max_mean;
};
/// Status 1 if a limit is exceeded; ConfigError (2) if the pictures cannot be compared.
int compare_command(const CompareOptions& options, const CommonOptions& common);

struct ChartOptions {
  std::filesystem::path scene;
  std::filesystem::path output;  // folder
  std::string view;              // the scene's first where empty
  // px; 96 or less where neither is given, the other by the view's shape
  std::optional<int> width;
  std::optional<int> height;
  // x0, y0, x1, y1, or empty; of the view's own frame if no width or height is given
  std::vector<int> crop;
  std::vector<std::string> methods;  // of the runs; all if empty
  int reference_spp = 1024;
  bool quick = false;
  bool resume = false;
};
/// Speed against accuracy, over the methods and their settings. Writes chart.csv, chart.json,
/// chart.svg, chart-local.svg, index.html and runs/ in `output` (docs/chart.md). Status 1 if every
/// run failed.
int chart_command(const ChartOptions& options, const CommonOptions& common);

struct ExportOptions {
  std::filesystem::path input;   // fabric .toml, fibers .safetensors, or pack
  std::filesystem::path output;  // .hair, .bcc or .obj; or a folder
  // Of the maps in a folder: texels along the longer side, rays per texel.
  std::optional<int> pixels;
  std::optional<int> spp;
};
/// Writes the fibers of a tile as curves in millimetres, each over one period, from end to end.
/// Into a folder: a stand-in for renderers that have no fibers (docs/export.md), and prints its
/// error.
int export_command(const ExportOptions& options, const CommonOptions& common);

/// Prints what a file holds.
int info_command(const std::filesystem::path& path, const CommonOptions& common);

/// Throws FileError with the first check that fails.
int check_command(const std::filesystem::path& pack, const CommonOptions& common);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_COMMANDS_H_
