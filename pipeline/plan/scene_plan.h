#ifndef HEDDLE_PIPELINE_PLAN_SCENE_PLAN_H_
#define HEDDLE_PIPELINE_PLAN_SCENE_PLAN_H_
// From a scene and a tolerance to the cheapest way of making its picture that is good enough
// (docs/plan-method.md). Data go one way:
//
//   pilot.h          a few path-traced samples of the view
//   view_facts.h     which cloth covers how much, from how far, how lights reach it
//   fabric_tables.h  the fabrics' accuracy tables, and what their data take to build
//   ways.h           the candidate ways
//   prior.h          what is expected of each by the tables
//   evidence.h       what pilots add to that; findings.h holds both
//   choice.h         samples, costs, and the cheapest that is good enough
//   search.h         which pilots are worth their time
//
// Errors: ConfigError, FileError, Interrupted. Tested in tests/pipeline/plan_test.cpp and
// end_to_end_test.cpp.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/plan/findings.h"
#include "pipeline/plan/search.h"
#include "pipeline/scene_job.h"

namespace heddle {

struct PlanQuestion {
  std::filesystem::path scene;
  std::string view;       // the scene's first where empty
  std::vector<int> crop;  // x0, y0, x1, y1, or empty
  Target target;
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
  WorkTime time;     // that the plan took, without building data and loading the scene
  std::string note;  // why no table was asked, or empty
};

ScenePlan make_plan(const PlanQuestion& question, StageContext& context);

/// For people, and for programs.
std::string plan_text(const ScenePlan& plan);
nlohmann::ordered_json plan_json(const ScenePlan& plan);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_SCENE_PLAN_H_
