// Curves of whole pictures: small fabrics through all stages, rendered, against path-traced
// pictures of the same eye rays.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/warnings.h"
#include "render/render_output.h"
#include "tests/stability/small_pipeline.h"
#include "tests/stability/stability_curve.h"

namespace heddle::stability {
namespace {

constexpr double kDegree = kPi / 180;

Vec3d inclined(double degrees_from_normal, double azimuth_deg) {
  const double theta = degrees_from_normal * kDegree;
  const double phi = azimuth_deg * kDegree;
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// Silk whose filaments float: an untwisted satin, specular and red.
SmallFabric satin() {
  SmallFabric fabric;
  fabric.weave = "notation = \"satin 5/2\"\nface = \"warp\"";
  fabric.radius_um = 5;
  fabric.spacing_mm = 0.1;
  fabric.width_mm = 0.095;
  fabric.height_mm = 0.07;
  fabric.fibers = 32;
  fabric.segment_um = 100;
  fabric.cell_mean_free_paths = 4;
  fabric.paths = 1024;
  fabric.color_r = "[0.745, 0.008, 0.07]";
  fabric.color_tt = "[0.62, 0.553, 0.562]";
  fabric.beta_r_deg = 1;
  fabric.beta_tt_deg = 10;
  fabric.gamma_tt_deg = 20;
  fabric.twist_per_m = 0;
  fabric.wander_deg = 0;
  return fabric;
}

/// Pixels by a channel of the picture's first samples.
template <class Choose>
std::vector<bool> chosen_pixels(const Image& picture, Choose&& choose) {
  const std::vector<float>& u = picture.channels.at("u").values;
  const std::vector<float>& v = picture.channels.at("v").values;
  const std::vector<std::uint32_t>& segment = picture.channels.at("segment").ids;
  std::vector<bool> chosen(u.size());
  for (std::size_t k = 0; k < u.size(); ++k) {
    chosen[k] =
        segment[k] != 0xffffffffU && choose(static_cast<double>(u[k]), static_cast<double>(v[k]));
  }
  return chosen;
}

}  // namespace

Curve ringing_curve(Effort effort) {
  Curve curve{.title = "Ringing under light from one side (untwisted silk satin)",
              .driver = "sharpness of the light, 80 deg from the normal (1e6: directional)",
              .measure = "negative share of multiple scattering; |mean / reference - 1|",
              .is_log = true,
              .drivers = effort == Effort::kFull ? std::vector<double>{1, 3, 10, 30, 100, 1000, 1e6}
                                                 : std::vector<double>{3, 1e6},
              .series = {{"negative share", {}}, {"mean of multiple scattering", {}}},
              .warning_from = {}};
  SmallPipeline pipeline(satin());
  for (const double sharpness : curve.drivers) {
    SmallScene scene;
    scene.wide_mm = 1;
    scene.light =
        sharpness < 1e6 ? gaussian(inclined(80, 20), sharpness) : directional(inclined(80, 20));
    const PictureResult fast = pipeline.picture(scene, RenderMethod::kExact, 64);
    const PictureResult truth = pipeline.picture(scene, RenderMethod::kPath, 64);
    double negative = 0;
    double all = 0;
    for (const Rgb& value : layer_of(fast.image, "multiple", "picture")) {
      for (int c = 0; c < 3; ++c) {
        negative += std::max(0.0F, -value[c]);
        all += std::abs(value[c]);
      }
    }
    curve.series[0].values.push_back(negative / all);
    curve.series[1].values.push_back(
        std::abs(mean_of(fast.image, "multiple") / mean_of(truth.image, "multiple") - 1));
  }
  return curve;
}

Curve cells_curve(Effort effort) {
  Curve curve{.title = "Cells larger than a mean free path",
              .driver = "edge of a cell, mean free paths",
              .measure = "relative RMSE of pixels; |mean / reference - 1|",
              .is_log = true,
              .drivers = {},
              .series = {{"RMSE of pixels", {}}, {"darkening", {}}},
              .warning_from = kCellMeanFreePaths};
  SmallFabric fabric;
  // Dense, thin and white: light scatters often, and a yarn is several mean free paths thick.
  fabric.radius_um = 6;
  fabric.fibers = 72;
  fabric.color_tt = "[0.97, 0.97, 0.97]";
  fabric.cell_mean_free_paths = 1;
  SmallPipeline pipeline(fabric);
  SmallScene scene;
  const std::vector<double> factors =
      effort == Effort::kFull ? std::vector<double>{2, 3, 4, 6, 8, 12} : std::vector<double>{4, 12};
  const int spp = effort == Effort::kFull ? 256 : 128;
  const PictureResult truth = pipeline.picture(scene, RenderMethod::kPath, spp);
  for (const double factor : factors) {
    const FabricVariant cells{.cell_size = factor};
    const SceneVariant variant =
        variant_of_fabrics(pipeline.job(scene).config(), {.variant = cells});
    const PictureResult fast = pipeline.picture(scene, RenderMethod::kExact, spp, true, variant);
    const FabricPack pack = pipeline.pack(cells);
    curve.drivers.push_back(pack_facts(pack, TileScene(pack.exemplar)).cell_mean_free_paths);
    curve.series[0].values.push_back(relative_error(fast.image, truth.image));
    curve.series[1].values.push_back(
        std::abs(mean_of(fast.image, "") / mean_of(truth.image, "") - 1));
  }
  return curve;
}

Curve tile_border_curve(Effort effort) {
  Curve curve{.title = "Borders between copies of the exemplar",
              .driver = "distance from the border, share of the tile",
              .measure = "relative RMSE of pixels",
              .is_log = false,
              .drivers = {0.025, 0.075, 0.15, 0.25, 0.38},
              .series = {{"shipped", {}}},
              .warning_from = {}};
  SmallPipeline pipeline;
  SmallScene scene;
  scene.pixels = effort == Effort::kFull ? 128 : 64;
  scene.wide_mm = 3.2;
  const PictureResult fast = pipeline.picture(scene, RenderMethod::kExact, 64);
  const PictureResult truth = pipeline.picture(scene, RenderMethod::kPath, 64);
  const double tile = 2 * SmallFabric{}.spacing_mm;
  for (const double middle : curve.drivers) {
    const double half = middle < 0.1 ? 0.025 : middle < 0.3 ? 0.05 : 0.12;
    const auto chosen = chosen_pixels(fast.image, [&](double u, double v) {
      const auto distance = [&](double x) {
        const double place = x / tile - std::floor(x / tile);
        return std::min(place, 1 - place);
      };
      return std::abs(std::min(distance(u), distance(v)) - middle) <= half;
    });
    curve.series[0].values.push_back(relative_error(fast.image, truth.image, chosen));
  }
  return curve;
}

Curve rim_curve(Effort effort) {
  Curve curve{.title = "Rims: where the cloth, or a chart of its UVs, ends",
              .driver = "distance from the rim, thicknesses of the cloth",
              .measure = "|light beside the rim / light of endless cloth - 1|",
              .is_log = false,
              .drivers = {0.125, 0.375, 0.75, 1.25, 1.75, 2.5, 3.5, 5},
              .series = {{"reference", {}}, {"shipped, which should follow it", {}}},
              .warning_from = kRimThicknesses,
              .warns_above = false};
  const SmallFabric fabric;
  SmallPipeline pipeline(fabric);
  SmallScene scene;
  scene.look_at = {0.6, 0, 0};
  scene.eye = {0.8, -0.5, 4};
  scene.wide_mm = 1;
  scene.pixels = effort == Effort::kFull ? 64 : 32;
  scene.light = directional(inclined(60, 0));  // shines on the rim
  const double rim = 1;
  // Fabric space is world space in both, so the same fibers are seen.
  const auto picture = [&](RenderMethod method, double flat_mm) {
    scene.flat_mm = flat_mm;
    return pipeline.picture(scene, method, effort == Effort::kFull ? 256 : 64).image;
  };
  const Image fast = picture(RenderMethod::kExact, 2 * rim);
  const std::array<std::array<std::vector<Rgb>, 2>, 2> values = {
      {{layer_of(picture(RenderMethod::kPath, 2 * rim), "", "picture"),
        layer_of(picture(RenderMethod::kPath, 40), "", "picture")},
       {layer_of(fast, "", "picture"),
        layer_of(picture(RenderMethod::kExact, 40), "", "picture")}}};
  const double thickness = 2 * fabric.height_mm;
  std::vector<double> kept;
  for (std::size_t d = 0; d < curve.drivers.size(); ++d) {
    const double low = d == 0 ? 0 : 0.5 * (curve.drivers[d - 1] + curve.drivers[d]);
    const double high =
        d + 1 == curve.drivers.size() ? 6 : 0.5 * (curve.drivers[d] + curve.drivers[d + 1]);
    const auto chosen = chosen_pixels(fast, [&](double u, double) {
      const double distance = (rim - u) / thickness;
      return distance >= low && distance < high;
    });
    if (std::find(chosen.begin(), chosen.end(), true) == chosen.end()) continue;
    kept.push_back(curve.drivers[d]);
    for (std::size_t m = 0; m < 2; ++m) {
      std::array<double, 2> sum{};  // with and without the rim
      for (std::size_t k = 0; k < chosen.size(); ++k) {
        if (!chosen[k]) continue;
        for (std::size_t e = 0; e < 2; ++e) sum[e] += static_cast<double>(values[m][e][k].sum());
      }
      curve.series[m].values.push_back(std::abs(sum[0] / sum[1] - 1));
    }
  }
  curve.drivers = kept;
  return curve;
}

Curve behind_curve(Effort effort) {
  Curve curve{
      .title = "Thin cloth lit from behind",
      .driver = "light from the normal, degrees",
      .measure = "|mean - reference| / reference at 60 degrees",
      .is_log = false,
      .drivers = effort == Effort::kFull
                     ? std::vector<double>{60, 0, 30, 75, 85, 89, 91, 95, 105, 120, 150, 180}
                     : std::vector<double>{60, 91, 120, 180},
      .series = {{"data for light from the face", {}}, {"data for light from both sides", {}}},
      .warning_from = 90.0};
  for (const bool both : {false, true}) {
    SmallFabric fabric;
    fabric.light_from = both ? "both" : "face";
    SmallPipeline pipeline(fabric);
    double scale = 0;
    for (const double degrees : curve.drivers) {
      SmallScene scene;
      scene.light = directional(inclined(degrees, 30));
      const int spp = effort == Effort::kFull ? 128 : 32;
      const double fast = mean_of(pipeline.picture(scene, RenderMethod::kExact, spp).image, "");
      const double truth = mean_of(pipeline.picture(scene, RenderMethod::kPath, spp).image, "");
      if (scale == 0) scale = truth;
      curve.series[both ? 1 : 0].values.push_back(std::abs(fast - truth) / scale);
    }
  }
  return curve;
}

Curve near_light_curve(Effort effort) {
  Curve curve{.title = "Lights close to the cloth",
              .driver = "distance of the light, tiles",
              .measure = "relative RMSE of pixels",
              .is_log = true,
              .drivers = effort == Effort::kFull ? std::vector<double>{1, 2, 4, 8, 16, 64, 256}
                                                 : std::vector<double>{1, 16, 256},
              .series = {{"point", {}}, {"sphere", {}}, {"rectangle", {}}, {"Gaussian", {}}},
              .warning_from = kNearTiles,
              .warns_above = false};
  const SmallFabric fabric;
  SmallPipeline pipeline(fabric);
  const int spp = effort == Effort::kFull ? 512 : 128;
  const Vec3d axis = Vec3d(0.3, 0.2, 1).normalized();
  const auto measure = [&](const std::string& light, const std::string& brightness) {
    SmallScene scene;
    scene.light = light;
    scene.brightness = brightness;
    return relative_error(pipeline.picture(scene, RenderMethod::kExact, spp).image,
                          pipeline.picture(scene, RenderMethod::kPath, spp).image);
  };
  // Sphere and rectangle keep their angular size: half angles of 15 degrees about.
  const double of_gaussian = measure(gaussian(axis, 60), "irradiance = [3, 3, 3]\n");
  for (const double tiles : curve.drivers) {
    const double d = 2 * fabric.spacing_mm * tiles;
    const Vec3d p = d * axis;
    const std::string place = fmt::format("position_mm = [{}, {}, {}]\n", p.x(), p.y(), p.z());
    const double at_1_m = 3 * d * d * 1e-6;
    curve.series[0].values.push_back(
        measure("type = \"point\"\n" + place,
                fmt::format("irradiance_at_1_m = [{0}, {0}, {0}]\n", at_1_m)));
    curve.series[1].values.push_back(
        measure(fmt::format("type = \"sphere\"\n{}radius_mm = {}\n", place, 0.26 * d),
                "radiance = [10, 10, 10]\n"));
    curve.series[2].values.push_back(measure(
        fmt::format("type = \"rectangle\"\n{}look_at_mm = [0, 0, 0]\nup = [0, 1, 0]\nsize_mm = "
                    "[{}, {}]\n",
                    place, 0.5 * d, 0.4 * d),
        "radiance = [10, 10, 10]\n"));
    curve.series[3].values.push_back(of_gaussian);
  }
  return curve;
}

Curve grazing_curve(Effort effort) {
  Curve curve{.title = "Grazing views",
              .driver = "view from the normal, degrees",
              .measure = "relative RMSE of pixels; |mean / reference - 1|",
              .is_log = false,
              .drivers = effort == Effort::kFull
                             ? std::vector<double>{0, 20, 40, 60, 70, 75, 80, 85, 87, 88.5, 89.5}
                             : std::vector<double>{40, 80, 89.5},
              .series = {{"RMSE of pixels", {}}, {"mean", {}}},
              .warning_from = kGrazingDegrees};
  SmallPipeline pipeline;
  for (const double degrees : curve.drivers) {
    SmallScene scene;
    scene.flat_mm = 400;
    scene.eye = 50 * inclined(degrees, -80);
    scene.wide_mm = 1.6;
    const int spp = effort == Effort::kFull ? 256 : 96;
    const PictureResult fast = pipeline.picture(scene, RenderMethod::kExact, spp);
    const PictureResult truth = pipeline.picture(scene, RenderMethod::kPath, spp);
    curve.series[0].values.push_back(relative_error(fast.image, truth.image));
    curve.series[1].values.push_back(
        std::abs(mean_of(fast.image, "") / mean_of(truth.image, "") - 1));
  }
  return curve;
}

Curve truncation_curve(Effort effort) {
  Curve curve{.title = "Specular parallel filaments (satin)",
              .driver = "rms angle between neighbouring fibers, degrees",
              .measure = "relative RMSE of the flat response, multiple scattering alone",
              .is_log = false,
              .drivers = {},
              .series = {{"order 5 alone", {}}, {"shipped", {}}},
              .warning_from = kParallelDegrees,
              .warns_above = false};
  const bool full = effort == Effort::kFull;
  if (full) {
    curve.series.push_back({"shipped, beta_R 15 deg", {}});
    curve.series.push_back({"cones = \"on\"", {}});
  }
  const std::vector<double> wanders =
      full ? std::vector<double>{0, 4, 8, 15, 25} : std::vector<double>{0, 25};
  for (std::size_t which = 0; which < curve.series.size(); ++which) {
    for (const double wander : wanders) {
      SmallFabric fabric = satin();
      fabric.beta_r_deg = which == 2 ? 15 : 1;
      fabric.beta_tt_deg = which == 2 ? 15 : 10;
      fabric.wander_deg = wander;
      if (which == 0) fabric.cones = "off";
      if (which == 3) fabric.cones = "on";
      SmallPipeline pipeline(fabric);
      double square = 0;
      double mean = 0;
      int count = 0;
      for (const double view :
           full ? std::vector<double>{-60, -20, 20, 60} : std::vector<double>{20}) {
        for (const double azimuth : {0.0, 60.0, 90.0}) {
          SmallScene scene;
          scene.wide_mm = 1;
          scene.pixels = 16;
          scene.light = directional(inclined(40, azimuth));
          scene.eye = 4 * inclined(view, 90);  // in the plane of the floats
          const auto colour = [&](RenderMethod method) {
            const Image image = pipeline.picture(scene, method, full ? 256 : 64).image;
            const std::vector<Rgb> values = layer_of(image, "multiple", "picture");
            Rgbd sum = Rgbd::Zero();
            for (const Rgb& value : values)
              sum += value.cast<double>() / static_cast<double>(values.size());
            return sum;
          };
          const Rgbd truth = colour(RenderMethod::kPath);
          square += (colour(RenderMethod::kExact) - truth).square().sum();
          mean += truth.sum();
          count += 3;
        }
      }
      curve.series[which].values.push_back(std::sqrt(square / count) / (mean / count));
      if (which > 0) continue;
      const FabricPack pack = pipeline.pack();
      curve.drivers.push_back(pack_facts(pack, TileScene(pack.exemplar)).neighbour_angle / kDegree);
    }
  }
  return curve;
}

Curve zoom_curve(Effort effort) {
  const SmallFabric fabric;
  Curve curve{.title = "Microscope zoom: one value per segment",
              .driver = "edge of a pixel, radii of a fiber",
              .measure = "relative RMSE of pixels",
              .is_log = true,
              .drivers = {},
              .series = {{"directional light", {}}, {"sharpness 10", {}}},
              .warning_from = kPixelRadii,
              .warns_above = false};
  SmallPipeline pipeline(fabric);
  SmallScene scene;
  scene.pixels = effort == Effort::kFull ? 256 : 64;
  const double finest = effort == Effort::kFull ? 0.125 : 0.25;  // radii
  scene.wide_mm = finest * scene.pixels * fabric.radius_um * 1e-3;
  for (std::size_t l = 0; l < 2; ++l) {
    if (l > 0) scene.light = gaussian({0.3, 0.2, 1}, 10);
    const int spp = 32;
    const PictureResult fast = pipeline.picture(scene, RenderMethod::kExact, spp);
    const PictureResult truth = pipeline.picture(scene, RenderMethod::kPath, spp);
    for (int edge = 1; edge <= scene.pixels / 4; edge *= 2) {
      if (l == 0) curve.drivers.push_back(finest * edge);
      curve.series[l].values.push_back(
          relative_error(averaged(fast.image, edge), averaged(truth.image, edge)));
    }
  }
  return curve;
}

Curve distance_curve(Effort effort) {
  Curve curve{.title = "Distant views: a pixel covers more than a few samples show",
              .driver = "edge of a pixel, repeats of the cloth",
              .measure = "noise: deviation of pixels / mean",
              .is_log = true,
              .drivers = effort == Effort::kFull
                             ? std::vector<double>{0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30}
                             : std::vector<double>{0.03, 3},
              .series = {{"between pixels, 16 spp", {}},
                         {"reported, 16 spp", {}},
                         {"reported, 64 spp", {}}},
              .warning_from = 1.0};
  const SmallFabric fabric;
  SmallPipeline pipeline(fabric);
  const double tile = 2 * fabric.spacing_mm;
  for (const double repeats : curve.drivers) {
    SmallScene scene;
    scene.wide_mm = repeats * tile * scene.pixels;
    scene.flat_mm = std::max(40.0, 2 * scene.wide_mm);
    scene.eye = scene.wide_mm * Vec3d(0.3, -0.7, 20);
    for (const int spp : {16, 64}) {
      const PictureResult fast = pipeline.picture(scene, RenderMethod::kExact, spp);
      const std::vector<Rgb> colors = layer_of(fast.image, "", "picture");
      if (spp == 16) {
        // Against the mean of the neighbours, which at this distance see the same cloth.
        double square = 0;
        int count = 0;
        for (int y = 0; y < scene.pixels; ++y) {
          for (int x = 0; x + 1 < scene.pixels; ++x) {
            const std::size_t k = static_cast<std::size_t>(y * scene.pixels + x);
            square += 0.5 * static_cast<double>((colors[k] - colors[k + 1]).square().sum()) / 3;
            ++count;
          }
        }
        curve.series[0].values.push_back(std::sqrt(square / count) / mean_of(fast.image, ""));
      }
      double variance = 0;
      for (const Rgb& value : layer_of(fast.image, "Variance", "picture"))
        variance += static_cast<double>(value.sum()) / 3;
      curve.series[spp == 16 ? 1 : 2].values.push_back(
          std::sqrt(variance / static_cast<double>(colors.size())) / mean_of(fast.image, ""));
    }
  }
  return curve;
}

}  // namespace heddle::stability
