#include "pipeline/plan/fabric_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/plan/policy.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

std::pair<fs::path, std::string> surface_key(const ClothConfig& cloth) {
  return {cloth.fabric, cloth.far_surface->text};
}

/// What a stage's artifact takes to build, by the table.
double predicted_seconds(const AccuracyTable& table, const std::string& stage,
                         const SceneVariant::OfFabric& of) {
  const auto seconds_of = [&](const std::string& setting) {
    const auto found = table.costs.find({stage, setting});
    if (found == table.costs.end()) return 0.0;
    return table.threads == working_threads() ? found->second.seconds
                                              : found->second.core_seconds / working_threads();
  };
  if (stage == "voxelize" && of.variant.voxel_rate != 1)
    return seconds_of(voxels_setting(of.variant.voxel_rate));
  double seconds = seconds_of("");
  if (stage != "transfer" || !(seconds > 0)) return seconds;
  if (of.variant.cell_size != 1) seconds = seconds_of(cells_setting(of.variant.cell_size));
  if (of.order) seconds *= seconds_of(order_setting(*of.order)) / seconds_of("");
  return seconds;
}

}  // namespace

bool shows_fibers(const SceneConfig& scene, const ViewFacts& view, std::size_t cloth) {
  return !scene.cloths[cloth].surface && view.cloths[cloth].share > 0;
}

bool draws_fibers(const SceneConfig& scene, const SceneVariant& variant, const fs::path& fabric) {
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    const ClothConfig& cloth = scene.cloths[k];
    if (!cloth.surface && cloth.fabric == fabric && !variant.stand_ins.contains(k)) return true;
  }
  return false;
}

const FabricFacts& FabricTables::of(const fs::path& file) const {
  const auto found = std::find_if(fabrics.begin(), fabrics.end(),
                                  [&](const FabricFacts& fabric) { return fabric.file == file; });
  assert(found != fabrics.end());
  return *found;
}

const AccuracyTable& FabricTables::of_far_surface(const ClothConfig& cloth) const {
  return surfaces.at(surface_key(cloth));
}

FabricLibrary::FabricLibrary(const SceneConfig& scene, StageContext& context)
    : scene_(&scene), context_(&context) {
  for (const ClothConfig& cloth : scene.cloths) {
    const auto is_same = [&](const FabricFacts& fabric) { return fabric.file == cloth.fabric; };
    if (cloth.surface || std::any_of(tables_.fabrics.begin(), tables_.fabrics.end(), is_same))
      continue;
    FabricFacts fabric;
    fabric.file = cloth.fabric;
    const FabricDocument& document = stages_of(fabric, {}).document();
    fabric.name = document.config.name;
    fabric.order = document.transfer.order;
    fabric.light_from_both_sides = document.config.light_from_both_sides;
    tables_.fabrics.push_back(std::move(fabric));
  }
}

FabricLibrary::~FabricLibrary() = default;

FabricStages& FabricLibrary::stages_of(const FabricFacts& fabric, const FabricVariant& variant) {
  std::unique_ptr<FabricStages>& stages = stages_[{fabric.file, variant}];
  if (!stages) stages = std::make_unique<FabricStages>(fabric.file, *context_, variant);
  return *stages;
}

std::string FabricLibrary::read_tables(double path_samples) {
  for (FabricFacts& fabric : tables_.fabrics) {
    FabricStages& stages = stages_of(fabric, {});
    if (!fs::exists(stages.accuracy_place().path) && path_samples < kPolicy.table_samples) {
      return fmt::format(
          "nothing is known of what else {} allows: path tracing takes less time than measuring "
          "it (heddle accuracy)",
          fabric.name);
    }
    fabric.table = read_accuracy(stages.accuracy().path);
  }
  for (const ClothConfig& cloth : scene_->cloths) {
    if (!cloth.far_surface) continue;
    FabricStages& stages = stages_of(tables_.of(cloth.fabric), {});
    tables_.surfaces.try_emplace(surface_key(cloth),
                                 read_accuracy(stages.accuracy(&*cloth.far_surface).path));
  }
  return "";
}

double FabricLibrary::build_seconds(RenderMethod method, const SceneVariant& variant) {
  double sum = 0;
  for (const FabricFacts& fabric : tables_.fabrics) {
    if (!draws_fibers(*scene_, variant, fabric.file)) continue;
    const SceneVariant::OfFabric of = variant.of(fabric.file);
    Needs needs = needs_of(method, scene_->lights, variant.blend);
    needs.order = of.order;
    for (const StageCost& cost : stages_of(fabric, of.variant).costs(needs)) {
      if (!cost.present) sum += predicted_seconds(fabric.table, cost.stage, of);
    }
  }
  return sum;
}

}  // namespace heddle
