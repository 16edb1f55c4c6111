#include <iostream>
#include <nlohmann/json.hpp>

#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/plan/scene_plan.h"

namespace heddle {

int plan_command(const PlanOptions& options, const CommonOptions& common) {
  Job job(common);
  const ScenePlan plan = make_plan({.scene = options.scene,
                                    .view = options.view,
                                    .crop = options.crop,
                                    .target = {.tolerance = options.tolerance,
                                               .pictures = options.pictures,
                                               .may_build = false}},
                                   job.context());
  std::cout << (common.json ? plan_json(plan).dump(2) + "\n" : plan_text(plan));
  return plan.chosen ? 0 : 1;
}

}  // namespace heddle
