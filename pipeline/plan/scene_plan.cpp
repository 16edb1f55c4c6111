#include "pipeline/plan/scene_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "pipeline/picture_request.h"
#include "pipeline/plan/enclosure.h"
#include "pipeline/plan/measure_accuracy.h"
#include "pipeline/plan/probe.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

// The pilot's pixels come in blocks of this edge: neighbours share cache lines, and blocks tell how
// much the picture varies.
constexpr int kBlockEdge = 8;
// Of the first pilot; less of a small picture.
constexpr int kFirstPixels = 2048;
constexpr int kPilotSamples = 2;
// A pilot of the chosen way may take this share of its pictures' time if its noise is not known
// well enough before.
constexpr double kPilotShare = 0.08;
constexpr double kNoiseKnown = 0.08;  // relative standard error
// Pilots, of paths or of ways, before the plan settles for what is known.
constexpr int kMostTries = 16;
// A way is tried where that takes at most this share of the time of what it offers.
constexpr double kTryShare = 0.2;
// Where a way would take at most this share of the time of the one that is sure to be good enough,
// it is worth finding out more of it.
constexpr double kHope = 0.5;
// Where what is chosen may well miss the tolerance, finding out more of it may take this share of
// what it offers.
constexpr double kDoubtShare = 0.25;
// Building its data and trying it may take this share of what it may save.
constexpr double kBuildShare = 0.25;
// Light from one cloth to another is known well enough if its squared error is this share of the
// squared tolerance, or less.
constexpr double kBetweenKnown = 0.05;
// Light between cloths by what they see of each other, relative to the folds of a table: long
// valleys give each other more than what drapes and things side by side do. One standard error of
// it.
constexpr double kBetweenOfFolds = 0.6;
constexpr double kBetweenError = 0.6;
// Of the mean that a fast way makes of the picture, relative, beside what is thought of it.
constexpr double kMeanError = 0.07;
// A pilot tells nothing if its standard error is more than this many of what is known, and enough
// if it is less than the second.
constexpr double kTelling = 0.8;
constexpr double kTold = 0.6;
// Standard errors added to a pilot's squared error where it says less than was thought: it misses
// rare large squares more often than it meets them.
constexpr double kDoubtOfLess = 0.7;
// A pilot of all pixels has not seen all that their samples may show.
constexpr double kLeastUnseen = 0.25;
// Squared errors are corrected by this factor at most.
constexpr double kMostStress = 4;
// The pilot's random numbers are not those of the picture.
constexpr std::uint64_t kPilotSeed = 0x9107;
// Fabrics of one scene whose settings are chosen apart: there are up to 6 choices for each.
constexpr std::size_t kMostApart = 3;
// Path-traced samples in the time that an accuracy table takes, its own data left out
// (measure_accuracy.h): where a plan needs fewer in all, path tracing is cheaper than finding out.
constexpr double kTableSamples = 4e6;

/// What a fabric's tables and stages say; one per fabric file.
struct Fabric {
  fs::path file;
  std::string name;
  int order = 5;  // its own
  bool light_from_both_sides = false;
  std::optional<AccuracyTable> table;
  // Stages with the data of a variant. The fabric's own always exist.
  std::map<FabricVariant, std::unique_ptr<FabricStages>> stages;
};

struct LightShare {
  double sharpness;
  double weight;  // of all the light that a cloth receives
  double cosine;  // to the cloth's normal, mean over what is seen
};

/// A squared error over lights of these weights: half as if errors were the same everywhere, half
/// as if they had nothing to do with each other.
class OverLights {
 public:
  void add(double weight, double square) {
    together_ += weight * std::sqrt(std::max(0.0, square));
    apart_ += weight * weight * square;
  }
  double square() const { return 0.5 * (together_ * together_ + apart_); }

 private:
  double together_ = 0;
  double apart_ = 0;
};

/// Light on one pixel's cloth, by the side it falls on; in the units of the lights.
struct PixelLight {
  struct OnSide {
    double seen = 0;    // on the side that the pixel sees
    double across = 0;  // on the other
    double shown(double through) const { return seen + through * across; }
  };
  OnSide face;
  OnSide back;
};

class ScenePlanner {
 public:
  ScenePlanner(const PlanQuestion& question, StageContext& context)
      : context_(&context), job_(std::make_unique<SceneJob>(question.scene, context)) {
    plan_.question = question;
    plan_.scene = job_->config();
    plan_.request = job_->request(find_view(plan_.scene, question.view));
    if (!question.crop.empty())
      plan_.request.crop = parse_crop(question.crop, plan_.request.camera);
    const PixelRect& crop = plan_.request.crop;
    pixels_ = static_cast<double>(crop.width) * crop.height;
  }

  ScenePlan make() {
    job_->fibers_scene();
    const Stopwatch watch;
    const int first =
        static_cast<int>(std::clamp(pixels_ / 4, 256.0, static_cast<double>(kFirstPixels)));
    trace_pilot(first, kPilotSamples);
    look_at_cloths();
    add_path();
    find_fabrics();
    // Surface models are lit the same way by all methods.
    if (!fabrics_.empty() && read_tables()) add_other_ways();
    settle();
    plan_.best_tolerance = best_tolerance(candidates());
    plan_.time = watch.elapsed() - loading_;
    return std::move(plan_);
  }

 private:
  // --- The pilot
  // -----------------------------------------------------------------------------------------------

  PictureRequest pilot_request(RenderMethod method, int spp) const {
    PictureRequest request = plan_.request;
    request.method = method;
    request.spp = spp;
    request.seed += kPilotSeed;
    return request;
  }

  SceneJob::Crops shoot(SceneJob& job, const PictureRequest& request,
                        std::optional<int> transfer_order = {}) {
    const Stopwatch watch;
    SceneJob::Crops crops = job.render_crops(request, blocks_, transfer_order);
    loading_ = loading_ + (watch.elapsed() - crops.setup - crops.rendering);
    return crops;
  }

  double seconds_per_spp(const SceneJob::Crops& crops, int spp) const {
    double pixels = 0;
    for (const FrameBuffers& frame : crops.frames)
      pixels += static_cast<double>(frame.pixel_count());
    return crops.rendering.seconds / (pixels * spp) * pixels_;
  }

  void trace_pilot(int pixels, int spp) {
    blocks_ = spread_blocks(plan_.request.crop, kBlockEdge, pixels);
    const SceneJob::Crops crops = shoot(*job_, pilot_request(RenderMethod::kPath, spp));
    paths_ = crops.frames;
    path_spp_ = spp;
    pilot_pixels_ = 0;
    for (const FrameBuffers& frame : paths_)
      pilot_pixels_ += static_cast<double>(frame.pixel_count());
    path_setup_ = crops.setup.seconds;
    path_seconds_per_spp_ = seconds_per_spp(crops, spp);
    path_variance_ = sample_variance(paths_);
    local_paths_ = {};
    path_mean_ = {mean_radiance(paths_), std::sqrt(path_variance_.value / (pilot_pixels_ * spp))};
    mean_ = path_mean_;
  }

  /// Can light that has left a cloth meet cloth again?
  bool sends_light_about() const {
    const std::vector<ClothConfig>& cloths = plan_.scene.cloths;
    return cloths.size() > 1 || !plan_.scene.meshes.empty() || cloths[0].mesh;
  }

  /// The same paths without what they meet beyond the cloth that they leave. All that methods lack
  /// which end light there; light from afar is smooth.
  void trace_local() {
    if (!sends_light_about() || !local_paths_.empty()) return;
    PictureRequest local = pilot_request(RenderMethod::kPath, path_spp_);
    local.local = true;
    local_paths_ = shoot(*job_, local).frames;
    light_between_mean_ = mean_.value > 0 ? mean_radiance(local_paths_) / mean_.value - 1 : 0;
    light_between_ = relative(squared_bias_of_means(local_paths_, paths_));
    // The mean's part of it is known best.
    light_between_.value =
        std::max(light_between_.value, light_between_mean_ * light_between_mean_);
    if (const Estimate thought = thought_between(); thought.value > 0) {
      // Few of the paths carry it, and few paths may have met none of those.
      const double noise = mean_.value > 0 ? mean_.error / mean_.value : 1;
      const double square = std::max(thought.value, light_between_.value);
      light_between_.error = std::max(light_between_.error, 2 * noise * std::sqrt(square));
      light_between_ = combined(thought, light_between_);
    }
  }
  /// Light between cloths by what they see of each other, as in the folds of the fabrics' tables.
  Estimate thought_between() const {
    double square = 0;
    for (std::size_t k = 0; k < plan_.scene.cloths.size(); ++k) {
      if (!is_seen_fibers(k)) continue;
      const AccuracyTable& table = *fabric_of(plan_.scene.cloths[k].fabric)->table;
      if (!(table.bent_enclosure_square > 0)) continue;
      double of_folds = 0;
      for (const LightShare& light : lights_of_cloth_[k])
        of_folds += light.weight * table.between_at(light.sharpness);
      square += weight_of(k) * kBetweenOfFolds * of_folds * enclosure_square_[k] /
                table.bent_enclosure_square;
    }
    return {square, kBetweenError * square};
  }
  static bool lacks_light_between(const Way& way) {
    return !traces_paths(way.method) || !way.variant.stand_ins.empty();
  }

  /// The error of a way by the tables and by light between cloths: from that against what it claims
  /// to compute and from what it does not claim.
  Estimate thought_of(const Way& way) const {
    Estimate thought = way.bias_square;
    if (lacks_light_between(way)) {
      // Where both darken, they add up.
      const double together = 2 * std::max(0.0, way.mean_error * light_between_mean_);
      thought.value += std::max(0.0, light_between_.value) + together;
      thought.error = std::hypot(thought.error, light_between_.error);
    }
    return thought;
  }

  /// The same, and as a pilot saw it.
  Estimate seen_of(const Way& way) const {
    const Estimate thought = thought_of(way);
    const Estimate& measured = way.pilot->bias_square;
    const Estimate raised = weighed(thought, measured, way.pilot->unseen);
    if (raised.value > thought.value) return raised;
    if (!way.pilot->may_lower) return thought;
    const double error = std::max(measured.error, -measured.value);
    const Estimate doubted{std::max(0.0, measured.value) + kDoubtOfLess * error, error};
    const Estimate lowered = weighed(thought, doubted, way.pilot->unseen);
    return lowered.value < thought.value ? lowered : thought;
  }

  /// All errors, from all that is known. What a pilot finds of a way holds of its kind.
  void add_up() {
    for (Way& way : plan_.ways) {
      const Estimate thought = thought_of(way);
      const auto of_kind = piloted_.find(way.kind());
      if (of_kind == piloted_.end()) {
        way.candidate.bias_square = thought;
        continue;
      }
      const Way& like = plan_.ways[of_kind->second];
      way.candidate.bias_square =
          &like == &way ? seen_of(way) : alike(thought, thought_of(like), seen_of(like));
    }
  }

  /// An absolute square relative to the mean radiance; the mean's own error counts.
  Estimate relative(const Estimate& square) const {
    const double scale = mean_.value > 0 ? 1 / (mean_.value * mean_.value) : 0;
    const double of_mean =
        mean_.value > 0 ? 2 * std::min(1.0, mean_.error / mean_.value) * square.value : 0;
    return {square.value * scale, std::hypot(square.error, of_mean) * scale};
  }

  // --- The scene
  // -----------------------------------------------------------------------------------------------

  void look_at_cloths() {
    const SceneConfig& scene = plan_.scene;
    plan_.seen.resize(scene.cloths.size());
    lights_of_cloth_.resize(scene.cloths.size());
    pixel_lights_.resize(scene.cloths.size());
    enclosure_square_.resize(scene.cloths.size());
    lights_ = fit_environments(scene.lights).lights;
    std::vector<std::size_t> cloth_of_fibers;
    for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
      if (!scene.cloths[k].surface) cloth_of_fibers.push_back(k);
    }
    const ClothScene& fibers = job_->fibers_scene();
    const Camera camera(plan_.request.camera);
    std::vector<std::vector<double>> facing(scene.cloths.size(),
                                            std::vector<double>(lights_.size(), 0.0));
    double all_light = 0;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      for (int k = 0; k < blocks_[b].width * blocks_[b].height; ++k) {
        const double light =
            static_cast<double>(paths_[b].beauty[static_cast<std::size_t>(k)].mean());
        all_light += light;
        const EyeRay ray = camera.ray(blocks_[b].x0 + k % blocks_[b].width + 0.5,
                                      blocks_[b].y0 + k / blocks_[b].width + 0.5);
        const std::optional<ShellHit> hit = fibers.first_fiber({ray.origin, ray.direction});
        if (!hit || fibers.meets_mesh(ray.origin, ray.direction, hit->t)) continue;
        const std::size_t cloth = cloth_of_fibers[hit->cloth];
        SeenCloth& seen = plan_.seen[cloth];
        seen.share += 1;
        seen.light_share += light;
        seen.footprint_mm += std::log(ray.spread * hit->t);
        const double enclosed = sends_light_about() ? enclosure(fibers, *hit, ray.direction) : 0;
        enclosure_square_[cloth] += enclosed * enclosed;
        PixelLight& on_pixel = pixel_lights_[cloth].emplace_back();
        const bool sees_face = fibers.fabric_direction(*hit, -ray.direction).z() > 0;
        for (std::size_t l = 0; l < lights_.size(); ++l) {
          const double height =
              static_cast<double>(fibers.fabric_direction(*hit, lights_[l].axis).z());
          facing[cloth][l] += std::max(0.0, height);
          const bool on_face = height > 0;
          const Shell::SurfacePoint lit =
              fibers.surface_point(*hit, on_face ? ClothSide::kFace : ClothSide::kBack);
          if (!fibers.globally_visible(lit, lights_[l].axis)) continue;
          PixelLight::OnSide& side = on_face ? on_pixel.face : on_pixel.back;
          (on_face == sees_face ? side.seen : side.across) +=
              static_cast<double>(lights_[l].irradiance.mean()) * std::abs(height);
        }
      }
    }
    for (std::size_t cloth = 0; cloth < scene.cloths.size(); ++cloth) {
      SeenCloth& seen = plan_.seen[cloth];
      if (!(seen.share > 0)) continue;
      seen.footprint_mm = std::exp(seen.footprint_mm / seen.share);
      enclosure_square_[cloth] /= seen.share;
      double all = 0;
      for (std::size_t l = 0; l < lights_.size(); ++l) {
        // Soft light comes from beside its axis too.
        const double weight = static_cast<double>(lights_[l].irradiance.mean()) *
                              std::max(0.05, facing[cloth][l] / seen.share);
        const double sharpness = lights_[l].is_directional()
                                     ? kDirectionalSharpness
                                     : static_cast<double>(lights_[l].sharpness);
        lights_of_cloth_[cloth].push_back({sharpness, weight, facing[cloth][l] / seen.share});
        all += weight;
      }
      for (LightShare& light : lights_of_cloth_[cloth])
        light.weight = all > 0 ? light.weight / all : 0;
      seen.share /= pilot_pixels_;
      seen.light_share = all_light > 0 ? seen.light_share / all_light : 0;
    }
  }

  /// A cloth's light, squared, relative to the picture's: (light_share / share)^2, on `share` of
  /// the pixels.
  double weight_of(std::size_t cloth) const {
    const SeenCloth& seen = plan_.seen[cloth];
    return seen.light_share * seen.light_share / seen.share;
  }

  bool is_seen_fibers(std::size_t cloth) const {
    return !plan_.scene.cloths[cloth].surface && plan_.seen[cloth].share > 0;
  }

  // --- Tables
  // -----------------------------------------------------------------------------------------------

  void find_fabrics() {
    for (const ClothConfig& cloth : plan_.scene.cloths) {
      if (cloth.surface || fabric_of(cloth.fabric) != nullptr) continue;
      auto fabric = std::make_unique<Fabric>();
      fabric->file = cloth.fabric;
      const auto own = std::make_unique<FabricStages>(cloth.fabric, *context_);
      fabric->name = own->document().config.name;
      fabric->order = own->document().transfer.order;
      fabric->light_from_both_sides = own->document().config.light_from_both_sides;
      fabrics_.push_back(std::move(fabric));
    }
  }

  Fabric* fabric_of(const fs::path& file) const {
    for (const auto& fabric : fabrics_) {
      if (fabric->file == file) return fabric.get();
    }
    return nullptr;
  }

  FabricStages& stages_of(Fabric& fabric, const FabricVariant& variant) {
    std::unique_ptr<FabricStages>& stages = fabric.stages[variant];
    if (!stages) stages = std::make_unique<FabricStages>(fabric.file, *context_, variant);
    return *stages;
  }

  /// False where some table is missing and path tracing is cheaper than to measure it.
  bool read_tables() {
    const Stopwatch watch;
    const bool all_there = have_tables();
    loading_ = loading_ + watch.elapsed();
    return all_there;
  }
  bool have_tables() {
    const std::optional<Offer> traced =
        offer(plan_.ways[0].candidate, plan_.question.tolerance, plan_.question.pictures);
    const double samples =
        traced ? static_cast<double>(traced->spp) * pixels_ * plan_.question.pictures : INFINITY;
    for (const auto& fabric : fabrics_) {
      FabricStages& stages = stages_of(*fabric, {});
      if (!fs::exists(stages.accuracy_place().path) && samples < kTableSamples) {
        plan_.note = fmt::format(
            "nothing is known of what else {} allows: path tracing takes less time than measuring "
            "it (heddle accuracy)",
            fabric->name);
        return false;
      }
      fabric->table = read_accuracy(stages.accuracy().path);
    }
    for (const ClothConfig& cloth : plan_.scene.cloths) {
      if (!cloth.far_surface) continue;
      FabricStages& stages = stages_of(*fabric_of(cloth.fabric), {});
      surfaces_.try_emplace(surface_key(cloth),
                            read_accuracy(stages.accuracy(&*cloth.far_surface).path));
    }
    return true;
  }

  static std::pair<fs::path, std::string> surface_key(const ClothConfig& cloth) {
    return {cloth.fabric, cloth.far_surface->text};
  }

  // --- Ways
  // -----------------------------------------------------------------------------------------------

  void add_path() {
    Way way;
    way.family = "path";
    way.tried = true;
    way.method = RenderMethod::kPath;
    way.candidate = {.name = "path",
                     .bias_square = {},
                     .noise_square = relative(path_variance_),
                     .setup_seconds = path_setup_,
                     .seconds_per_spp = path_seconds_per_spp_,
                     .spp_step = 2};
    plan_.ways.push_back(std::move(way));
  }

  /// How the farthest cloths may be surfaces: none, the farthest, the two farthest, ...
  std::vector<std::set<std::size_t>> stand_ins() const {
    std::vector<std::size_t> cloths;
    for (std::size_t k = 0; k < plan_.scene.cloths.size(); ++k) {
      if (plan_.scene.cloths[k].far_surface && is_seen_fibers(k)) cloths.push_back(k);
    }
    std::sort(cloths.begin(), cloths.end(), [&](std::size_t a, std::size_t b) {
      return plan_.seen[a].footprint_mm > plan_.seen[b].footprint_mm;
    });
    std::vector<std::set<std::size_t>> sets(1);
    for (const std::size_t cloth : cloths) {
      sets.push_back(sets.back());
      sets.back().insert(cloth);
    }
    return sets;
  }

  /// Forms of visibility that the scene's lights tell apart.
  std::vector<std::pair<std::string, VisibilityBlend>> forms() const {
    std::vector<std::pair<std::string, VisibilityBlend>> list = {{"", VisibilityBlend{}}};
    const VisibilityBlend usual;
    bool any_by_lobes = false;
    bool any_by_distance = false;
    for (const Light& light : lights_) {
      if (light.is_directional()) continue;
      any_by_lobes = any_by_lobes || usual.uses_lobes(light.sharpness);
      any_by_distance = any_by_distance || usual.uses_distance(light.sharpness);
    }
    if (any_by_lobes) list.emplace_back(kDistanceSetting, kSignedDistanceOnly);
    if (any_by_distance) list.emplace_back(kGaussiansSetting, kLobesOnly);
    return list;
  }

  void add_other_ways() {
    trace_local();
    for (const std::set<std::size_t>& far : stand_ins()) {
      SceneVariant variant;
      variant.stand_ins = far;
      if (!far.empty()) add_way(RenderMethod::kPath, variant);
      add_way(RenderMethod::kPath6, variant);
      add_way(RenderMethod::kDualScattering, variant);
      for (const auto& [form, blend] : forms()) {
        variant.blend = blend;
        for (const RenderMethod method : {RenderMethod::kExact, RenderMethod::kVolume}) {
          for (const SceneVariant& of_fabrics : fabric_choices(method, variant))
            add_way(method, of_fabrics);
        }
      }
    }
  }

  /// Every choice of cells, order and voxels for every fabric. The order, which matters least, only
  /// where there is one fabric; and many fabrics all alike.
  std::vector<SceneVariant> fabric_choices(RenderMethod method, const SceneVariant& base) const {
    std::vector<SceneVariant> choices = {base};
    const bool alike = fabrics_.size() > kMostApart;
    for (const auto& fabric : fabrics_) {
      std::vector<SceneVariant::OfFabric> of_one;
      const auto add = [&](std::optional<int> order, double cells, double voxels) {
        of_one.push_back({order, {.cell_size = cells, .voxel_rate = voxels}});
      };
      std::vector<double> cells = {1};
      cells.insert(cells.end(), std::begin(kOtherCells), std::end(kOtherCells));
      std::vector<double> voxels = {1};
      if (method == RenderMethod::kVolume)
        voxels.insert(voxels.end(), std::begin(kOtherVoxels), std::end(kOtherVoxels));
      for (const double v : voxels) {
        for (const double c : cells) {
          add({}, c, v);
          for (const int order : kOtherOrders) {
            if (order < fabric->order && fabrics_.size() == 1) add(order, c, v);
          }
        }
      }
      std::vector<SceneVariant> longer;
      for (const SceneVariant& choice : choices) {
        for (const SceneVariant::OfFabric& one : of_one) {
          if (alike && !choice.fabrics.empty() && choice.fabrics.begin()->second != one) continue;
          longer.push_back(choice);
          longer.back().fabrics[fabric->file] = one;
        }
      }
      choices = std::move(longer);
    }
    return choices;
  }

  /// Names of table settings whose differences from `base` add up.
  struct Settings {
    std::string base;
    // (setting, of which setting it is a change)
    std::vector<std::pair<std::string, std::string>> changes;
  };
  Settings settings_of(RenderMethod method, const SceneVariant& variant,
                       const SceneVariant::OfFabric& of_fabric) const {
    Settings settings{render_method_name(method), {}};
    if (!is_precomputed(method)) return settings;
    if (variant.blend == kSignedDistanceOnly)
      settings.changes.emplace_back(kDistanceSetting, "exact");
    if (variant.blend == kLobesOnly) settings.changes.emplace_back(kGaussiansSetting, "exact");
    if (of_fabric.order) settings.changes.emplace_back(order_setting(*of_fabric.order), "exact");
    if (of_fabric.variant.cell_size != 1)
      settings.changes.emplace_back(cells_setting(of_fabric.variant.cell_size), "exact");
    if (of_fabric.variant.voxel_rate != 1)
      settings.changes.emplace_back(voxels_setting(of_fabric.variant.voxel_rate), "volume");
    return settings;
  }

  /// An error in two parts: that of the mean colour, of which several add up, and the rest, whose
  /// squares do. What folds do to the mean is kept apart: it does not make good where else a
  /// setting is too bright.
  struct Parts {
    Rgbd flat_ratio;
    Rgbd folds_ratio;
    double rest_square;
    void add(const Parts& to, const Parts& from) {
      folds_ratio *= to.flat_ratio / from.flat_ratio.max(1e-3);
      rest_square += to.rest_square - from.rest_square;
    }
    /// What a setting changes is known without the noise of path tracing, but not whether it makes
    /// good or worse what errs already: worse by half of it at least, or of many settings that
    /// which merely looks better is chosen.
    void change(const Parts& to, const Parts& from, double change_square, bool in_folds) {
      (in_folds ? folds_ratio : flat_ratio) *= to.flat_ratio / from.flat_ratio.max(1e-3);
      rest_square += std::max(to.rest_square - from.rest_square, 0.5 * change_square);
    }
  };
  static Parts parts_of(const AccuracyTable& table, const Accuracy& entry) {
    return {entry.color_ratio, Rgbd::Ones(),
            entry.bias_square - table.mean_square(entry.color_ratio)};
  }

  /// What a table says of one cloth: squares relative to the cloth's own light, noise and time
  /// relative to path tracing.
  struct OfCloth {
    Estimate bias_square;
    double mean_error = 0;
    double noise_ratio = 1;
    double time_ratio = 1;
    double setup_seconds = 0;
  };
  OfCloth ask(const AccuracyTable& table, const Settings& settings, std::size_t cloth) const {
    const double footprint = plan_.seen[cloth].footprint_mm;
    Rgbd flat_error = Rgbd::Zero();   // of the mean
    Rgbd folds_error = Rgbd::Zero();  // what folds add to it
    OverLights rest;                  // of errors apart from the mean's
    double error = 0;
    double noise = 0;
    double path_noise = 0;
    for (const LightShare& light : lights_of_cloth_[cloth]) {
      const auto at = [&](const std::string& setting) {
        return table.at(setting, light.sharpness, footprint, light.cosine);
      };
      const auto folded = [&](const std::string& setting) {
        return table.at_bent(setting, light.sharpness);
      };
      const double weight = light.weight * light.weight;
      const Accuracy base = at(settings.base);
      const bool is_bent = plan_.scene.cloths[cloth].mesh.has_value();
      Parts parts = parts_of(table, base);
      double unsure = base.bias_square_error;
      for (const auto& [setting, of] : settings.changes) {
        const Accuracy flat[] = {at(setting), at(of)};
        const Accuracy bent[] = {folded(setting), folded(of)};
        // Where light grazes, a setting may matter more.
        const bool more_in_folds = is_bent && bent[0].bias_square - bent[1].bias_square >
                                                  flat[0].bias_square - flat[1].bias_square;
        const Accuracy* of_cloth = more_in_folds ? bent : flat;
        unsure = std::max(unsure, of_cloth->bias_square_error);
        parts.change(parts_of(table, of_cloth[0]), parts_of(table, of_cloth[1]),
                     of_cloth->change_square, more_in_folds);
      }
      // What folds add to a flat swatch seen from as far.
      if (is_bent) {
        const Accuracy flat = table.at(settings.base, light.sharpness, table.bent_footprint_mm,
                                       table.bent_light_cosine);
        const Accuracy bent = folded(settings.base);
        if (bent.bias_square > flat.bias_square)
          parts.add(parts_of(table, bent), parts_of(table, flat));
        // Other folds show other pairs of view and light, but many of them.
        unsure = bent.bias_square_error;
      }
      const double square = std::max(0.0, parts.rest_square);
      flat_error += light.weight * (parts.flat_ratio - 1);
      folds_error += light.weight * (parts.folds_ratio - 1);
      rest.add(light.weight, square);
      error += weight * unsure;
      noise += weight * base.noise_square;
      path_noise += weight * at("path").noise_square;
    }
    OfCloth result;
    const double of_mean = table.mean_square(1 + flat_error) + table.mean_square(1 + folds_error) +
                           2 * (table.color.square() * (flat_error * folds_error).max(0)).mean();
    const double square = of_mean + rest.square();
    result.bias_square = {square, std::hypot(error, kTableError * square)};
    result.mean_error = (table.color * (flat_error + folds_error)).mean();
    if (path_noise > 0) result.noise_ratio = noise / path_noise;
    double seconds = table.setting(settings.base).seconds_per_sample;
    for (const auto& [setting, of] : settings.changes) {
      seconds *= table.setting(setting).seconds_per_sample / table.setting(of).seconds_per_sample;
    }
    result.time_ratio = seconds / table.setting("path").seconds_per_sample;
    result.setup_seconds = table.setting(settings.base).setup_seconds;
    return result;
  }

  /// Adds what a cloth shows of light on its back, which data of light from the face do not hold.
  void add_light_from_behind(std::size_t cloth, double through, OfCloth& answer) const {
    double all = 0;
    double missing = 0;
    double squares = 0;
    for (const PixelLight& light : pixel_lights_[cloth]) {
      const double behind = light.back.shown(through);
      all += light.face.shown(through) + behind;
      missing += behind;
      squares += behind * behind;
    }
    if (!(missing > 0)) return;
    const double square = squares * static_cast<double>(pixel_lights_[cloth].size()) / (all * all);
    answer.bias_square.value += square;
    answer.bias_square.error = std::hypot(answer.bias_square.error, kTableError * square);
    answer.mean_error -= missing / all;
  }

  void add_way(RenderMethod method, const SceneVariant& variant) {
    Way way;
    way.method = method;
    way.variant = variant;
    way.family = render_method_name(method);
    if (!variant.stand_ins.empty()) way.family += " + surfaces";
    Candidate& candidate = way.candidate;
    candidate.name = name_of(way);
    candidate.spp_step = traces_paths(method) ? 2 : 1;
    candidate.changes = changes_of(way);
    double noise = 0;
    double noise_weight = 0;
    double time = 0;
    double seen = 0;
    std::set<fs::path> set_up;
    for (std::size_t k = 0; k < plan_.scene.cloths.size(); ++k) {
      if (!is_seen_fibers(k)) continue;
      const ClothConfig& cloth = plan_.scene.cloths[k];
      const SeenCloth& of = plan_.seen[k];
      OfCloth answer;
      if (variant.stand_ins.contains(k)) {
        answer = ask(surfaces_.at(surface_key(cloth)),
                     {surface_setting(cloth.far_surface->name), {}}, k);
      } else {
        const Fabric& fabric = *fabric_of(cloth.fabric);
        answer = ask(*fabric.table, settings_of(method, variant, variant.of(cloth.fabric)), k);
        if (is_precomputed(method) && !fabric.light_from_both_sides)
          add_light_from_behind(k, fabric.table->through, answer);
      }
      const double weight = weight_of(k);
      way.bias_square.value += weight * answer.bias_square.value;
      way.mean_error += of.light_share * answer.mean_error;
      way.bias_square.error += weight * answer.bias_square.error;
      noise += weight * answer.noise_ratio;
      noise_weight += weight;
      time += of.share * answer.time_ratio;
      seen += of.share;
      if (set_up.insert(cloth.fabric).second) {
        candidate.setup_seconds +=
            answer.setup_seconds * static_cast<double>(std::max<std::size_t>(1, lights_.size()));
      }
    }
    const double noise_ratio = noise_weight > 0 ? noise / noise_weight : 1;
    const Estimate traced = relative(path_variance_);
    candidate.noise_square = {noise_ratio * traced.value,
                              noise_ratio * std::hypot(traced.error, 0.2 * traced.value)};
    candidate.seconds_per_spp = path_seconds_per_spp_ * (seen > 0 ? time / seen : 1);
    candidate.build_seconds = build_seconds(way);
    way.candidate.bias_square = thought_of(way);
    plan_.ways.push_back(std::move(way));
  }

  /// Fabrics that a way still draws by their fibers.
  bool draws_fibers(const Way& way, const fs::path& file) const {
    for (std::size_t k = 0; k < plan_.scene.cloths.size(); ++k) {
      const ClothConfig& cloth = plan_.scene.cloths[k];
      if (!cloth.surface && cloth.fabric == file && !way.variant.stand_ins.contains(k)) return true;
    }
    return false;
  }

  double build_seconds(const Way& way) {
    double sum = 0;
    for (const auto& fabric : fabrics_) {
      if (!draws_fibers(way, fabric->file)) continue;
      const SceneVariant::OfFabric of = way.variant.of(fabric->file);
      Needs needs = needs_of(way.method, plan_.scene.lights, way.variant.blend);
      needs.order = of.order;
      for (const StageCost& cost : stages_of(*fabric, of.variant).costs(needs)) {
        if (!cost.present) sum += predicted_seconds(*fabric->table, cost.stage, of);
      }
    }
    return sum;
  }

  static double predicted_seconds(const AccuracyTable& table, const std::string& stage,
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

  int changes_of(const Way& way) const {
    int changes = static_cast<int>(way.variant.stand_ins.size());
    if (!is_precomputed(way.method)) return changes;
    if (way.variant.blend != VisibilityBlend{}) ++changes;
    for (const auto& fabric : fabrics_) {
      if (!draws_fibers(way, fabric->file)) continue;
      const SceneVariant::OfFabric of = way.variant.of(fabric->file);
      changes += static_cast<int>(of.order.has_value()) +
                 static_cast<int>(of.variant.cell_size != 1) +
                 static_cast<int>(of.variant.voxel_rate != 1);
    }
    return changes;
  }

  std::string name_of(const Way& way) const {
    std::string name = render_method_name(way.method);
    if (is_precomputed(way.method)) {
      if (way.variant.blend == kSignedDistanceOnly) name += fmt::format(", {}", kDistanceSetting);
      if (way.variant.blend == kLobesOnly) name += fmt::format(", {}", kGaussiansSetting);
      for (const auto& fabric : fabrics_) {
        if (!draws_fibers(way, fabric->file)) continue;
        const SceneVariant::OfFabric of = way.variant.of(fabric->file);
        const std::string of_which = fabrics_.size() > 1 ? fabric->file.stem().string() + " " : "";
        if (of.variant.cell_size != 1)
          name += ", " + of_which + cells_setting(of.variant.cell_size);
        if (of.order) name += ", " + of_which + order_setting(*of.order);
        if (of.variant.voxel_rate != 1)
          name += ", " + of_which + voxels_setting(of.variant.voxel_rate);
      }
    }
    for (const std::size_t k : way.variant.stand_ins) {
      name += fmt::format(", cloth {} as {}", k + 1, plan_.scene.cloths[k].far_surface->name);
    }
    return name;
  }

  // --- The choice
  // -----------------------------------------------------------------------------------------------

  std::vector<Candidate> candidates() const {
    std::vector<Candidate> list;
    for (const Way& way : plan_.ways) list.push_back(way.candidate);
    return list;
  }

  std::vector<bool> tried() const {
    std::vector<bool> list;
    for (const Way& way : plan_.ways) list.push_back(way.tried);
    return list;
  }

  void settle() {
    const double tolerance = plan_.question.tolerance;
    const int pictures = plan_.question.pictures;
    for (int tries = 0; tries < kMostTries; ++tries) {
      plan_.chosen = cheapest_known(candidates(), tried(), tolerance, pictures);
      if (!plan_.chosen) break;
      const Offer offered = *offer(plan_.ways[*plan_.chosen].candidate, tolerance, pictures);
      if (!hope(offered) && !learn(plan_.ways[*plan_.chosen], offered)) break;
    }
    plan_.chosen = cheapest_known(candidates(), tried(), tolerance, pictures);
    if (!plan_.chosen) return;
    const Way& way = plan_.ways[*plan_.chosen];
    plan_.offer = offer(way.candidate, tolerance, pictures);
    plan_.request.method = way.method;
    plan_.request.spp = plan_.offer->spp;
  }

  /// A pilot of so many samples in all, first of more pixels.
  void trace_pilot_of(double samples) {
    const double pixels = std::min(pixels_, samples / kPilotSamples);
    trace_pilot(static_cast<int>(pixels),
                2 * std::max(kPilotSamples / 2, static_cast<int>(samples / pixels / 2)));
    Candidate& path = plan_.ways[0].candidate;
    path.noise_square = relative(path_variance_);
    path.seconds_per_spp = path_seconds_per_spp_;
  }

  /// Finds out more of a way that may be much cheaper than what is offered, if it errs by less than
  /// caution allows for; false where there is none, or finding out takes too long.
  bool hope(const Offer& offered) {
    std::vector<Candidate> list = candidates();
    for (Candidate& candidate : list) candidate.bias_square = at_best(candidate.bias_square);
    const std::optional<std::size_t> best = cheapest_known(
        list, std::vector<bool>(list.size()), plan_.question.tolerance, plan_.question.pictures);
    if (!best || *best == *plan_.chosen) return false;
    const Offer hoped = *offer(list[*best], plan_.question.tolerance, plan_.question.pictures);
    if (hoped.seconds > kHope * offered.seconds) return false;
    // What the chosen way's own pilot says holds of its kind.
    Way& way =
        plan_.ways[plan_.ways[*best].kind() == plan_.ways[*plan_.chosen].kind() ? *plan_.chosen
                                                                                : *best];
    const double affordable = kBuildShare * (offered.seconds - hoped.seconds);
    if (!may_try(way) || way.candidate.build_seconds + seconds_to_try(way) > affordable)
      return false;
    return find_out(way, kPilotShare * offered.seconds, true);
  }

  /// Finds out more of the way that looks cheapest; false where there is nothing to find out.
  bool learn(Way& way, const Offer& offered) {
    if (way.family == "path") {
      // A picture finds out itself how many samples it needs: only the choice depends on its noise
      // here.
      const double error = way.candidate.noise_square.error / way.candidate.noise_square.value;
      return error >= kNoiseKnown && has_rival(offered) &&
             more_paths(4 * pilot_samples(), kPilotShare * offered.seconds);
    }
    if (!way.tried && may_try(way) && seconds_to_try(way) <= kTryShare * offered.seconds) {
      try_out(way, false);  // for its noise and its speed here
      return true;
    }
    if (between_matters(way) && know_light_between(offered)) return true;
    if (!may_try(way) || !way.tried) return false;
    const double affordable = kDoubtShare * offered.seconds;
    return may_miss(way.candidate, plan_.question.tolerance) && seconds_to_try(way) <= affordable &&
           find_out(way, affordable, false);
  }

  /// Tries a way against the paths that there are, if that tells more of its error than is known
  /// and has not been done to one of its kind; else a larger pilot of paths, if one that tells
  /// enough is affordable. False where neither is.
  bool find_out(Way& way, double affordable, bool hoped_for) {
    const double known = way.candidate.bias_square.error;
    const auto of_kind = piloted_.find(way.kind());
    const bool is_new =
        of_kind == piloted_.end() || plan_.ways[of_kind->second].pilot->samples < pilot_samples();
    if (is_new && pilot_error(pilot_samples()) <= kTelling * known) {
      try_out(way, hoped_for);
      return true;
    }
    double wanted = 2 * pilot_samples();
    while (pilot_error(wanted) > kTold * known && wanted < pixels_ * kMostSamples) wanted *= 1.3;
    const bool between_too = between_matters(way);
    if (between_too) affordable /= 2;
    wanted = std::min(wanted, affordable / seconds_per_path());
    if (pilot_error(wanted) > kTelling * known || !more_paths(wanted, affordable)) return false;
    if (between_too) {
      trace_local();
      add_up();
    }
    return true;
  }

  /// Standard error of the squared error that pilots of so many paths, and of a way in about the
  /// same time, say.
  double pilot_error(double samples) const {
    const double pixels = std::min(pixels_, samples / kPilotSamples);
    return 2.5 * plan_.ways[0].candidate.noise_square.value /
           (samples / pixels * std::sqrt(pixels));
  }

  /// Does another way not cost much more?
  bool has_rival(const Offer& offered) const {
    for (std::size_t k = 0; k < plan_.ways.size(); ++k) {
      const std::optional<Offer> other =
          offer(plan_.ways[k].candidate, plan_.question.tolerance, plan_.question.pictures);
      if (k != *plan_.chosen && other && kHope * other->seconds < offered.seconds) return true;
    }
    return false;
  }

  double pilot_samples() const { return pilot_pixels_ * path_spp_; }
  double seconds_per_path() const { return path_seconds_per_spp_ / pixels_; }

  /// A larger pilot of paths, in the seconds affordable; false where it would not be much larger.
  /// Four times the samples are twice as sure.
  bool more_paths(double wanted, double affordable) {
    wanted = std::min(wanted, affordable / seconds_per_path());
    if (wanted < 2 * pilot_samples()) return false;
    trace_pilot_of(wanted);
    return true;
  }

  bool may_try(const Way& way) const {
    return plan_.question.may_build || !(way.candidate.build_seconds > 0);
  }
  /// Samples per pixel of a pilot to be compared with that of paths: as many as tell most of the
  /// difference in the time of both.
  int samples_to_try(const Way& way) const {
    const Candidate& path = plan_.ways[0].candidate;
    const double noise = way.candidate.noise_square.value / path.noise_square.value;
    const double time = way.candidate.seconds_per_spp / path.seconds_per_spp;
    const double samples = path_spp_ * std::sqrt(noise / time);
    return 2 *
           std::clamp(static_cast<int>(std::lround(samples / 2)), kPilotSamples / 2, path_spp_ / 2);
  }
  /// Building apart.
  double seconds_to_try(const Way& way) const {
    return way.candidate.setup_seconds +
           samples_to_try(way) * pilot_pixels_ / pixels_ * way.candidate.seconds_per_spp;
  }

  /// Is light between cloths what is known least of the way's error?
  bool between_matters(const Way& way) const {
    return lacks_light_between(way) && light_between_.error > way.bias_square.error;
  }

  /// Another pilot, if light between cloths decides what is offered and is not known; false if not.
  bool know_light_between(const Offer& offered) {
    const double tolerance = plan_.question.tolerance;
    if (light_between_.error < kBetweenKnown * tolerance * tolerance) return false;
    // Both pictures of paths count.
    if (!more_paths(4 * pilot_samples(), kPilotShare * offered.seconds / 2)) return false;
    trace_local();
    add_up();
    return true;
  }

  void try_out(Way& way, bool hoped_for) {
    if (way.variant != SceneVariant{}) {
      if (!other_job_ || way.variant != other_variant_) {
        const Stopwatch watch;
        other_job_.reset();  // one at a time in memory
        other_job_ = std::make_unique<SceneJob>(plan_.question.scene, *context_, way.variant);
        other_variant_ = way.variant;
        loading_ = loading_ + watch.elapsed();
      }
    }
    SceneJob& job = way.variant == SceneVariant{} ? *job_ : *other_job_;
    const int samples = samples_to_try(way);
    const SceneJob::Crops crops = shoot(job, pilot_request(way.method, samples));
    refine_mean(way, mean_radiance(crops.frames));
    if (is_precomputed(way.method)) measure_stress();
    const Candidate before = way.candidate;
    Candidate& now = way.candidate;
    now.noise_square = relative(sample_variance(crops.frames));
    now.seconds_per_spp = seconds_per_spp(crops, samples);
    now.setup_seconds = crops.setup.seconds;
    now.build_seconds = 0;  // by now it is there
    Estimate measured = relative(squared_bias(crops.frames, paths_));
    // The spread between few blocks misses rare bright paths; the noise of two halves is at least
    // this.
    const double noise = 2 * (plan_.ways[0].candidate.noise_square.value / path_spp_ +
                              now.noise_square.value / samples);
    measured.error = std::max(measured.error, noise / std::sqrt(pilot_pixels_));
    bool may_lower = hoped_for;
    const auto index = static_cast<std::size_t>(&way - plan_.ways.data());
    const auto [of_kind, is_first] = piloted_.try_emplace(way.kind(), index);
    if (!is_first) {
      may_lower = may_lower || plan_.ways[of_kind->second].pilot->may_lower;
      plan_.ways[of_kind->second].pilot.reset();
      of_kind->second = index;
    }
    way.pilot = {measured, pilot_samples(), std::max(kLeastUnseen, 1 - pilot_pixels_ / pixels_),
                 may_lower};
    // What differs from the table here does so for the like of it too.
    const double noise_ratio = now.noise_square.value / before.noise_square.value;
    const double time_ratio = now.seconds_per_spp / before.seconds_per_spp;
    for (Way& other : plan_.ways) {
      if (other.kind() != way.kind()) continue;
      other.tried = true;
      if (&other == &way) continue;
      Candidate& like = other.candidate;
      like.noise_square = {
          like.noise_square.value * noise_ratio,
          like.noise_square.value * now.noise_square.error / now.noise_square.value};
      like.seconds_per_spp *= time_ratio;
      like.setup_seconds = now.setup_seconds;
      like.build_seconds = build_seconds(other);
    }
    add_up();
  }

  /// The picture's mean, which few paths tell badly, by what a way that has hardly any noise makes
  /// of it. All that is relative to it follows.
  void refine_mean(const Way& way, double mean) {
    if (!(mean > 0) || !(mean_.value > 0)) return;
    const double missing =
        way.mean_error + (lacks_light_between(way) ? std::min(0.0, light_between_mean_) : 0);
    const double before = mean_.value;
    mean_ = combined(path_mean_, {mean, mean * std::hypot(kMeanError, missing)});
    const double scale = before * before / (mean_.value * mean_.value);
    for (Way& other : plan_.ways) {
      other.candidate.noise_square.value *= scale;
      other.candidate.noise_square.error *= scale;
    }
  }

  /// Where this view and these lights make much of the higher harmonics, other errors of flat cloth
  /// are large, too: light that hardly any of the cloth sends here is hard to get right. Two
  /// pictures by the fabrics' own data that share all else tell it, next to free of noise.
  void measure_stress() {
    constexpr int kLowOrder = kOtherOrders[0];
    const auto own = std::find_if(plan_.ways.begin(), plan_.ways.end(), [](const Way& way) {
      return way.method == RenderMethod::kExact && way.candidate.changes == 0;
    });
    if (stress_ || own == plan_.ways.end() || own->candidate.build_seconds > 0) return;
    double thought = 0;
    for (std::size_t k = 0; k < plan_.scene.cloths.size(); ++k) {
      if (!is_seen_fibers(k)) continue;
      const Fabric& fabric = *fabric_of(plan_.scene.cloths[k].fabric);
      if (plan_.scene.cloths[k].mesh || fabric.order <= kLowOrder) return;
      OverLights changes;
      for (const LightShare& light : lights_of_cloth_[k]) {
        changes.add(light.weight, fabric.table
                                      ->at(order_setting(kLowOrder), light.sharpness,
                                           plan_.seen[k].footprint_mm, light.cosine)
                                      .change_square);
      }
      thought += weight_of(k) * changes.square();
    }
    const PictureRequest request = pilot_request(RenderMethod::kExact, 2);
    const SceneJob::Crops whole = shoot(*job_, request);
    const SceneJob::Crops low = shoot(*job_, request, kLowOrder);
    const double mean = mean_radiance(whole.frames);
    const double change =
        mean > 0 ? squared_bias(low.frames, whole.frames).value / (mean * mean) : 0;
    stress_ =
        thought > 0 && change > 0 ? std::clamp(std::sqrt(change / thought), 1.0, kMostStress) : 1;
    for (Way& way : plan_.ways) {
      if (!is_precomputed(way.method) || !way.variant.stand_ins.empty()) continue;
      way.bias_square.value *= *stress_;
      way.bias_square.error = std::max(way.bias_square.error, kTableError * way.bias_square.value);
    }
  }

  StageContext* context_;
  std::unique_ptr<SceneJob> job_;        // of the scene as it is
  std::unique_ptr<SceneJob> other_job_;  // of other_variant_
  SceneVariant other_variant_;
  ScenePlan plan_;
  double pixels_ = 0;                                     // of the picture
  WorkTime loading_;                                      // and building
  std::vector<Light> lights_;                             // environments as Gaussians
  std::vector<std::vector<LightShare>> lights_of_cloth_;  // [cloth][light]
  std::vector<std::vector<PixelLight>> pixel_lights_;     // [cloth][pixel of the first pilot on it]
  // [cloth] mean over the pixels of the first pilot on it
  std::vector<double> enclosure_square_;
  std::vector<std::unique_ptr<Fabric>> fabrics_;
  std::map<std::pair<fs::path, std::string>, AccuracyTable> surfaces_;

  std::vector<PixelRect> blocks_;
  std::vector<FrameBuffers> paths_;  // [block]
  // [block] the same, local; empty until asked for, or where all are
  std::vector<FrameBuffers> local_paths_;
  Estimate light_between_;                      // squared, of what is not local
  double light_between_mean_ = 0;               // of the picture's mean without it
  std::map<std::string, std::size_t> piloted_;  // [kind of ways] the way that has its pilot
  std::optional<double>
      // squared errors of flat cloth, relative to the table's; known once a precomputed way is
      // tried
      stress_;
  double pilot_pixels_ = 0;
  int path_spp_ = 0;
  double path_setup_ = 0;
  double path_seconds_per_spp_ = 0;
  Estimate path_variance_;  // absolute
  Estimate path_mean_;      // radiance, by the pilot of paths
  Estimate mean_;           // the same, by all that is known
};

}  // namespace

ScenePlan make_plan(const PlanQuestion& question, StageContext& context) {
  return ScenePlanner(question, context).make();
}

}  // namespace heddle
