#include "pipeline/scene_job.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/content_hash.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"
#include "pipeline/border_sample.h"
#include "pipeline/cloth_layout.h"
#include "pipeline/interrupt.h"
#include "pipeline/version.h"
#include "render/cloth_scene.h"
#include "render/noise_target.h"
#include "render/precomputed_renderer.h"
#include "render/render_output.h"
#include "render/scene_layers.h"
#include "render/tone_map.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Version of what all render methods compute; part of every picture's key.
constexpr int kPictureVersion = 3;

std::string camera_text(const CameraConfig& camera) {
  const auto list = [](const Vec3d& v) { return fmt::format("{},{},{}", v.x(), v.y(), v.z()); };
  return fmt::format("position {} look_at {} up {} fov {} {} {}x{}", list(camera.position),
                     list(camera.look_at), list(camera.up), camera.fov,
                     camera.fov_axis == FovAxis::kHorizontal ? "horizontal" : "vertical",
                     camera.width, camera.height);
}

std::string crop_text(const PixelRect& crop) {
  return fmt::format("{},{},{},{}", crop.x0, crop.y0, crop.x0 + crop.width, crop.y0 + crop.height);
}

const char* estimator_name(LightEstimator estimator) {
  switch (estimator) {
    case LightEstimator::kCombined:
      return "mis";
    case LightEstimator::kShadowRays:
      return "light";
    case LightEstimator::kEscapes:
      return "bcsdf";
  }
  return "";
}

PathTracerSettings path_tracer_settings(const PictureRequest& request) {
  PathTracerSettings settings;
  settings.seed = request.seed;
  settings.local = request.local;
  settings.estimator = request.estimator;
  settings.filter = request.filter;
  if (const std::optional<int> most = method_row(request.method).max_scatterings)
    settings.limits.max_scatterings = *most;
  if (request.bounces) settings.limits.max_scatterings = *request.bounces;
  return settings;
}

/// What became of the environments that bright sources are split off from.
void say_environment(Console& console, const FittedLights& fitted) {
  if (fitted.bright_sources == 0) return;
  console.say(
      fmt::format("environment: {} bright {} split off; irradiance is off by {:.2g} % (RMS "
                  "over normals), all light by {:.2g} %",
                  fitted.bright_sources, fitted.bright_sources == 1 ? "source" : "sources",
                  100 * fitted.irradiance_error, 100 * fitted.energy_error));
}

std::vector<fs::path> mesh_files(const SceneConfig& scene) {
  std::vector<fs::path> files;
  for (const ClothConfig& cloth : scene.cloths) {
    if (cloth.mesh) files.push_back(cloth.mesh->path);
  }
  for (const MeshConfig& mesh : scene.meshes) files.push_back(mesh.path);
  return files;
}

}  // namespace

SceneVariant variant_of_fabrics(const SceneConfig& scene, const SceneVariant::OfFabric& of_each) {
  SceneVariant variant;
  if (of_each == SceneVariant::OfFabric{}) return variant;
  for (const ClothConfig& cloth : scene.cloths) {
    for (const fs::path& file : fabric_files(cloth)) variant.fabrics[file] = of_each;
  }
  return variant;
}

SceneVariant variant_of_order(const fs::path& scene_file, std::optional<int> order,
                              std::optional<int> frame) {
  if (!order) return {};
  return variant_of_fabrics(read_scene_config(TomlTable::load(scene_file), frame),
                            {.order = order});
}

/// Packs and geometry of a scene for one method.
struct SceneJob::Loaded {
  std::map<fs::path, FabricPack> packs;  // by fabric file
  std::map<fs::path, std::shared_ptr<const TileScene>> tiles;
  std::vector<const FabricPack*> part_packs;  // [part of the scene]
  std::vector<ClothTiling> tilings;           // [cloth that has a fabric]
  std::unique_ptr<ClothScene> scene;          // of the frame; null where that has changed
  std::vector<BcsdfTable> materials;          // of the scene
  std::vector<std::shared_ptr<const FarForm>> far_forms;               // [part], or none
  std::vector<Warning> warnings;                                       // of the packs
  std::vector<std::shared_ptr<const InteractiveSurface>> interactive;  // [surface cloth]
};

SceneJob::SceneJob(const fs::path& scene_file, StageContext& context, const SceneVariant& variant,
                   std::optional<int> frame)
    : context_(&context), variant_(variant) {
  const TomlTable document = TomlTable::load(scene_file);
  config_ = read_scene_config(document, frame);
  auto text = nlohmann::json::parse(document.canonical_text());
  for (const char* key : {"name", "frame", "camera", "view", "render", "png"}) text.erase(key);
  for (auto& cloth : text.at("cloth")) cloth.erase("surface_method");  // part of the key on its own
  scene_text_ = text.dump();
  for (const std::size_t k : variant.stand_ins)
    config_.cloths.at(k).surface = config_.cloths.at(k).far_surface;
  for (ClothConfig& cloth : config_.cloths) {
    if (variant.surface_method && cloth.surface && cloth.surface->interactive) {
      cloth.surface_method = *variant.surface_method;
    }
  }
  for (ClothConfig& cloth : config_.cloths) {
    if (cloth.pattern && cloth.pattern->borders == PatternBorders::kWoven && !cloth.surface) {
      layouts_.push_back(weave_borders(cloth, scene_file));
      continue;
    }
    std::vector<const FabricConfig*> fabrics;
    for (const fs::path& file : fabric_files(cloth)) {
      auto& stages = fabrics_[file];
      if (!stages) stages = std::make_unique<FabricStages>(file, context, variant.of(file).variant);
      fabrics.push_back(&stages->document().config);
    }
    layouts_.push_back(block_layout(cloth, fabrics, scene_file.string()));
  }
}

BlockLayout SceneJob::weave_borders(ClothConfig& cloth, const fs::path& scene_file) {
  PatternConfig& pattern = *cloth.pattern;
  std::vector<FabricDocument> documents;
  for (const fs::path& file : pattern.fabrics) {
    documents.push_back(
        read_fabric_document(file, context_->fabric_seed, variant_.of(file).variant));
  }
  std::vector<const FabricDocument*> pointers;
  std::vector<const FabricConfig*> fabrics;
  for (const FabricDocument& document : documents) {
    pointers.push_back(&document);
    fabrics.push_back(&document.config);
  }
  BlockLayout layout = *block_layout(cloth, fabrics, scene_file.string());
  BlockMap map{layout.columns, layout.rows, {}};
  for (const BlockLayout::Block& block : layout.pattern)
    map.fabric.push_back(static_cast<std::uint16_t>(block.exemplar));
  const BorderSample sample = choose_border_sample(map, pattern.sample_blocks, layout.seed);
  FabricDocument woven = woven_sample(sample.map, pointers, cloth.blocks->size_repeats);
  context_->console->say(fmt::format(
      "{}: {} x {} blocks; {:.0f} % of the pattern's blocks find all eight neighbours in it, "
      "{:.0f} % the nearest four",
      woven.config.name, sample.map.columns, sample.map.rows, 100 * sample.eight_fit,
      100 * sample.four_fit));
  // Known by a name of its own: its weave is that of this cloth.
  woven.file = fmt::format("{}, woven for cloth {}", woven.file.string(), layouts_.size() + 1);
  pattern.fabrics = {woven.file};
  cloth.fabric = woven.file;
  layout.tile_blocks = {{sample.map.columns, sample.map.rows}};
  for (std::size_t k = 0; k < layout.pattern.size(); ++k)
    layout.pattern[k] = {0, sample.block[k][0], sample.block[k][1]};
  variant_.fabrics.try_emplace(woven.file, variant_.of(documents.front().file));
  auto& stages = fabrics_[woven.file];
  stages = std::make_unique<FabricStages>(std::move(woven), *context_);
  return layout;
}

SceneJob::~SceneJob() = default;

PictureRequest SceneJob::request(const ViewConfig& view) const {
  PictureRequest request;
  request.camera = view.camera;
  request.crop = {0, 0, view.camera.width, view.camera.height};
  request.method = config_.method;
  request.spp = view.spp;
  request.seed = context_->picture_seed.value_or(config_.seed);
  request.filter = config_.filter;
  return request;
}

PictureRequest SceneJob::request_with_layers(const ViewConfig& view) const {
  PictureRequest with_layers = request(view);
  with_layers.layers = config_.layers;
  with_layers.light_groups = true;
  return with_layers;
}

PictureRequest SceneJob::reference_request(const ViewConfig& view) const {
  PictureRequest reference = request(view);
  reference.method = RenderMethod::kPath;
  reference.seed += 1;
  reference.crop = view.reference->crop;
  reference.spp = view.reference->spp;
  reference.local = view.reference->local;
  return reference;
}

VisibilityBlend SceneJob::blend_for(RenderMethod method) const {
  return method_row(method).as_printed ? kPrintedBlend : variant_.blend;
}

Needs SceneJob::needs_for(RenderMethod method, const fs::path& fabric,
                          std::span<const Light> lights) const {
  Needs needs = needs_of(method, lights, blend_for(method));
  needs.order = variant_.of(fabric).order;
  return needs_with_far_forms(needs, method, config_.far_from.has_value(), config_.bounces);
}

std::vector<StageCost> SceneJob::precompute_costs(const PictureRequest& request) {
  packs_for(request.method);
  std::vector<StageCost> all;
  for (auto& [file, stages] : fabrics_for(request.method)) {
    for (StageCost& cost : stages->costs(needs_for(request.method, file)))
      all.push_back(std::move(cost));
  }
  if (!traces_paths(request.method)) {
    loaded_for(request.method);  // the scene, without which its surfaces' data cannot be built
    for (StageCost& cost : surface_stages().costs()) all.push_back(std::move(cost));
  }
  return all;
}

std::vector<Artifact> SceneJob::packs_for(RenderMethod method) {
  std::vector<Artifact> packs;
  for (auto& [file, stages] : fabrics_for(method)) {
    packs.push_back(stages->pack(needs_for(method, file)));
  }
  return packs;
}

SceneJob::Fabrics& SceneJob::fabrics_for(RenderMethod method) {
  if (!method_row(method).as_printed) return fabrics_;
  if (printed_fabrics_.empty()) {
    for (const auto& [file, stages] : fabrics_) {
      printed_fabrics_[file] =
          std::make_unique<FabricStages>(stages->document(), *context_, BakeChoices::kPrinted);
    }
  }
  return printed_fabrics_;
}

std::string SceneJob::picture_key(const PictureRequest& request) {
  StageInputs inputs{"picture",
                     kPictureVersion,
                     {{"scene", scene_text_}, {"camera", camera_text(request.camera)}}};
  auto& values = inputs.values;
  values.emplace_back("method", render_method_name(request.method));
  values.emplace_back("crop", crop_text(request.crop));
  values.emplace_back("sampling", fmt::format("spp {} seed {}", request.spp, request.seed));
  if (!request.filter.is_default()) values.emplace_back("filter", request.filter.text());
  if (request.layers.any()) {
    values.emplace_back("layers",
                        fmt::format("lobes {} surface {} cryptomatte {}", request.layers.lobes,
                                    request.layers.surface, request.layers.cryptomatte));
  }
  if (groups_of(request) > 1) values.emplace_back("light_groups", "apart");
  if (request.noise) values.emplace_back("noise", fmt::format("{}", *request.noise));
  values.emplace_back("paths",
                      fmt::format("local {} bounces {} estimator {}", request.local,
                                  request.bounces.value_or(0), estimator_name(request.estimator)));
  values.emplace_back("visibility",
                      fmt::format("blend {} {}", variant_.blend.from, variant_.blend.to));
  values.emplace_back("shadow_sigma_mm",
                      config_.shadow_sigma_mm ? fmt::format("{}", *config_.shadow_sigma_mm) : "");
  if (config_.bounces > 0) values.emplace_back("bounces", fmt::format("{}", config_.bounces));
  if (config_.far_from) values.emplace_back("far_from", fmt::format("{}", *config_.far_from));
  for (const Artifact& pack : packs_for(request.method)) values.emplace_back("pack", pack.key);
  for (const ClothConfig& cloth : config_.cloths) {
    if (cloth.mesh) values.emplace_back("mesh", content_hash_of_file(cloth.mesh->path));
    if (cloth.surface) values.emplace_back("surface", cloth.surface->text);
    if (cloth.pattern) values.emplace_back("pattern", content_hash_of_file(cloth.pattern->picture));
  }
  if (is_cut_for_pictures(config_)) {
    for (const CameraConfig& camera : cameras_of_cuts(config_))
      values.emplace_back("cut_for", camera_text(camera));
  }
  for (const std::string& surface : surface_stages().keys())
    values.emplace_back("interactive", surface);
  for (const std::size_t k : variant_.stand_ins)
    values.emplace_back("stand_in", fmt::format("{}", k));
  for (const fs::path& map : config_.light_files)
    values.emplace_back("environment", content_hash_of_file(map));
  for (const MeshFile& mesh : config_.meshes)
    values.emplace_back("mesh", content_hash_of_file(mesh.path));
  return stage_key(inputs);
}

std::vector<std::pair<std::string, std::string>> SceneJob::parts_but_lights(
    const PictureRequest& request) {
  std::vector<std::pair<std::string, std::string>> parts;
  const auto add = [&parts](const std::string& name, const std::string& text) {
    parts.emplace_back(name, content_hash(text));
  };
  add("program", fmt::format("{}", kPictureVersion));
  add("camera", camera_text(request.camera));
  const auto optional_text = [](const auto& value) {
    return value ? fmt::format("{}", *value) : std::string();
  };
  add("[render]",
      fmt::format("filter {} sigma {} bounces {} far {} blend {} {}", request.filter.text(),
                  optional_text(config_.shadow_sigma_mm), config_.bounces,
                  optional_text(config_.far_from), variant_.blend.from, variant_.blend.to));
  if (is_cut_for_pictures(config_)) {
    std::string cameras;
    for (const CameraConfig& camera : cameras_of_cuts(config_)) cameras += camera_text(camera);
    add("cameras of all views", cameras);
  }
  const auto scene = nlohmann::json::parse(scene_text_);
  for (const auto& [key, value] : scene.items()) {
    if (key != "cloth" && key != "mesh" && key != "light" && key != "background")
      add(key, value.dump());
  }
  for (std::size_t k = 0; k < config_.cloths.size(); ++k) {
    const ClothConfig& cloth = config_.cloths[k];
    std::string text = scene.at("cloth").at(k).dump();
    if (cloth.mesh) text += content_hash_of_file(cloth.mesh->path);
    if (cloth.surface) text += cloth.surface->text;
    if (cloth.pattern) text += content_hash_of_file(cloth.pattern->picture);
    add(fmt::format("cloth {}", k + 1), text);
  }
  for (std::size_t k = 0; k < config_.meshes.size(); ++k) {
    add(fmt::format("mesh {}", k + 1),
        scene.at("mesh").at(k).dump() + content_hash_of_file(config_.meshes[k].path));
  }
  int fabric = 0;
  for (const auto& [file, stages] : fabrics_for(request.method)) {
    add(fmt::format("fabric {} ({})", ++fabric, file.filename().string()),
        stages->pack_key(needs_for(request.method, file, {})));
  }
  return parts;
}

std::vector<std::string> SceneJob::light_keys(const PictureRequest& request) {
  std::string files;
  for (const fs::path& file : config_.light_files) files += content_hash_of_file(file) + "\n";
  std::string shared = fmt::format("lobes {}\n", request.layers.lobes);
  for (const Artifact& pack : packs_for(request.method)) shared += pack.key + "\n";
  for (const std::string& surface : surface_stages().keys()) shared += surface + "\n";
  const auto scene = nlohmann::json::parse(scene_text_);
  std::vector<std::string> texts(groups_of(request), shared);
  for (std::size_t k = 0; k < config_.lights.size(); ++k) {
    const Light& light = config_.lights[k];
    std::string& text = texts[texts.size() == 1 ? 0 : light.group];
    text += scene.at("light").at(k).dump() + "\n";
    if (light.map || light.texture) text += files;
  }
  for (std::string& text : texts) text = content_hash(text);
  return texts;
}

const SurfaceStages& SceneJob::surface_stages() {
  if (!surface_stages_) {
    surface_stages_.emplace(config_, *context_, [this](const fs::path& fabric) {
      return fabrics_.at(fabric)->geometry_key();
    });
  }
  return *surface_stages_;
}

void SceneJob::show_frame(int frame) {
  const std::vector<fs::path> before = mesh_files(config_);
  heddle::show_frame(config_, frame);
  if (mesh_files(config_) == before) return;
  for (auto& [method, loaded] : loaded_) {
    if (loaded) loaded->scene.reset();
  }
  surface_stages_.reset();
}

const SceneJob::Loaded& SceneJob::loaded_for(RenderMethod method) {
  std::unique_ptr<Loaded>& loaded = loaded_[method];
  if (!loaded) loaded = load_fabrics(method);
  if (!loaded->scene) {
    // cannot be moved: built in place
    loaded->scene.reset(new ClothScene(make_cloth_scene(config_, loaded->tilings)));
    if (!traces_paths(method)) loaded->interactive = surface_stages().load(*loaded->scene);
  }
  return *loaded;
}

std::unique_ptr<SceneJob::Loaded> SceneJob::load_fabrics(RenderMethod method) {
  auto loaded = std::make_unique<Loaded>();
  const std::vector<Artifact> artifacts = packs_for(method);
  std::size_t k = 0;
  for (const auto& [file, stages] : fabrics_) {
    loaded->packs.emplace(file, load_pack(artifacts[k++].path));
    loaded->tiles[file] = std::make_shared<const TileScene>(loaded->packs.at(file).exemplar);
  }
  std::set<fs::path> seen;
  for (std::size_t cloth = 0; cloth < config_.cloths.size(); ++cloth) {
    std::vector<ClothTiling::Tile> tiles;
    for (const fs::path& file : fabric_files(config_.cloths[cloth])) {
      const FabricPack& pack = loaded->packs.at(file);
      loaded->part_packs.push_back(&pack);
      tiles.push_back(loaded->tiles.at(file));
      // In the order of ClothScene::materials: of each fabric once.
      if (seen.insert(file).second) {
        loaded->materials.insert(loaded->materials.end(), pack.materials.begin(),
                                 pack.materials.end());
      }
    }
    if (tiles.empty()) continue;
    if (layouts_[cloth]) {
      loaded->tilings.emplace_back(std::move(tiles), *layouts_[cloth]);
    } else {
      loaded->tilings.emplace_back(tiles.front());
    }
  }
  std::map<const FabricPack*, std::shared_ptr<const FarForm>> far_forms;
  for (const FabricPack* pack : loaded->part_packs) {
    if (!pack->far) break;  // all have it, or none
    std::shared_ptr<const FarForm>& own = far_forms[pack];
    if (!own) own = std::make_shared<const FarForm>(*pack->far);
    loaded->far_forms.push_back(own);
  }
  for (const auto& [file, pack] : loaded->packs) {
    for (Warning& warning : pack_warnings(pack, *loaded->tiles.at(file)))
      loaded->warnings.push_back(std::move(warning));
  }
  return loaded;
}

/// One of the two renderers, set up for a picture.
struct SceneJob::Shading {
  std::vector<std::vector<Light>> lights;                     // [group]
  std::map<const void*, std::vector<BcsdfTable>> reflecting;  // by whose materials they are
  std::optional<PathTracer> tracer;
  std::vector<std::unique_ptr<const PrecomputedRenderer>> renderers;  // [group]
  std::vector<std::string> light_keys;  // [group] where samples are kept, or were

  bool light_is_kept(std::size_t group, const PictureRequest& request) const {
    const KeptPicture* kept = request.kept_picture;
    return kept != nullptr && kept->has_light && group < kept->groups.size() &&
           kept->groups[group].light == light_keys[group];
  }

  FrameBuffers frame(const PictureRequest& request, const Camera& camera, const PixelRect& crop,
                     const RenderProgress& progress, const SampleStore& store = {}) const {
    const MoreSamples more = request.noise ? until_noise(*request.noise) : request.more;
    if (tracer) {
      return trace_picture(*tracer, camera, crop, request.seed,
                           {request.spp, request.seconds, more}, progress);
    }
    std::vector<const PrecomputedRenderer*> by_group;
    for (const auto& renderer : renderers) by_group.push_back(renderer.get());
    return shade_picture(by_group, camera, crop, request.spp, progress, more, store);
  }

  /// Of the environments that are fitted worst.
  FittedLights fitted_lights() const {
    FittedLights worst;
    for (const auto& renderer : renderers) {
      const FittedLights& fitted = renderer->fitted_lights();
      if (fitted.relative_error >= worst.relative_error) worst = fitted;
    }
    return worst;
  }
};

std::unique_ptr<SceneJob::Shading> SceneJob::shading_for(const PictureRequest& request,
                                                         std::optional<int> transfer_order) {
  const Loaded& loaded = loaded_for(request.method);
  auto shading = std::make_unique<Shading>();
  if (traces_paths(request.method)) {
    PathTracerSettings settings = path_tracer_settings(request);
    settings.light_groups = groups_of(request);
    std::vector<BcsdfTable>& reflecting = shading->reflecting[&loaded.materials];
    if (request.layers.lobes) reflecting = without_transmission(loaded.materials);
    shading->tracer.emplace(*loaded.scene, loaded.materials, config_.lights, config_.background,
                            settings, reflecting);
    return shading;
  }
  std::optional<float> far_from;
  if (config_.far_from) far_from = static_cast<float>(*config_.far_from);
  PrecomputedSettings settings{.seed = request.seed,
                               .method = request.method,
                               .shadow_sigma_mm = config_.shadow_sigma_mm,
                               .blend = blend_for(request.method),
                               .transfer_order = transfer_order,
                               .far_from = far_from,
                               .bounces = config_.bounces,
                               .far_forms = loaded.far_forms,
                               .interactive = loaded.interactive,
                               .filter = request.filter};
  for (const FabricPack* pack : loaded.part_packs) {
    if (!request.layers.lobes) break;
    std::vector<BcsdfTable>& reflecting = shading->reflecting[pack];
    if (reflecting.empty()) reflecting = without_transmission(pack->materials);
    settings.reflecting.emplace_back(reflecting);
  }
  shading->lights.resize(groups_of(request));
  for (const Light& light : config_.lights)
    shading->lights[shading->lights.size() == 1 ? 0 : light.group].push_back(light);
  if (request.keep || request.kept_picture != nullptr) shading->light_keys = light_keys(request);
  for (std::size_t group = 0; group < shading->lights.size(); ++group) {
    if (shading->light_is_kept(group, request)) shading->lights[group].clear();
    // Noise of different groups is independent; only the first one looks through the pixels.
    settings.seed = request.seed + (std::uint64_t{group} << 40U);
    if (group > 0 && method_row(settings.method).marches_volume)
      settings.method = RenderMethod::kExact;
    shading->renderers.push_back(std::make_unique<const PrecomputedRenderer>(
        *loaded.scene, loaded.part_packs, shading->lights[group],
        group == 0 ? config_.background : Rgb(Rgb::Zero()), settings));
  }
  return shading;
}

KeptPicture SceneJob::kept_picture_of(const PictureRequest& request, const Shading& shading) {
  KeptPicture kept{.scene = config_.name,
                   .view = request.keep->view,
                   .method = request.method,
                   .spp = request.spp,
                   .seed = request.seed,
                   .crop = request.crop,
                   .order = request.keep->order,
                   .has_light = request.keep->with_light,
                   .parts = parts_but_lights(request),
                   .groups = {}};
  for (std::size_t group = 0; group < shading.renderers.size(); ++group) {
    const std::optional<std::string> text = shading.renderers[group]->visibility_text();
    kept.groups.push_back({text ? content_hash(*text) : "", shading.light_keys[group]});
  }
  return kept;
}

SampleStore SceneJob::store_for(const PictureRequest& request, const Shading& shading) {
  using enum SampleStore::Use;
  SampleStore store{.from = request.kept_samples};
  if (request.kept_samples == nullptr) return store;
  const KeptPicture& kept = *request.kept_picture;
  store.kept_groups = kept.groups.size();
  store.use.assign(shading.renderers.size(), kSights);
  for (std::size_t group = 0; group < store.use.size(); ++group) {
    if (shading.light_is_kept(group, request)) {
      store.use[group] = kLight;
    } else if (const auto text = shading.renderers[group]->visibility_text();
               text && group < kept.groups.size() &&
               content_hash(*text) == kept.groups[group].visibility) {
      store.use[group] = kVisibility;
    }
  }
  return store;
}

void SceneJob::say_relit(const SampleStore& store) const {
  for (std::size_t group = 0; group < store.use.size(); ++group) {
    const char* how = "shaded anew, with new shadow rays";
    if (store.use[group] == SampleStore::Use::kVisibility)
      how = "shaded anew, with the shadows that were kept";
    if (store.use[group] == SampleStore::Use::kLight) how = "as it was kept";
    const std::string name =
        store.use.size() == 1 ? "all light" : "light of " + config_.light_groups[group];
    context_->console->say(fmt::format("{}: {}", name, how));
  }
}

SceneJob::Crops SceneJob::render_crops(const PictureRequest& request,
                                       std::span<const PixelRect> crops,
                                       std::optional<int> transfer_order) {
  const Camera camera(request.camera);
  loaded_for(request.method);
  Crops result;
  const Stopwatch setup;
  const std::unique_ptr<Shading> shading = shading_for(request, transfer_order);
  result.setup = setup.elapsed();
  result.frames.resize(crops.size());
  const Stopwatch rendering;
  tbb::parallel_for(std::size_t{0}, crops.size(), [&](std::size_t k) {
    result.frames[k] =
        shading->frame(request, camera, crops[k], [](double) { stop_if_interrupted(); });
  });
  result.rendering = rendering.elapsed();
  return result;
}

const ClothScene& SceneJob::fibers_scene() {
  return *loaded_for(RenderMethod::kPath).scene;
}

void SceneJob::add_layers(const PictureRequest& request, const Shading& shading,
                          const Camera& camera, FrameBuffers& frame) {
  const Loaded& loaded = loaded_for(request.method);
  const GBufferPass own_rays(*loaded.scene, loaded.part_packs, {}, {}, request.seed,
                             request.filter);
  const auto eye_rays = [&](const PixelRect& block, int first, int last) {
    stop_if_interrupted();
    if (shading.renderers.empty()) return own_rays.run(camera, block, first, last);
    const PrecomputedRenderer& looking = *shading.renderers.front();
    if (request.kept_samples == nullptr) return looking.g_buffer(camera, block, first, last);
    KeptChunk chunk(*loaded.scene, *request.kept_samples, block, request.crop, first, request.spp);
    return looking.g_buffer(camera, block, first, last, chunk);
  };
  add_scene_layers(
      *loaded.scene, layer_pieces_of(config_), eye_rays, camera, request.crop, request.seed,
      {.surface = request.layers.surface, .mattes = request.layers.cryptomatte}, frame);
}

std::uint64_t SceneJob::announce_keeping(const PictureRequest& request) const {
  std::size_t lights = 0;
  for (const Light& light : config_.lights) {
    const bool is_split =
        light.type == LightType::kEnvironment || light.type == LightType::kRectangle;
    lights += is_split ? static_cast<std::size_t>(light.gaussians + light.bright_sources) : 1U;
  }
  const std::size_t with_light = request.keep->with_light ? groups_of(request) : 0;
  const auto pixels = static_cast<std::uint64_t>(request.crop.width) *
                      static_cast<std::uint64_t>(request.crop.height);
  const auto samples = static_cast<std::uint64_t>(request.spp);
  context_->console->say(
      fmt::format("{}: {} where every sample sees a fiber", request.keep->file.string(),
                  memory_text(kept_bytes(pixels * samples, lights, with_light))));
  constexpr std::uint64_t kWaiting = std::uint64_t{kBlocksPerReport} * kBlockEdge * kBlockEdge;
  return kept_bytes(std::min(pixels, kWaiting) * samples, lights, with_light);
}

PictureResult SceneJob::render(const PictureRequest& request, const std::string& title,
                               bool quiet) {
  if (request.layers.lobes && !method_row(request.method).tells_lobes) {
    throw ConfigError(fmt::format("render.layers: the method {} does not tell lobes apart",
                                  render_method_name(request.method)));
  }
  // More samples than one are possible where a picture goes on until it is good enough.
  std::uint64_t bytes = picture_bytes(request.crop.width, request.crop.height,
                                      request.more || request.noise ? 2 : request.spp,
                                      {.of_fibers = !traces_paths(request.method),
                                       .light_groups = groups_of(request),
                                       .transmitted = request.layers.lobes,
                                       .of_scene = request.layers.surface,
                                       .mattes = request.layers.cryptomatte});
  if (request.keep) bytes += announce_keeping(request);
  announce_memory(*context_->console,
                  fmt::format("{}: {} x {} pixels", title, request.crop.width, request.crop.height),
                  bytes);
  std::string key = picture_key(request);
  const Loaded& loaded = loaded_for(request.method);
  const Camera camera(request.camera);

  PictureSetup setup{loaded.scene.get(), loaded.part_packs, config_.lights,           &camera,
                     request.crop,       request.method,    blend_for(request.method)};
  setup.interactive_surfaces = !traces_paths(request.method) && !surface_stages().keys().empty();
  std::vector<Warning> warnings = loaded.warnings;
  const auto add_warnings = [&](std::vector<Warning>&& more) {
    for (Warning& warning : more) warnings.push_back(std::move(warning));
  };
  add_warnings(picture_warnings(setup));
  const auto say_from = [&](std::size_t first) {
    for (std::size_t k = first; k < warnings.size() && !quiet; ++k)
      context_->console->warn(warning_text(warnings[k]));
  };
  say_from(0);
  const Stopwatch watch;

  // Progress in samples, or in seconds where those are the budget.
  const auto pixels = static_cast<std::uint64_t>(request.crop.width) *
                      static_cast<std::uint64_t>(request.crop.height);
  const std::uint64_t total = request.seconds
                                  ? static_cast<std::uint64_t>(std::ceil(*request.seconds))
                                  : pixels * static_cast<std::uint64_t>(request.spp);
  Progress progress(*context_->console, title, request.seconds ? "seconds" : "samples", total);
  std::uint64_t shown = 0;
  const RenderProgress report_progress = [&](double share) {
    stop_if_interrupted();
    const auto now = static_cast<std::uint64_t>(std::min(share, 1.0) * static_cast<double>(total));
    // Samples beyond the first start again at 0.
    if (now > shown) progress.advance(now - shown);
    shown = std::max(shown, now);
  };

  const std::unique_ptr<Shading> shading = shading_for(request);
  if (!shading->renderers.empty() && !quiet)
    say_environment(*context_->console, shading->fitted_lights());
  SampleStore store = store_for(request, *shading);
  if (!quiet) say_relit(store);
  std::optional<ChunkFileWriter> writer;
  if (request.keep) {
    writer.emplace(request.keep->file, kKeptMark, kept_text(kept_picture_of(request, *shading)));
    store.to = &*writer;
    store.keeps_light = request.keep->with_light;
  }
  FrameBuffers frame = shading->frame(request, camera, request.crop, report_progress, store);
  if (writer) writer->commit();
  for (std::size_t g = 0; g < frame.light_groups.size(); ++g)
    frame.light_groups[g].name = config_.light_groups[g];
  add_layers(request, *shading, camera, frame);
  if (request.more) {
    PictureRequest made = request;
    made.spp = frame.spp;
    key = picture_key(made);
  }

  const WorkTime time = watch.elapsed();

  const std::size_t said = warnings.size();
  add_warnings(frame_warnings(setup, frame));
  say_from(said);

  PictureResult result;
  std::map<std::string, std::string> metadata = {
      {"software", std::string("heddle ") + kProgramVersion},
      {"heddle.scene", config_.name},
      {"heddle.method", render_method_name(request.method)},
      {"heddle.key", key},
      {"heddle.seed", fmt::format("{}", request.seed)},
      {"heddle.spp", fmt::format("{}", frame.spp)},
      {"heddle.crop", crop_text(request.crop)},
      {"heddle.local", request.local ? "true" : "false"},
      {"heddle.worldToCamera", camera.world_to_camera_text()},
  };
  if (!request.filter.is_default()) metadata["heddle.filter"] = request.filter.text();
  result.image = image_of(frame, metadata);
  if (request.crop.width != camera.width() || request.crop.height != camera.height())
    result.image.frame = {request.crop.x0, request.crop.y0, camera.width(), camera.height()};
  result.time = time;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    result.mean_samples +=
        static_cast<double>(frame.samples_of(k)) / static_cast<double>(frame.pixel_count());
  }
  if (!frame.half0.empty()) {
    const std::vector<double> noise = noise_of_blocks(frame);
    result.largest_noise = *std::max_element(noise.begin(), noise.end());
  }
  result.fitted_lights = shading->fitted_lights();
  result.failed_shell_walks = loaded.scene->failed_walks();
  result.flipped_tetrahedra = loaded.scene->flipped_tets();
  result.degenerate_tetrahedra = loaded.scene->degenerate_tets();
  result.thinned_vertices = loaded.scene->thinned_vertices();
  result.warnings = std::move(warnings);
  return result;
}

Json picture_report(const PictureResult& picture) {
  Json report;
  for (const auto& [name, value] : picture.image.metadata) report[name] = value;
  report["seconds"] = picture.time.seconds;
  report["core_seconds"] = picture.time.core_seconds;
  report["mean_samples"] = picture.mean_samples;
  report["largest_noise_of_a_block"] = picture.largest_noise;
  const FittedLights& fitted = picture.fitted_lights;
  if (fitted.relative_error > 0) {
    report["environment_fit_relative_error"] = fitted.relative_error;
    report["environment_bright_sources"] = fitted.bright_sources;
    report["environment_irradiance_relative_error"] = fitted.irradiance_error;
    report["environment_energy_relative_error"] = fitted.energy_error;
  }
  report["failed_shell_walks"] = picture.failed_shell_walks;
  report["flipped_tetrahedra"] = picture.flipped_tetrahedra;
  report["degenerate_tetrahedra"] = picture.degenerate_tetrahedra;
  report["thinned_shell_vertices"] = picture.thinned_vertices;
  report["warnings"] = warnings_report(picture.warnings);
  return report;
}

void require_picture_writable(const fs::path& exr) {
  make_folder(exr.parent_path());
  for (const char* extension : {".exr", ".png", ".json"})
    require_writable(fs::path(exr).replace_extension(extension));
}

void write_screen_picture(const fs::path& png, const Image& image, const ScreenLook& look) {
  write_png(png, image.width, image.height, tone_map(layer_of(image, "", png.string()), look),
            look.text());
}

void write_picture(const fs::path& exr, const PictureResult& picture, const Json& report,
                   const ScreenLook& look) {
  write_exr(exr, picture.image);
  write_screen_picture(fs::path(exr).replace_extension(".png"), picture.image, look);
  write_file_atomically(fs::path(exr).replace_extension(".json"), report.dump(2) + "\n");
}

}  // namespace heddle
