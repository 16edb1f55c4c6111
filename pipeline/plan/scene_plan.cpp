#include "pipeline/plan/scene_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/input_error.h"
#include "pipeline/plan/policy.h"

namespace heddle {
namespace {

Pilot first_pilot(PilotRenderer& renderer) {
  const double pixels = std::clamp(kPolicy.first_share * renderer.picture_pixels(),
                                   static_cast<double>(kPolicy.fewest_pixels),
                                   static_cast<double>(kPolicy.first_pixels));
  renderer.choose_blocks(static_cast<int>(pixels));
  return renderer.render(RenderMethod::kPath, kPolicy.pilot_samples);
}

/// Path-traced samples of all pictures; infinity where path tracing does not meet the tolerance.
double path_samples(const Candidate& path, const Target& target, double pixels) {
  const std::optional<Offer> traced = offer(path, target.tolerance, target.pictures);
  return traced ? static_cast<double>(traced->spp) * pixels * target.pictures : INFINITY;
}

/// Tables of accuracy know cloth of one fabric, and no light from other things.
void refuse_what_no_table_knows(const std::filesystem::path& scene_file, const SceneConfig& scene) {
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    if (!scene.cloths[k].pattern) continue;
    throw ConfigError(fmt::format(
        "{}: a plan knows cloth of one fabric, and cloth {} has a pattern of {}. Choose the "
        "method and the samples instead: --method, --spp",
        scene_file.string(), k + 1, scene.cloths[k].pattern->fabrics.size()));
  }
  for (const MeshConfig& mesh : scene.meshes) {
    if (!mesh.paint) continue;
    const std::string message =
        "a plan knows no light between cloth and coloured meshes. Choose the method and the "
        "samples instead: --method, --spp";
    if (mesh.table) mesh.table->fail("color", message);
    throw ConfigError(scene_file.string() + ": " + message);
  }
}

}  // namespace

ScenePlan make_plan(const PlanQuestion& question, StageContext& context) {
  refuse_what_no_table_knows(question.scene, read_scene_config(TomlTable::load(question.scene)));
  ScenePlan plan;
  plan.question = question;
  const Target& target = question.target;
  PilotRenderer renderer(question.scene, question.view, question.crop, context);
  plan.scene = renderer.scene();
  plan.request = renderer.request();
  renderer.fibers_scene();
  const Stopwatch watch;
  WorkTime measuring_tables;
  Pilot paths = first_pilot(renderer);
  const ViewFacts view = look_at_view(renderer, paths);
  Findings findings(std::move(paths));
  FabricLibrary library(plan.scene, context);
  Search search(target, renderer, view, library, findings);
  // Surface models are lit the same way by all methods.
  if (!library.empty()) {
    const Stopwatch reading;
    plan.note = library.read_tables(
        path_samples(findings.path_candidate(), target, renderer.picture_pixels()));
    measuring_tables = reading.elapsed();
    if (plan.note.empty()) search.add_other_ways();
  }
  plan.chosen = search.choose_way();
  plan.best_tolerance = best_tolerance(findings.candidates());
  plan.time = watch.elapsed() - renderer.loading() - measuring_tables;
  plan.seen = view.cloths;
  plan.ways = findings.take_ways();
  if (!plan.chosen) return plan;
  const Way& way = plan.ways[*plan.chosen];
  plan.offer = offer(way.candidate, target.tolerance, target.pictures);
  plan.request.method = way.settings.method;
  plan.request.spp = plan.offer->spp;
  return plan;
}

}  // namespace heddle
