#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/console.h"
#include "pipeline/plan/scene_plan.h"

namespace heddle {
namespace {

using Json = nlohmann::ordered_json;

double root(double square) {
  return std::sqrt(std::max(0.0, square));
}
std::string percent_text(double value) {
  return fmt::format("{:.3g} %", 100 * value);
}
/// Shorter than duration_text allows.
std::string short_duration(double seconds) {
  return seconds < 9.95 ? fmt::format("{:.2g} s", seconds) : duration_text(seconds);
}

/// Which form of visibility a way takes for a light.
const char* visibility_of(const Way& way, const Light& light) {
  if (!is_precomputed(way.settings.method)) return "none";
  if (light.is_delta()) return "signed distances";
  if (light.type != LightType::kSphericalGaussian) return "by the sharpness of its Gaussians";
  const bool distance = way.settings.variant.blend.uses_distance(light.sharpness);
  const bool lobes = way.settings.variant.blend.uses_lobes(light.sharpness);
  if (distance && lobes) return "signed distances and Gaussians";
  return distance ? "signed distances" : "Gaussians";
}

std::string light_name(const Light& light) {
  switch (light.type) {
    case LightType::kDirectional:
      return "directional";
    case LightType::kSphericalGaussian:
      return fmt::format("sg, sharpness {:g}", light.sharpness);
    case LightType::kEnvironment:
      return "environment";
    case LightType::kPoint:
      return "point";
    case LightType::kSphere:
      return "sphere";
    case LightType::kRectangle:
      return "rectangle";
  }
  return "";
}

/// How a way draws a cloth.
Json cloth_json(const ScenePlan& plan, const Way& way, std::size_t k) {
  const ClothConfig& cloth = plan.scene.cloths[k];
  if (cloth.surface) return {{"drawn_by", "surface"}, {"surface", cloth.surface->name}};
  if (way.settings.variant.stand_ins.contains(k))
    return {{"drawn_by", "surface"}, {"surface", cloth.far_surface->name}};
  Json json = {{"drawn_by", "fibers"}, {"fabric", cloth.fabric.generic_string()}};
  if (!is_precomputed(way.settings.method)) return json;
  const SceneVariant::OfFabric of = way.settings.variant.of(cloth.fabric);
  json["cell_size"] = of.variant.cell_size;
  json["order"] = of.order ? Json(*of.order) : Json(nullptr);
  if (way.settings.method == RenderMethod::kVolume) json["voxel_rate"] = of.variant.voxel_rate;
  return json;
}

std::string cloth_text(const ScenePlan& plan, const Way& way, std::size_t k) {
  const Json json = cloth_json(plan, way, k);
  if (json.at("drawn_by") == "surface")
    return "surface model " + json.at("surface").get<std::string>();
  std::string text = "fibers";
  if (!is_precomputed(way.settings.method)) return text;
  text += fmt::format(", cells x {:g}", json.at("cell_size").get<double>());
  text += json.at("order").is_null() ? ", the fabric's order"
                                     : fmt::format(", order {}", json.at("order").get<int>());
  if (json.contains("voxel_rate"))
    text += fmt::format(", voxels x {:g}", json.at("voxel_rate").get<double>());
  return text;
}

/// The cheapest way of each family for this tolerance, or the most accurate where none meets it;
/// the chosen one first.
std::vector<const Way*> notable(const ScenePlan& plan) {
  std::vector<const Way*> list;
  if (plan.chosen) list.push_back(&plan.ways[*plan.chosen]);
  std::set<std::string> families;
  for (const Way& way : plan.ways) {
    if (!families.insert(family_of(way.settings)).second) continue;
    const Way* best = nullptr;
    for (const Way& other : plan.ways) {
      if (family_of(other.settings) != family_of(way.settings)) continue;
      if (best == nullptr) best = &other;
      const auto a =
          offer(other.candidate, plan.question.target.tolerance, plan.question.target.pictures);
      const auto b =
          offer(best->candidate, plan.question.target.tolerance, plan.question.target.pictures);
      if (a && b ? a->seconds < b->seconds
                 : a.has_value() > b.has_value() ||
                       (!a && !b &&
                        other.candidate.bias_square.value < best->candidate.bias_square.value)) {
        best = &other;
      }
    }
    if (!plan.chosen || best != &plan.ways[*plan.chosen]) list.push_back(best);
  }
  return list;
}

Json way_json(const ScenePlan& plan, const Way& way) {
  const Candidate& candidate = way.candidate;
  Json json = {{"name", candidate.name},
               {"method", render_method_name(way.settings.method)},
               {"bias", root(candidate.bias_square.value)},
               {"noise_of_a_sample", root(candidate.noise_square.value)},
               {"known_from", way.tried ? "a pilot of this view" : "the table of the fabric"},
               {"build_seconds", candidate.build_seconds},
               {"setup_seconds", candidate.setup_seconds},
               {"seconds_per_sample_per_pixel", candidate.seconds_per_spp}};
  const auto made = offer(candidate, plan.question.target.tolerance, plan.question.target.pictures);
  json["meets_tolerance"] = made.has_value();
  if (made) {
    json["spp"] = made->spp;
    json["expected_error"] = made->expected_error;
    json["seconds_per_picture"] = made->seconds_per_picture;
    json["seconds"] = made->seconds;
  }
  return json;
}

std::string why(const ScenePlan& plan, const Way& way) {
  const auto made =
      offer(way.candidate, plan.question.target.tolerance, plan.question.target.pictures);
  if (!made) {
    const bool by_bias =
        root(way.candidate.bias_square.value) > 0.7 * plan.question.target.tolerance;
    return by_bias ? "too far from path tracing" : "too many samples";
  }
  return fmt::format("{} spp, {}", made->spp, short_duration(made->seconds));
}

}  // namespace

std::string plan_text(const ScenePlan& plan) {
  const PlanQuestion& question = plan.question;
  std::string text = fmt::format("plan      {}{}, relative RMSE at most {}, {}\n", plan.scene.name,
                                 question.view.empty() ? "" : ", view " + question.view,
                                 percent_text(question.target.tolerance),
                                 question.target.pictures == 1
                                     ? "one picture"
                                     : fmt::format("{} pictures", question.target.pictures));
  if (plan.chosen) {
    const Way& way = plan.ways[*plan.chosen];
    text +=
        fmt::format("choice    {}, {} samples per pixel\n", way.candidate.name, plan.offer->spp);
    for (std::size_t k = 0; k < plan.scene.cloths.size(); ++k) {
      const SeenCloth& seen = plan.seen[k];
      text += fmt::format("cloth {:<3} {}", k + 1, cloth_text(plan, way, k));
      text += seen.share > 0 ? fmt::format(" ({:.0f} % of the picture, a pixel covers {:.3g} mm)\n",
                                           100 * seen.share, seen.footprint_mm)
                             : "\n";
    }
    for (std::size_t l = 0; l < plan.scene.lights.size() && is_precomputed(way.settings.method);
         ++l) {
      const Light& light = plan.scene.lights[l];
      text += fmt::format("light {:<3} {}: visibility by {}\n", l + 1, light_name(light),
                          visibility_of(way, light));
    }
    text += fmt::format("error     {} expected: {} apart from noise ({}), {} noise\n",
                        percent_text(plan.offer->expected_error),
                        percent_text(root(way.candidate.bias_square.value)),
                        traces_paths(way.settings.method) && family_of(way.settings) == "path"
                            ? "none by definition"
                        : way.pilot ? "table and pilot"
                                    : "table",
                        percent_text(root(way.candidate.noise_square.value / plan.offer->spp)));
    text += fmt::format(
        "cost      {}: {} to build, {} per picture; the plan took {}\n",
        short_duration(plan.offer->seconds), short_duration(way.candidate.build_seconds),
        short_duration(plan.offer->seconds_per_picture), short_duration(plan.time.seconds));
  } else {
    text +=
        fmt::format("choice    none: no way meets this tolerance; the best that can be had is {}\n",
                    percent_text(plan.best_tolerance));
  }
  const char* label = "why";
  for (const Way* way : notable(plan)) {
    text += fmt::format(
        "{:<9} {}: apart from noise {}, noise {} / sqrt(spp), {} per spp, {} to build: {}\n", label,
        way->candidate.name, percent_text(root(way->candidate.bias_square.value)),
        percent_text(root(way->candidate.noise_square.value)),
        short_duration(way->candidate.seconds_per_spp),
        short_duration(way->candidate.build_seconds), why(plan, *way));
    label = "";
  }
  if (!plan.note.empty()) text += fmt::format("note      {}\n", plan.note);
  return text;
}

Json plan_json(const ScenePlan& plan) {
  const PlanQuestion& question = plan.question;
  Json json = {{"format", "heddle plan"},
               {"version", 1},
               {"scene", plan.scene.name},
               {"view", question.view},
               {"tolerance", question.target.tolerance},
               {"pictures", question.target.pictures},
               {"meets_tolerance", plan.chosen.has_value()},
               {"best_tolerance", plan.best_tolerance},
               {"plan_seconds", plan.time.seconds},
               {"plan_core_seconds", plan.time.core_seconds}};
  json["seen"] = Json::array();
  for (const SeenCloth& seen : plan.seen) {
    json["seen"].push_back({{"share", seen.share},
                            {"light_share", seen.light_share},
                            {"footprint_mm", seen.footprint_mm}});
  }
  json["choice"] = nullptr;
  if (plan.chosen) {
    const Way& way = plan.ways[*plan.chosen];
    Json& choice = json["choice"] = way_json(plan, way);
    choice["cloths"] = Json::array();
    for (std::size_t k = 0; k < plan.scene.cloths.size(); ++k)
      choice["cloths"].push_back(cloth_json(plan, way, k));
    choice["lights"] = Json::array();
    for (const Light& light : plan.scene.lights) {
      choice["lights"].push_back(
          {{"light", light_name(light)}, {"visibility", visibility_of(way, light)}});
    }
  }
  json["note"] = plan.note;
  json["considered"] = Json::array();
  for (const Way& way : plan.ways) json["considered"].push_back(way_json(plan, way));
  return json;
}

}  // namespace heddle
