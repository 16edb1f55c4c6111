#include "pipeline/surface_stages.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "formats/content_hash.h"
#include "pipeline/interrupt.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
/// All that a weighting table depends on.
std::string weights_text(const MicrocylinderFabric& fabric, const InteractiveSettings& settings) {
  nlohmann::json tangents = nlohmann::json::array();
  for (const TangentSample& sample : tangent_samples(fabric, settings.most_tangents)) {
    tangents.push_back({sample.thread, sample.direction, sample.sine, sample.cosine, sample.share});
  }
  nlohmann::json shares = nlohmann::json::array();
  for (const MicrocylinderThread& thread : fabric.threads) shares.push_back(thread.share);
  const WeightingTableSettings& table = settings.table;
  return nlohmann::json{{"tangents", tangents},
                        {"shares", shares},
                        {"blend", fabric.conventions.blend},
                        {"table", {table.columns, table.rows, table.contribution}}}
      .dump();
}

nlohmann::json list(const Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// What moves a shape; nothing where nothing does.
nlohmann::json placement_text(const Placement& placement) {
  if (placement.is_identity()) return {};
  return {placement.scale, list(placement.rotate), list(placement.translate_mm)};
}

nlohmann::json mesh_text(const MeshFile& mesh) {
  nlohmann::json text = {content_hash_of_file(mesh.path), mesh.mm_per_unit};
  // Only what is asked for: older scenes keep their keys.
  if (!mesh.group.empty()) text.push_back({{"group", mesh.group}});
  if (mesh.is_smooth()) {
    text.push_back({{"subdivide", mesh.subdivide},
                    {"px", mesh.subdivide_px.value_or(0)},
                    {"sharp_corners", mesh.sharp_corners},
                    {"near_vertices", mesh.near_vertices}});
  }
  if (!mesh.placement.is_identity()) text.push_back(placement_text(mesh.placement));
  return text;
}

/// The shapes of everything in a scene.
std::string geometry_text(const SceneConfig& config,
                          const std::function<std::string(const fs::path&)>& geometry_key) {
  nlohmann::json cloths = nlohmann::json::array();
  for (const ClothConfig& cloth : config.cloths) {
    nlohmann::json shape = {{"underlay", cloth.underlay}};
    if (cloth.mesh) {
      shape["mesh"] = mesh_text(*cloth.mesh);
    } else {
      shape["flat_mm"] = {cloth.flat_width_mm, cloth.flat_height_mm};
      if (!cloth.flat_placement.is_identity())
        shape["placement"] = placement_text(cloth.flat_placement);
    }
    if (cloth.thickness != 1) shape["thickness"] = cloth.thickness;
    if (!cloth.surface) shape["fibers"] = geometry_key(cloth.fabric);
    if (cloth.pattern) {
      for (const fs::path& file : cloth.pattern->fabrics)
        shape["pattern"].push_back(geometry_key(file));
    }
    if (cloth.yarn_drift) {
      const YarnDriftConfig& drift = *cloth.yarn_drift;
      shape["yarn_drift"] = {drift.spacing_rms, drift.across_mm, drift.along_mm, drift.seed};
    }
    cloths.push_back(shape);
  }
  nlohmann::json meshes = nlohmann::json::array();
  for (const MeshFile& mesh : config.meshes) meshes.push_back(mesh_text(mesh));
  nlohmann::json text = {{"cloths", cloths}, {"meshes", meshes}};
  if (is_cut_for_pictures(config)) {
    for (const CameraConfig& camera : cameras_of_cuts(config)) {
      text["views"].push_back({list(camera.position), list(camera.look_at), list(camera.up),
                               camera.fov, camera.fov_axis == FovAxis::kHorizontal, camera.width,
                               camera.height});
    }
  }
  return text.dump();
}

Stage maps_stage(const std::string& geometry, std::size_t cloth, ClothSide side) {
  return make_stage(
      "surface-maps", ".safetensors", geometry,
      {{"cloth", fmt::format("{}", cloth)}, {"side", side == ClothSide::kFace ? "face" : "back"}});
}

}  // namespace

SurfaceStages::SurfaceStages(const SceneConfig& config, StageContext& context,
                             const std::function<std::string(const fs::path&)>& geometry_key)
    : context_(&context) {
  std::string geometry;
  for (const ClothConfig& cloth : config.cloths) {
    if (!cloth.surface) continue;
    const std::size_t index = surfaces_.size();
    surfaces_.emplace_back();
    if (cloth.surface_method != SurfaceMethod::kInteractive) continue;
    if (geometry.empty()) geometry = geometry_text(config, geometry_key);
    surfaces_.back() = Surface{&*cloth.surface,
                               make_stage("surface-weights", ".safetensors",
                                          weights_text(*cloth.surface->interactive, {}), {}),
                               maps_stage(geometry, index, ClothSide::kFace),
                               maps_stage(geometry, index, ClothSide::kBack)};
  }
}

std::vector<std::string> SurfaceStages::keys() const {
  std::vector<std::string> keys;
  for (const std::optional<Surface>& surface : surfaces_) {
    if (!surface) continue;
    for (const Stage* stage : {&surface->weights, &surface->face, &surface->back})
      keys.push_back(stage->key);
  }
  return keys;
}

std::vector<StageCost> SurfaceStages::costs() const {
  std::map<std::string, StageCost> by_key;  // cloths of one fabric share their table
  for (const std::optional<Surface>& surface : surfaces_) {
    if (!surface) continue;
    for (const Stage* stage : {&surface->weights, &surface->face, &surface->back}) {
      by_key.emplace(stage->key, recorded_cost(*stage, context_->cache));
    }
  }
  std::vector<StageCost> costs;
  for (auto& [key, cost] : by_key) costs.push_back(std::move(cost));
  return costs;
}

std::shared_ptr<const DistanceMaps> SurfaceStages::maps(const Surface& surface, ClothSide side,
                                                        const ClothScene& scene,
                                                        const SurfaceCloth& cloth) const {
  const Stage& stage = side == ClothSide::kFace ? surface.face : surface.back;
  const Artifact artifact = provide_artifact(
      stage, surface.fabric->name, *context_, [&](const fs::path& path, StageResult&) {
        Progress progress(*context_->console, stage.name, "vertices", cloth.vertex_count());
        const auto vertex_done = [&progress] {
          stop_if_interrupted();
          progress.advance(1);
        };
        bake_distance_maps(scene, cloth, side, vertex_done).write(path, stage.metadata);
      });
  return std::make_shared<const DistanceMaps>(
      DistanceMaps::read(artifact.path, cloth.vertex_count()));
}

std::vector<std::shared_ptr<const InteractiveSurface>> SurfaceStages::load(
    const ClothScene& scene) const {
  std::vector<std::shared_ptr<const InteractiveSurface>> loaded;
  // by the fabric's text
  std::map<std::string, std::shared_ptr<const InteractiveMicrocylinder>> models;
  for (const std::optional<Surface>& surface : surfaces_) {
    const SurfaceCloth& cloth = scene.surfaces()[loaded.size()];
    loaded.emplace_back();
    if (!surface) continue;
    const MicrocylinderFabric& fabric = *surface->fabric->interactive;
    auto& model = models[surface->fabric->text];
    if (!model) {
      const InteractiveSettings settings;
      const std::vector<TangentSample> tangents = tangent_samples(fabric, settings.most_tangents);
      const Artifact table =
          provide_artifact(surface->weights, surface->fabric->name, *context_,
                           [&](const fs::path& path, StageResult&) {
                             WeightingTable(fabric, tangents, settings.weighting, settings.table)
                                 .write(path, surface->weights.metadata);
                           });
      model = std::make_shared<const InteractiveMicrocylinder>(
          fabric, settings, WeightingTable::read(table.path, tangents.size()));
    }
    loaded.back() = std::make_shared<const InteractiveSurface>(
        model, maps(*surface, ClothSide::kFace, scene, cloth),
        maps(*surface, ClothSide::kBack, scene, cloth));
  }
  return loaded;
}

}  // namespace heddle
