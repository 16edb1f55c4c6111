#ifndef HEDDLE_PIPELINE_PLAN_SCENE_PLAN_H_
#define HEDDLE_PIPELINE_PLAN_SCENE_PLAN_H_
// From a scene and a tolerance to the cheapest way of making its picture that is good enough. What
// is known of the ways:
//
//   a pilot of the view itself     a few path-traced samples of blocks of pixels: noise and speed
//                                  of path tracing here, which cloth covers how much, from how far,
//                                  how lights reach it
//   the fabrics' accuracy tables   error, noise and speed of the other ways against path tracing,
//                                  by light and footprint, and what their data take to build
//   the cache                      which data are there already
//   more pilots                    of the way that looks cheapest, where its data are there or may
//                                  be built
//   light between cloths           (and between slopes of one), which is missing from dual
//                                  scattering and the precomputed methods: what they see of each
//                                  other (enclosure.h), and paths of the pilot with and without
//                                  what they meet beyond the cloth that they leave
//   two orders of the transfer     of a flat scene: how much this view and these lights ask of it
//
// Ways: path tracing, 6 scattering events of it, dual scattering; and the precomputed methods with,
// for each fabric, the size of its cells and the order of its transfer, voxels, and the form of
// visibility of the Gaussian lights; each also with the farthest cloths drawn by their
// `far_surface`. Fabrics share method and form of visibility, pieces of one fabric its data.
// Errors: ConfigError, FileError, Interrupted. Tested in tests/pipeline/plan_test.cpp and
// end_to_end_test.cpp.

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/plan/accuracy_table.h"
#include "pipeline/plan/planner.h"
#include "pipeline/scene_job.h"

namespace heddle {

struct PlanQuestion {
  std::filesystem::path scene;
  std::string view;        // the scene's first where empty
  std::vector<int> crop;   // x0, y0, x1, y1, or empty
  double tolerance = 0;    // relative RMSE of the picture against path tracing, its noise included
  int pictures = 1;        // that share the data: frames of a shot
  bool may_build = false;  // data of the way that looks cheapest, to try it
};

/// A way to make the picture.
struct Way {
  std::string
      // "path", "path-6", "dual-scattering", "exact", "volume"; with "+ surfaces" where some cloth
      // is one
      family;
  RenderMethod method = RenderMethod::kPath;
  SceneVariant variant;
  // against what the method claims to compute: the candidate's without the light between cloths
  Estimate bias_square;
  // of the picture's mean radiance, relative, as the tables have it; part of bias_square
  double mean_error = 0;
  Candidate candidate;
  /// What the pilot said of its error, against paths that miss nothing.
  struct Pilot {
    Estimate bias_square;
    double samples;  // of paths
    double unseen;   // share of the picture's pixels
    // Rare large squares make the mean, and a pilot that has met none of them says too little: it
    // is believed only of a way that would not do otherwise.
    bool may_lower;
  };
  std::optional<Pilot> pilot = {};  // of one of its kind at most
  bool tried = false;               // it or one of its kind: noise and speed are this view's own
  std::string kind() const;
};

/// Renders fibers from precomputed data, as the paper's methods do.
inline bool is_precomputed(RenderMethod method) {
  return method == RenderMethod::kExact || method == RenderMethod::kVolume;
}

/// Ways that share their errors, noise and speed up to what tables tell apart: what a pilot finds
/// of one holds of all.
inline std::string Way::kind() const {
  if (!is_precomputed(method)) return family;
  return variant.stand_ins.empty() ? "precomputed" : "precomputed + surfaces";
}

/// What the pilot saw of one cloth of the scene.
struct SeenCloth {
  double share = 0;         // of the view's pixels
  double light_share = 0;   // of the picture's light
  double footprint_mm = 0;  // of a pixel on the cloth, geometric mean
};

struct ScenePlan {
  PlanQuestion question;
  SceneConfig scene;
  // of the view: camera, crop, seed; method and samples are the chosen way's, if there is one
  PictureRequest request;
  std::vector<SeenCloth> seen;  // [cloth of the scene]
  std::vector<Way> ways;
  std::optional<std::size_t> chosen;  // of ways
  std::optional<Offer> offer;         // of the chosen one
  double best_tolerance = 0;          // that any way meets
  // that the plan took, without building data and loading the scene
  WorkTime time;
  std::string note;  // why no table was asked, or empty
};

ScenePlan make_plan(const PlanQuestion& question, StageContext& context);

/// For people, and for programs.
std::string plan_text(const ScenePlan& plan);
nlohmann::ordered_json plan_json(const ScenePlan& plan);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_SCENE_PLAN_H_
