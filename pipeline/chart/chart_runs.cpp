#include "pipeline/chart/chart_runs.h"

#include <fmt/format.h>

#include <algorithm>

namespace heddle {
namespace {

using Settings = nlohmann::ordered_json;

PictureRequest with(PictureRequest request, RenderMethod method, int spp) {
  request.method = method;
  request.spp = spp;
  return request;
}

PictureRequest local(PictureRequest request) {
  request.local = true;
  return request;
}

std::string spp_label(int spp) {
  return fmt::format("{} spp", spp);
}

SceneVariant of_order(int order) {
  SceneVariant variant;
  variant.order = order;
  return variant;
}

SceneVariant of_fabric(const FabricVariant& fabric) {
  SceneVariant variant;
  variant.fabric = fabric;
  return variant;
}

SceneVariant of_blend(const VisibilityBlend& blend) {
  SceneVariant variant;
  variant.blend = blend;
  return variant;
}

}  // namespace

std::vector<ChartRun> chart_runs(const SceneConfig& scene, const PictureRequest& base,
                                 const ChartLadders& ladders) {
  const bool quick = ladders.quick;
  const int spp = ladders.spp;
  const PictureRequest exact = with(base, RenderMethod::kExact, spp);
  const PictureRequest volume = with(base, RenderMethod::kVolume, spp);
  using List = std::vector<int>;
  std::vector<ChartRun> runs;

  // Samples per pixel; the path tracer keeps two halves, so its numbers are even.
  for (const int n : quick ? List{2, 8} : List{2, 4, 16, 64, 256}) {
    runs.push_back({"path", spp_label(n), {{"spp", n}}, {}, with(base, RenderMethod::kPath, n)});
  }
  for (const int n : quick ? List{2, 8} : List{2, 4, 16, 64, 256}) {
    runs.push_back(
        {"path, local", spp_label(n), {{"spp", n}}, {}, local(with(base, RenderMethod::kPath, n))});
  }
  for (const int n : quick ? List{1, 4} : List{1, 4, 16, 64}) {
    runs.push_back({"exact", spp_label(n), {{"spp", n}}, {}, with(base, RenderMethod::kExact, n)});
  }
  for (const int n : quick ? List{1, 4} : List{1, 4, 16, 64}) {
    runs.push_back(
        {"volume", spp_label(n), {{"spp", n}}, {}, with(base, RenderMethod::kVolume, n)});
  }

  // Both ways to shade surface cloth that has a choice.
  const bool any_interactive = std::any_of(
      scene.cloths.begin(), scene.cloths.end(),
      [](const ClothConfig& cloth) { return cloth.surface && cloth.surface->interactive; });
  for (const SurfaceMethod method : {SurfaceMethod::kSampled, SurfaceMethod::kInteractive}) {
    if (!any_interactive) break;
    const std::string name = method == SurfaceMethod::kSampled ? "sampled" : "interactive";
    for (const int n : quick ? List{1, 4} : List{1, 4, 16, 64}) {
      SceneVariant variant;
      variant.surface_method = method;
      runs.push_back({"exact, surfaces " + name,
                      spp_label(n),
                      {{"spp", n}, {"surface_method", name}},
                      variant,
                      with(base, RenderMethod::kExact, n)});
    }
  }

  const bool any_fibers = std::any_of(scene.cloths.begin(), scene.cloths.end(),
                                      [](const ClothConfig& cloth) { return !cloth.surface; });
  if (!any_fibers) return runs;  // nothing below changes surface models

  // Spherical-harmonic order of the transfer.
  for (const int order : quick ? List{} : List{0, 1, 2, 3, 4, 5}) {
    runs.push_back({"exact, order of the transfer",
                    fmt::format("order {}", order),
                    {{"spp", spp}, {"order", order}},
                    of_order(order),
                    exact});
  }
  // Edge of a transfer cell.
  for (const int factor : quick ? List{} : List{4, 2, 1}) {
    runs.push_back({"exact, size of the cells",
                    fmt::format("cells x {}", factor),
                    {{"spp", spp}, {"cell_size", factor}},
                    of_fabric({.cell_size = static_cast<double>(factor)}),
                    exact});
  }
  // Form of visibility, where some light can tell.
  const auto any_gaussian = [&scene](auto&& condition) {
    return std::any_of(scene.lights.begin(), scene.lights.end(),
                       // Gaussians that stand for an environment may be sharp and soft.
                       [&](const Light& light) {
                         if (light.type == LightType::kEnvironment) return true;
                         return !light.is_directional() && condition(light.sharpness);
                       });
  };
  const VisibilityBlend usual;
  const auto add_blend = [&](const char* name, const VisibilityBlend& blend) {
    runs.push_back({"exact, form of visibility",
                    name,
                    {{"spp", spp}, {"visibility", name}},
                    of_blend(blend),
                    exact});
  };
  if (any_gaussian([&](float sharpness) { return usual.uses_distance(sharpness); }))
    add_blend("Gaussians", kLobesOnly);
  if (any_gaussian([&](float sharpness) { return usual.uses_lobes(sharpness); })) {
    add_blend("signed distance", kSignedDistanceOnly);
  }
  if (any_gaussian([](float) { return true; })) add_blend("blend", usual);
  // Voxels along a fiber's radius, of what the fabric says.
  for (const double factor : quick ? std::vector<double>{0.5} : std::vector<double>{0.5, 1, 2}) {
    runs.push_back({"volume, resolution",
                    fmt::format("voxels x {}", factor),
                    {{"spp", spp}, {"voxel_rate", factor}},
                    of_fabric({.voxel_rate = factor}),
                    volume});
  }
  // The rivals (docs/rivals.md). Paths come in two halves, so their samples are even.
  for (const RenderMethod method :
       {RenderMethod::kPrinted, RenderMethod::kPrt, RenderMethod::kTsaiShih16,
        RenderMethod::kTsaiShihFull, RenderMethod::kDualScattering, RenderMethod::kPath6}) {
    for (const int n : quick ? List{} : List{4, 16, 64}) {
      runs.push_back(
          {render_method_name(method), spp_label(n), {{"spp", n}}, {}, with(base, method, n)});
    }
  }
  return runs;
}

}  // namespace heddle
