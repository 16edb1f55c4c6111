#ifndef HEDDLE_PIPELINE_CHART_CHART_RUNS_H_
#define HEDDLE_PIPELINE_CHART_CHART_RUNS_H_
// The runs of `heddle chart`: every method at a ladder of settings, as one plain table. A method
// has one row in kLadders (chart_runs.cpp); everything else (measuring, tables, charts) goes by
// what the runs say. docs/chart.md lists the ladders. Tested in tests/pipeline/chart_test.cpp.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/scene_job.h"

namespace heddle {

struct ChartRun {
  std::string method;               // the curve that the point lies on
  std::string label;                // of the point: what changes along the curve
  nlohmann::ordered_json settings;  // flat: name -> number or string
  SceneVariant variant;
  PictureRequest request;
};

struct ChartLadders {
  bool quick = false;  // one or two rungs each, and none that needs a transfer of its own
  int spp = 64;        // of curves along which something else changes: noise must not hide it
};

/// base: camera, crop and seed of the picture. Runs of one method lie together, from its cheapest
/// setting to its dearest where that is known beforehand; forms of visibility are there where some
/// light of the scene can tell them apart.
std::vector<ChartRun> chart_runs(const SceneConfig& scene, const PictureRequest& base,
                                 const ChartLadders& ladders);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CHART_CHART_RUNS_H_
