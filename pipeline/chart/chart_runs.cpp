#include "pipeline/chart/chart_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace heddle {
namespace {

using Settings = nlohmann::ordered_json;

/// Samples per pixel along a curve. Where paths are traced they are even: a path tracer keeps two
/// halves.
struct Rungs {
  std::span<const int> all;
  std::span<const int> quick;
  std::span<const int> of(bool is_quick) const { return is_quick ? quick : all; }
};
constexpr int kPathSamples[] = {2, 4, 16, 64, 256};
constexpr int kQuickPathSamples[] = {2, 8};
constexpr int kSamples[] = {1, 4, 16, 64};
constexpr int kQuickSamples[] = {1, 4};
constexpr int kRivalSamples[] = {4, 16, 64};
constexpr Rungs kPathRungs{kPathSamples, kQuickPathSamples};
constexpr Rungs kUsualRungs{kSamples, kQuickSamples};
constexpr Rungs kRivalRungs{kRivalSamples, {}};

enum class CurvePlace : std::uint8_t {
  kFirst,  // in every chart
  kRival,  // behind the settings (docs/rivals.md), where some cloth has fibers
};

/// The curve of a method, by samples per pixel.
struct Ladder {
  RenderMethod method;
  Rungs rungs;
  CurvePlace place = CurvePlace::kFirst;
};

/// One row per method, in the order of the chart.
constexpr std::array<Ladder, kRenderMethodCount> kLadders = {{
    {RenderMethod::kPath, kPathRungs},
    {RenderMethod::kExact, kUsualRungs},
    {RenderMethod::kVolume, kUsualRungs},
    {RenderMethod::kPrinted, kRivalRungs, CurvePlace::kRival},
    {RenderMethod::kPrt, kRivalRungs, CurvePlace::kRival},
    {RenderMethod::kTsaiShih16, kRivalRungs, CurvePlace::kRival},
    {RenderMethod::kTsaiShihFull, kRivalRungs, CurvePlace::kRival},
    {RenderMethod::kDualScattering, kRivalRungs, CurvePlace::kRival},
    {RenderMethod::kPath6, kRivalRungs, CurvePlace::kRival},
}};

constexpr bool holds_every_method_once() {
  for (std::size_t k = 0; k < kRenderMethodCount; ++k) {
    const auto is_row = [k](const Ladder& ladder) {
      return ladder.method == static_cast<RenderMethod>(k);
    };
    if (std::count_if(kLadders.begin(), kLadders.end(), is_row) != 1) return false;
  }
  return true;
}
static_assert(holds_every_method_once(), "expected one ladder for each RenderMethod");

class RunTable {
 public:
  RunTable(const SceneConfig& scene, const PictureRequest& base, const ChartLadders& ladders)
      : scene_(&scene), base_(&base), ladders_(ladders) {}

  void add_methods(CurvePlace place) {
    for (const Ladder& ladder : kLadders) {
      if (ladder.place != place) continue;
      const std::string name = render_method_name(ladder.method);
      add_curve(name, ladder);
      if (ladder.method == RenderMethod::kPath) add_curve(name + ", local", ladder, true);
    }
  }

  /// Both ways to shade surface cloth that has a choice.
  void add_surface_methods() {
    for (const SurfaceMethod method : {SurfaceMethod::kSampled, SurfaceMethod::kInteractive}) {
      const std::string name = method == SurfaceMethod::kSampled ? "sampled" : "interactive";
      const std::size_t first = runs_.size();
      add_curve("exact, surfaces " + name, {RenderMethod::kExact, kUsualRungs});
      for (std::size_t k = first; k < runs_.size(); ++k) {
        runs_[k].settings["surface_method"] = name;
        runs_[k].variant.surface_method = method;
      }
    }
  }

  /// Spherical-harmonic order of the transfer, and edge of its cells.
  void add_settings_of_transfer() {
    if (ladders_.quick) return;
    for (const int order : {0, 1, 2, 3, 4, 5}) {
      add_setting("exact, order of the transfer", fmt::format("order {}", order),
                  RenderMethod::kExact, {"order", order},
                  variant_of_fabrics(*scene_, {.order = order}));
    }
    for (const int factor : {4, 2, 1}) {
      add_setting(
          "exact, size of the cells", fmt::format("cells x {}", factor), RenderMethod::kExact,
          {"cell_size", factor},
          variant_of_fabrics(*scene_, {.variant = {.cell_size = static_cast<double>(factor)}}));
    }
  }

  /// Forms of visibility that some light can tell apart.
  void add_forms_of_visibility() {
    const auto any_gaussian = [this](auto&& condition) {
      return std::any_of(scene_->lights.begin(), scene_->lights.end(), [&](const Light& light) {
        // Gaussians that stand for an environment may be sharp and soft.
        if (light.type == LightType::kEnvironment) return true;
        return !light.is_directional() && condition(light.sharpness);
      });
    };
    const auto add = [this](const char* name, const VisibilityBlend& blend) {
      add_setting("exact, form of visibility", name, RenderMethod::kExact, {"visibility", name},
                  {.blend = blend});
    };
    const VisibilityBlend usual;
    if (any_gaussian([&](float sharpness) { return usual.uses_distance(sharpness); }))
      add("Gaussians", kLobesOnly);
    if (any_gaussian([&](float sharpness) { return usual.uses_lobes(sharpness); }))
      add("signed distance", kSignedDistanceOnly);
    if (any_gaussian([](float) { return true; })) add("blend", usual);
  }

  /// Voxels along a fiber's radius, of what the fabric says.
  void add_resolutions_of_the_volume() {
    const std::vector<double> factors =
        ladders_.quick ? std::vector<double>{0.5} : std::vector<double>{0.5, 1, 2};
    for (const double factor : factors) {
      add_setting("volume, resolution", fmt::format("voxels x {}", factor), RenderMethod::kVolume,
                  {"voxel_rate", factor},
                  variant_of_fabrics(*scene_, {.variant = {.voxel_rate = factor}}));
    }
  }

  std::vector<ChartRun> take() { return std::move(runs_); }

 private:
  PictureRequest request(RenderMethod method, int spp) const {
    PictureRequest request = *base_;
    request.method = method;
    request.spp = spp;
    return request;
  }

  /// A curve by samples per pixel.
  void add_curve(const std::string& curve, const Ladder& ladder, bool local = false) {
    for (const int spp : ladder.rungs.of(ladders_.quick)) {
      runs_.push_back(
          {curve, fmt::format("{} spp", spp), {{"spp", spp}}, {}, request(ladder.method, spp)});
      runs_.back().request.local = local;
    }
  }

  /// A point of a curve along which one setting changes.
  void add_setting(const char* curve, const std::string& label, RenderMethod method,
                   const std::pair<const char*, Settings>& setting, const SceneVariant& variant) {
    runs_.push_back({curve,
                     label,
                     {{"spp", ladders_.spp}, {setting.first, setting.second}},
                     variant,
                     request(method, ladders_.spp)});
  }

  const SceneConfig* scene_;
  const PictureRequest* base_;
  ChartLadders ladders_;
  std::vector<ChartRun> runs_;
};

}  // namespace

std::vector<ChartRun> chart_runs(const SceneConfig& scene, const PictureRequest& base,
                                 const ChartLadders& ladders) {
  const auto any_cloth = [&scene](auto&& condition) {
    return std::any_of(scene.cloths.begin(), scene.cloths.end(), condition);
  };
  RunTable table(scene, base, ladders);
  table.add_methods(CurvePlace::kFirst);
  if (any_cloth(
          [](const ClothConfig& cloth) { return cloth.surface && cloth.surface->interactive; }))
    table.add_surface_methods();
  // Nothing below changes cloth without fibers.
  if (any_cloth([](const ClothConfig& cloth) { return !cloth.surface; })) {
    table.add_settings_of_transfer();
    table.add_forms_of_visibility();
    table.add_resolutions_of_the_volume();
    table.add_methods(CurvePlace::kRival);
  }
  return table.take();
}

}  // namespace heddle
