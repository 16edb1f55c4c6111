#ifndef HEDDLE_PIPELINE_CHART_CHART_H_
#define HEDDLE_PIPELINE_CHART_CHART_H_
// Speed against accuracy: what every run of a table cost, and how far its picture is from a
// path-traced reference. Runs go one after the other in one process, so that all have the same
// machine and threads. docs/chart.md explains everything that is written. The JSON follows
// docs/chart-schema.json. Tested in tests/pipeline/chart_test.cpp.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/chart/chart_runs.h"
#include "render/image_metrics.h"

namespace heddle {

/// What a picture is measured against.
enum class ReferenceKind : std::uint8_t {
  kFull,   // all light
  kLocal,  // paths that leave the cloth's shell end: what the precomputed methods claim to compute
};
inline constexpr ReferenceKind kReferenceKinds[] = {ReferenceKind::kFull, ReferenceKind::kLocal};
const char* reference_name(ReferenceKind kind);

struct ChartError {
  PictureErrorEstimate estimate;
  double flip = 0;
};

/// One run and what came of it.
struct ChartRow {
  ChartRun run;
  std::string key;      // of the picture; empty where the run failed before it was known
  std::string message;  // why the run failed; empty where it did not
  std::string program_version;
  std::vector<StageCost> stages;             // precomputed data that the run needs
  std::optional<double> precompute_seconds;  // sums over the stages; empty where one has no record
  std::optional<double> precompute_core_seconds;
  double render_seconds = 0;
  double render_core_seconds = 0;
  int threads = 0;
  ChartError error[2];  // [ReferenceKind]
  // [ReferenceKind] on the Pareto front of render time against error
  bool front_render[2] = {};
  bool front_total[2] = {};             // [ReferenceKind] the same with the precomputation counted
  std::filesystem::path picture;        // .png, from the chart's folder; so are the differences
  std::filesystem::path difference[2];  // [ReferenceKind]

  bool done() const { return message.empty(); }
  std::optional<double> total_seconds() const {
    if (!precompute_seconds) return {};
    return *precompute_seconds + render_seconds;
  }
};

struct ChartReference {
  PictureRequest request;
  std::string key;
  double seconds = 0;
  double core_seconds = 0;
  ReferenceNoise noise;
  double flip_between_halves = 0;
  std::filesystem::path picture;  // .png, from the chart's folder
};

struct Chart {
  std::string scene;
  std::string scene_file;
  std::string view;
  int width = 0;  // of the picture
  int height = 0;
  PixelRect crop;
  std::string processor;
  int threads = 0;
  ChartReference references[2];  // [ReferenceKind]
  std::vector<ChartRow> rows;    // in the order of the table
};

/// A point of a chart; smaller is better in both.
struct CostAndError {
  double cost = 0;
  double error = 0;
};
/// Is the point on the Pareto front? Then no other has at most its cost and at most its error, one
/// of them less. Points that are not finite are never on it.
std::vector<bool> pareto_front(std::span<const CostAndError> points);

/// Fills front_render and front_total of all rows that are done.
void mark_fronts(Chart& chart);

nlohmann::ordered_json chart_json(const Chart& chart);
/// One line per row under a line of names; fields that hold commas or quotes are quoted (RFC 4180).
std::string chart_csv(const Chart& chart);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CHART_CHART_H_
