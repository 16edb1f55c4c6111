#include "pipeline/plan/prior.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/plan/policy.h"

namespace heddle {
namespace {

/// The squared error under one light.
Estimate square_under(const LightShare& light, const AccuracyTable& table,
                      const TableSettings& settings, double footprint_mm, bool bent) {
  const auto at = [&](const std::string& setting) {
    return table.at(setting, light.sharpness, footprint_mm, light.cosine);
  };
  const Accuracy base = at(settings.base);
  Estimate square{base.bias_square, base.bias_square_error};
  for (const auto& [setting, of] : settings.changes) {
    // What a setting changes is known without the noise of path tracing, but not whether it makes
    // the error that is there smaller or larger: larger by part of the change at least.
    const Accuracy changed = at(setting);
    square.value += std::max(changed.bias_square - at(of).bias_square,
                             kPolicy.change_share * changed.change_square);
    square.error = std::max(square.error, changed.bias_square_error);
  }
  if (!bent) return square;
  // What folds add to a flat swatch seen from as far.
  const Accuracy flat =
      table.at(settings.base, light.sharpness, table.bent_footprint_mm, table.bent_light_cosine);
  const Accuracy folded = table.at_bent(settings.base, light.sharpness);
  square.value += std::max(0.0, folded.bias_square - flat.bias_square);
  // Other folds show other pairs of view and light, but many of them.
  square.error = folded.bias_square_error;
  return square;
}

}  // namespace

void OverLights::add(double weight, double square) {
  together_ += weight * std::sqrt(std::max(0.0, square));
  apart_ += weight * weight * square;
}

double OverLights::square() const {
  return kPolicy.lights_together * together_ * together_ + (1 - kPolicy.lights_together) * apart_;
}

TableSettings table_settings_of(const WaySettings& way, const SceneVariant::OfFabric& of_fabric) {
  TableSettings settings{render_method_name(way.method), {}};
  if (!is_precomputed(way.method)) return settings;
  if (way.variant.blend == kSignedDistanceOnly)
    settings.changes.emplace_back(kDistanceSetting, "exact");
  if (way.variant.blend == kLobesOnly) settings.changes.emplace_back(kGaussiansSetting, "exact");
  if (of_fabric.order) settings.changes.emplace_back(order_setting(*of_fabric.order), "exact");
  if (of_fabric.variant.cell_size != 1)
    settings.changes.emplace_back(cells_setting(of_fabric.variant.cell_size), "exact");
  if (of_fabric.variant.voxel_rate != 1)
    settings.changes.emplace_back(voxels_setting(of_fabric.variant.voxel_rate), "volume");
  return settings;
}

ClothPrior prior_of_cloth(const AccuracyTable& table, const TableSettings& settings,
                          const SeenCloth& cloth, bool bent) {
  OverLights squares;
  double error = 0;
  double noise = 0;
  double path_noise = 0;
  for (const LightShare& light : cloth.lights) {
    const Estimate square = square_under(light, table, settings, cloth.footprint_mm, bent);
    squares.add(light.weight, square.value);
    const double weight = light.weight * light.weight;
    const auto noise_of = [&](const std::string& setting) {
      return table.at(setting, light.sharpness, cloth.footprint_mm, light.cosine).noise_square;
    };
    error += weight * square.error;
    noise += weight * noise_of(settings.base);
    path_noise += weight * noise_of("path");
  }
  ClothPrior prior;
  prior.bias_square = {squares.square(), std::hypot(error, kPolicy.table_error * squares.square())};
  if (path_noise > 0) prior.noise_ratio = noise / path_noise;
  double seconds = table.setting(settings.base).seconds_per_sample;
  for (const auto& [setting, of] : settings.changes)
    seconds *= table.setting(setting).seconds_per_sample / table.setting(of).seconds_per_sample;
  prior.time_ratio = seconds / table.setting("path").seconds_per_sample;
  prior.setup_seconds = table.setting(settings.base).setup_seconds;
  return prior;
}

void add_light_from_behind(const SeenCloth& cloth, double through, ClothPrior& prior) {
  double all = 0;
  double squares = 0;
  for (const PixelLight& light : cloth.pixel_lights) {
    const double behind = light.back.shown(through);
    all += light.face.shown(through) + behind;
    squares += behind * behind;
  }
  if (!(squares > 0)) return;
  const double square = squares * static_cast<double>(cloth.pixel_lights.size()) / (all * all);
  prior.bias_square.value += square;
  prior.bias_square.error = std::hypot(prior.bias_square.error, kPolicy.table_error * square);
}

WayPrior prior_of_way(const WaySettings& way, const SceneConfig& scene, const ViewFacts& view,
                      const FabricTables& tables) {
  WayPrior prior;
  double noise = 0;
  double noise_weight = 0;
  double time = 0;
  double seen_share = 0;
  std::set<std::filesystem::path> set_up;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    if (!shows_fibers(scene, view, k)) continue;
    const ClothConfig& cloth = scene.cloths[k];
    const SeenCloth& seen = view.cloths[k];
    const bool bent = cloth.mesh.has_value();
    ClothPrior of_cloth;
    if (way.variant.stand_ins.contains(k)) {
      of_cloth = prior_of_cloth(tables.of_far_surface(cloth),
                                {surface_setting(cloth.far_surface->name), {}}, seen, bent);
    } else {
      const FabricFacts& fabric = tables.of(cloth.fabric);
      of_cloth = prior_of_cloth(fabric.table, table_settings_of(way, way.variant.of(cloth.fabric)),
                                seen, bent);
      if (is_precomputed(way.method) && !fabric.light_from_both_sides)
        add_light_from_behind(seen, fabric.table.through, of_cloth);
    }
    const double weight = seen.square_weight();
    prior.bias_square.value += weight * of_cloth.bias_square.value;
    prior.bias_square.error += weight * of_cloth.bias_square.error;
    noise += weight * of_cloth.noise_ratio;
    noise_weight += weight;
    time += seen.share * of_cloth.time_ratio;
    seen_share += seen.share;
    if (set_up.insert(cloth.fabric).second) {
      prior.setup_seconds += of_cloth.setup_seconds *
                             static_cast<double>(std::max<std::size_t>(1, view.lights.size()));
    }
  }
  if (noise_weight > 0) prior.noise_ratio = noise / noise_weight;
  if (seen_share > 0) prior.time_ratio = time / seen_share;
  return prior;
}

Estimate prior_between(const SceneConfig& scene, const ViewFacts& view,
                       const FabricTables& tables) {
  double square = 0;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    if (!shows_fibers(scene, view, k)) continue;
    const AccuracyTable& table = tables.of(scene.cloths[k].fabric).table;
    if (!(table.bent_enclosure_square > 0)) continue;
    const SeenCloth& seen = view.cloths[k];
    double of_folds = 0;
    for (const LightShare& light : seen.lights)
      of_folds += light.weight * table.between_at(light.sharpness);
    square += seen.square_weight() * kPolicy.between_of_folds * of_folds * seen.enclosure_square /
              table.bent_enclosure_square;
  }
  return {square, kPolicy.between_error * square};
}

double prior_of_low_order(int order, const SceneConfig& scene, const ViewFacts& view,
                          const FabricTables& tables) {
  double square = 0;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    if (!shows_fibers(scene, view, k)) continue;
    const FabricFacts& fabric = tables.of(scene.cloths[k].fabric);
    if (scene.cloths[k].mesh || fabric.order <= order) return 0;
    const SeenCloth& seen = view.cloths[k];
    OverLights changes;
    for (const LightShare& light : seen.lights) {
      changes.add(
          light.weight,
          fabric.table.at(order_setting(order), light.sharpness, seen.footprint_mm, light.cosine)
              .change_square);
    }
    square += seen.square_weight() * changes.square();
  }
  return square;
}

}  // namespace heddle
