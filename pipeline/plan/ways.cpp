#include "pipeline/plan/ways.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "pipeline/accuracy/measure_accuracy.h"

namespace heddle {
namespace {

/// How the farthest cloths may be surfaces: none, the farthest, the two farthest, ...
std::vector<std::set<std::size_t>> stand_ins(const SceneConfig& scene, const ViewFacts& view) {
  std::vector<std::size_t> cloths;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    if (scene.cloths[k].far_surface && shows_fibers(scene, view, k)) cloths.push_back(k);
  }
  std::sort(cloths.begin(), cloths.end(), [&](std::size_t a, std::size_t b) {
    return view.cloths[a].footprint_mm > view.cloths[b].footprint_mm;
  });
  std::vector<std::set<std::size_t>> sets(1);
  for (const std::size_t cloth : cloths) {
    sets.push_back(sets.back());
    sets.back().insert(cloth);
  }
  return sets;
}

/// Forms of visibility that the scene's lights tell apart.
std::vector<VisibilityBlend> forms_of_visibility(const std::vector<Light>& lights) {
  const VisibilityBlend usual;
  bool any_by_lobes = false;
  bool any_by_distance = false;
  for (const Light& light : lights) {
    if (light.is_directional()) continue;
    any_by_lobes = any_by_lobes || usual.uses_lobes(light.sharpness);
    any_by_distance = any_by_distance || usual.uses_distance(light.sharpness);
  }
  std::vector<VisibilityBlend> list = {usual};
  if (any_by_lobes) list.push_back(kSignedDistanceOnly);
  if (any_by_distance) list.push_back(kLobesOnly);
  return list;
}

/// Every choice of cells, order and voxels that all fabrics allow.
std::vector<SceneVariant::OfFabric> fabric_settings(RenderMethod method,
                                                    const std::vector<FabricFacts>& fabrics) {
  std::vector<double> cells = {1};
  cells.insert(cells.end(), std::begin(kOtherCells), std::end(kOtherCells));
  std::vector<double> voxels = {1};
  if (method == RenderMethod::kVolume)
    voxels.insert(voxels.end(), std::begin(kOtherVoxels), std::end(kOtherVoxels));
  std::vector<SceneVariant::OfFabric> list;
  for (const double voxel_rate : voxels) {
    for (const double cell_size : cells) {
      const FabricVariant variant{.cell_size = cell_size, .voxel_rate = voxel_rate};
      list.push_back({{}, variant});
      for (const int order : kOtherOrders) {
        const auto is_lower = [&](const FabricFacts& fabric) { return order < fabric.order; };
        if (std::all_of(fabrics.begin(), fabrics.end(), is_lower)) list.push_back({order, variant});
      }
    }
  }
  return list;
}

/// Settings of the fabrics, which all share.
SceneVariant::OfFabric shared_settings(const WaySettings& way) {
  return way.variant.fabrics.empty() ? SceneVariant::OfFabric{}
                                     : way.variant.fabrics.begin()->second;
}

}  // namespace

bool is_precomputed(RenderMethod method) {
  return method == RenderMethod::kExact || method == RenderMethod::kVolume;
}

bool lacks_light_between(const WaySettings& way) {
  return !traces_paths(way.method) || !way.variant.stand_ins.empty();
}

std::string family_of(const WaySettings& way) {
  return std::string(render_method_name(way.method)) +
         (way.variant.stand_ins.empty() ? "" : " + surfaces");
}

std::string kind_of(const WaySettings& way) {
  if (!is_precomputed(way.method)) return family_of(way);
  return way.variant.stand_ins.empty() ? "precomputed" : "precomputed + surfaces";
}

std::string name_of(const WaySettings& way, const SceneConfig& scene) {
  std::string name = render_method_name(way.method);
  const SceneVariant::OfFabric of = shared_settings(way);
  if (way.variant.blend == kSignedDistanceOnly) name += fmt::format(", {}", kDistanceSetting);
  if (way.variant.blend == kLobesOnly) name += fmt::format(", {}", kGaussiansSetting);
  if (of.variant.cell_size != 1) name += ", " + cells_setting(of.variant.cell_size);
  if (of.order) name += ", " + order_setting(*of.order);
  if (of.variant.voxel_rate != 1) name += ", " + voxels_setting(of.variant.voxel_rate);
  for (const std::size_t k : way.variant.stand_ins)
    name += fmt::format(", cloth {} as {}", k + 1, scene.cloths[k].far_surface->name);
  return name;
}

std::vector<WaySettings> other_ways(const SceneConfig& scene, const ViewFacts& view,
                                    const FabricTables& tables) {
  std::vector<WaySettings> ways;
  for (const std::set<std::size_t>& far : stand_ins(scene, view)) {
    SceneVariant variant;
    variant.stand_ins = far;
    if (!far.empty()) ways.push_back({RenderMethod::kPath, variant});
    for (const VisibilityBlend& blend : forms_of_visibility(view.lights)) {
      variant.blend = blend;
      for (const RenderMethod method : {RenderMethod::kExact, RenderMethod::kVolume}) {
        for (const SceneVariant::OfFabric& one : fabric_settings(method, tables.fabrics)) {
          variant.fabrics = variant_of_fabrics(scene, one).fabrics;
          ways.push_back({method, variant});
        }
      }
    }
  }
  return ways;
}

}  // namespace heddle
