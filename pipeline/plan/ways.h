#ifndef HEDDLE_PIPELINE_PLAN_WAYS_H_
#define HEDDLE_PIPELINE_PLAN_WAYS_H_
// The candidate ways to make a picture: path tracing, and the precomputed methods with the size of
// cells, the order of the transfer, voxels, and the form of visibility of the Gaussian lights; each
// also with the farthest cloths drawn by their `far_surface`. All fabrics share the settings. Pure
// functions. Tested in tests/pipeline/plan_test.cpp.

#include <string>
#include <vector>

#include "pipeline/plan/fabric_tables.h"
#include "pipeline/plan/view_facts.h"
#include "pipeline/scene_job.h"

namespace heddle {

/// Method and settings of a way.
struct WaySettings {
  RenderMethod method = RenderMethod::kPath;
  SceneVariant variant;
  bool operator==(const WaySettings&) const = default;
};

/// Renders fibers from precomputed data, as the paper's methods do.
bool is_precomputed(RenderMethod method);

/// Light that leaves a cloth is lost to it.
bool lacks_light_between(const WaySettings& way);

/// Method, with "+ surfaces" where some cloth is drawn by a surface model.
std::string family_of(const WaySettings& way);

/// Ways of one kind share their noise and speed up to what tables tell apart: what a pilot finds of
/// one holds of all.
std::string kind_of(const WaySettings& way);

/// For people: method and what differs from the fabrics' own settings.
std::string name_of(const WaySettings& way, const SceneConfig& scene);
/// All ways but path tracing.
std::vector<WaySettings> other_ways(const SceneConfig& scene, const ViewFacts& view,
                                    const FabricTables& tables);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_WAYS_H_
