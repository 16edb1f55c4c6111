#include "pipeline/warnings.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "fibers/math/random.h"
#include "formats/input_error.h"
#include "pipeline/json_file.h"
#include "render/near_lights.h"

namespace heddle {
namespace {

// Rays of pack_facts: the mean free path is good to 2 %.
constexpr int kFactSamples = 5000;

// How far light gets in a few scatterings. After them it has mostly left or gone dark.
constexpr double kNeighbourMeanFreePaths = 3;

// Eye rays of picture_warnings, at most, along the longer side of the picture.
constexpr int kProbesAcross = 32;

std::string percent(double share) {
  return fmt::format("{:.2g} %", 100 * share);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The cube of about `edge` that holds each segment's midpoint; whole cubes along the tile.
std::map<std::array<int, 3>, std::vector<std::uint32_t>> cubes_of(const Exemplar& exemplar,
                                                                  double edge) {
  const Vec3d size(exemplar.width_mm, exemplar.height_mm, exemplar.z_max - exemplar.z_min);
  const Vec3d scale = (size / edge).array().round().max(1.0) / size.array();
  std::map<std::array<int, 3>, std::vector<std::uint32_t>> cubes;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const Vec3d place = exemplar.segment_midpoint(s).cast<double>() - Vec3d(0, 0, exemplar.z_min);
    const Eigen::Vector3i cube = place.cwiseProduct(scale).array().floor().cast<int>();
    cubes[{cube.x(), cube.y(), cube.z()}].push_back(s);
  }
  return cubes;
}

/// Edge of cubes such that `count` of them hold segments.
double edge_of_cubes(const Exemplar& exemplar, std::size_t count, double shortest) {
  double low = shortest;
  double high = std::max<double>({exemplar.width_mm, exemplar.height_mm, 2 * shortest});
  for (int step = 0; step < 12; ++step) {
    const double middle = std::sqrt(low * high);
    (cubes_of(exemplar, middle).size() > count ? low : high) = middle;
  }
  return high;
}

/// Median over segments of the rms angle between the fibers of a segment's cube and their mean
/// direction, the largest principal axis of t t^T.
double neighbour_angle_of(const Exemplar& exemplar, double edge) {
  std::vector<double> angles;  // [segment]
  for (const auto& [cube, segments] : cubes_of(exemplar, edge)) {
    Mat3d tensor = Mat3d::Zero();
    for (const std::uint32_t s : segments) {
      const Vec3d tangent = exemplar.segment_tangent(s).cast<double>();
      tensor += tangent * tangent.transpose();
    }
    const double along =
        Eigen::SelfAdjointEigenSolver<Mat3d>(tensor).eigenvalues()[2] / tensor.trace();
    angles.insert(angles.end(), segments.size(),
                  std::asin(std::sqrt(std::clamp(1 - along, 0.0, 1.0))));
  }
  return median(std::move(angles));
}

double narrowest_lobe(const std::vector<FiberScattering>& fibers) {
  constexpr double kLeastShare = 0.1;
  double width = kPi;
  for (const FiberScattering& fiber : fibers) {
    if (fiber.isotropic_white) continue;
    if (fiber.color_r.maxCoeff() > kLeastShare) width = std::min(width, fiber.beta_r);
    if (((1 - fiber.color_r) * fiber.color_tt).maxCoeff() > kLeastShare)
      width = std::min(width, fiber.beta_tt);
  }
  return width;
}

std::string light_name(std::size_t light, std::size_t count) {
  return count == 1 ? std::string("the light") : fmt::format("light {}", light + 1);
}

/// What a grid of eye rays sees.
struct Probe {
  std::size_t hits = 0;
  std::vector<double> pixel_radii;  // [hit] edge of a pixel
  std::vector<double> repeats;      // [hit] the same in tiles
  std::size_t grazing = 0;
  std::size_t near_rim = 0;
  std::vector<std::size_t> behind;    // [light] fabrics with light from the face only
  std::vector<std::size_t> in_plane;  // [light] fabrics with light from both sides
  std::vector<std::size_t> close;     // [light] within kNearTiles
  std::vector<double> least_tiles;    // [light] its distance from the nearest hit, in tiles
};

bool is_near_rim(const ClothScene& scene, const ShellHit& hit) {
  const Shell& shell = scene.shell(hit.cloth);
  const double reach = kRimThicknesses * (shell.z_max() - shell.z_min());
  for (int k = 0; k < 8; ++k) {
    const double angle = k * kPi / 4;
    const Eigen::Vector2d place =
        hit.fabric.head<2>() + reach * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    if (!scene.surface_point(hit, place, ClothSide::kFace)) return true;
  }
  return false;
}

Probe probe_of(const PictureSetup& setup) {
  const ClothScene& scene = *setup.scene;
  Probe probe;
  probe.behind.assign(setup.lights.size(), 0);
  probe.in_plane.assign(setup.lights.size(), 0);
  probe.close.assign(setup.lights.size(), 0);
  probe.least_tiles.assign(setup.lights.size(), std::numeric_limits<double>::infinity());
  const int step = std::max(1, std::max(setup.crop.width, setup.crop.height) / kProbesAcross);
  for (int y = setup.crop.y0 + step / 2; y < setup.crop.y0 + setup.crop.height; y += step) {
    for (int x = setup.crop.x0 + step / 2; x < setup.crop.x0 + setup.crop.width; x += step) {
      const EyeRay ray = setup.camera->ray(x + 0.5, y + 0.5);
      SceneRay scene_ray{ray.origin, ray.direction};
      if (const auto mesh = scene.first_mesh(ray.origin, ray.direction)) scene_ray.t_max = mesh->t;
      const std::optional<ShellHit> hit = scene.first_fiber(scene_ray);
      if (!hit) continue;
      ++probe.hits;
      const Exemplar& exemplar = scene.exemplar(hit->part);
      const double pixel = ray.spread * hit->t;
      probe.pixel_radii.push_back(pixel / exemplar.radius_mm[exemplar.segment_fiber[hit->segment]]);
      probe.repeats.push_back(pixel / std::max(exemplar.width_mm, exemplar.height_mm));
      const float height = scene.fabric_direction(*hit, -ray.direction).z();
      if (std::abs(height) < std::cos(radians(kGrazingDegrees))) ++probe.grazing;
      if (is_near_rim(scene, *hit)) ++probe.near_rim;
      for (std::size_t l = 0; l < setup.lights.size() && !setup.packs.empty(); ++l) {
        RandomStream random(1, RandomStage::kLightVisibility,
                            static_cast<std::uint64_t>(y) << 32U | static_cast<std::uint64_t>(x),
                            l);
        const Light& light = setup.lights[l];
        const LightSample sample = sample_light(light, hit->position, random);
        const Vec3& direction = sample.direction;
        if (light.is_near()) {
          const double tiles = distance_to_light(light, hit->position) /
                               std::max(exemplar.width_mm, exemplar.height_mm);
          if (tiles < kNearTiles) ++probe.close[l];
          probe.least_tiles[l] = std::min(probe.least_tiles[l], tiles);
        }
        const float height_of_light = scene.fabric_direction(*hit, direction).z();
        if (setup.packs[hit->part]->light_from_both_sides) {
          if (std::abs(height_of_light) < std::sin(radians(kPlaneDegrees))) ++probe.in_plane[l];
        } else if (height_of_light <= 0 &&
                   scene.globally_visible(scene.surface_point(*hit, ClothSide::kBack), direction,
                                          sample.distance)) {
          ++probe.behind[l];
        }
      }
    }
  }
  return probe;
}

void add_light_warnings(const PictureSetup& setup, std::vector<Warning>& warnings) {
  const SgVisibility* sphere = nullptr;  // of the first fabric with light from both sides
  for (const FabricPack* pack : setup.packs) {
    if (sphere == nullptr && pack->sgs && pack->light_from_both_sides) sphere = &*pack->sgs;
  }
  for (std::size_t l = 0; l < setup.lights.size(); ++l) {
    const Light& light = setup.lights[l];
    if (light.type == LightType::kSphericalGaussian && setup.interactive_surfaces &&
        light.sharpness < kInteractiveSharpness) {
      warnings.push_back(
          {"wide-light",
           fmt::format("{} has sharpness {:g}, and interactive surfaces take light below {:g} as "
                       "if their weights were constant across it",
                       light_name(l, setup.lights.size()), light.sharpness, kInteractiveSharpness),
           light.sharpness < 3 ? 0.4 : 0.13,
           "surface_method = \"sampled\", or several sharper lights in its place"});
    }
    if (light.type != LightType::kSphericalGaussian ||
        method_row(setup.method).visibility != VisibilityData::kByLight)
      continue;
    const double sharpness = light.sharpness;
    const std::string name =
        fmt::format("{} has sharpness {:g}", light_name(l, setup.lights.size()), sharpness);
    const double lobes_limit = sphere != nullptr ? kSphereLobesSharpness : kLobesSharpness;
    if (setup.blend.uses_lobes(light.sharpness) && sharpness > lobes_limit) {
      warnings.push_back(
          {"sum-of-gaussians",
           fmt::format(
               "{}, and only sums of Gaussians serve it, which leak light from sharpness {:g} on",
               name, lobes_limit),
           0.3, "Let signed distances serve it (visibility blend 10 to 20)"});
    }
    if (setup.blend.uses_distance(light.sharpness) && sharpness < kDistanceSharpness) {
      warnings.push_back(
          {"signed-distance",
           fmt::format(
               "{}, and signed distances serve it, which know one edge only and fail below {:g}",
               name, kDistanceSharpness),
           0.4, "Let sums of Gaussians serve it (visibility blend 10 to 20)"});
    }
    if (method_row(setup.method).as_printed && sharpness < kPrintedGammaSharpness) {
      warnings.push_back({"gamma",
                          fmt::format("{}; Gamma as printed is off at grazing views below {:g}",
                                      name, kPrintedGammaSharpness),
                          0.15, "--method exact"});
    }
  }
}

}  // namespace

std::string warning_text(const Warning& warning) {
  return fmt::format("warning: {}: {}; expect errors of about {}. {}.", warning.subject,
                     warning.what, percent(warning.expected_error), warning.instead);
}

nlohmann::ordered_json warnings_report(std::span<const Warning> warnings) {
  nlohmann::ordered_json report = nlohmann::ordered_json::array();
  for (const Warning& warning : warnings) {
    report.push_back({{"subject", warning.subject},
                      {"what", warning.what},
                      {"expected_relative_error", warning.expected_error},
                      {"instead", warning.instead}});
  }
  return report;
}

std::vector<Warning> read_warnings(const std::filesystem::path& path) {
  const nlohmann::json report = read_json(path);
  std::vector<Warning> warnings;
  try {
    if (report.is_object() && !report.contains("warnings")) return {};
    for (const auto& entry : report.at("warnings")) {
      warnings.push_back({entry.at("subject").get<std::string>(),
                          entry.at("what").get<std::string>(),
                          entry.at("expected_relative_error").get<double>(),
                          entry.at("instead").get<std::string>()});
    }
  } catch (const nlohmann::json::exception& error) {
    throw FileError(fmt::format("{}: no picture's report: {}", path.string(), error.what()));
  }
  return warnings;
}

PackFacts pack_facts(const FabricPack& pack, const TileScene& tile) {
  const Exemplar& exemplar = pack.exemplar;
  PackFacts facts;
  facts.mean_free_path_mm = tile.mean_free_path(1, kFactSamples);
  if (!(facts.mean_free_path_mm > 0)) return facts;  // no fiber sees another
  if (pack.transfer) {
    facts.cell_mean_free_paths =
        edge_of_cubes(exemplar, pack.transfer->cell_count(), 0.2 * facts.mean_free_path_mm) /
        facts.mean_free_path_mm;
  }
  facts.neighbour_angle =
      neighbour_angle_of(exemplar, kNeighbourMeanFreePaths * facts.mean_free_path_mm);
  facts.lobe_width = narrowest_lobe(exemplar.scattering);
  return facts;
}

std::vector<Warning> pack_warnings(const FabricPack& pack, const TileScene& tile) {
  std::vector<Warning> warnings;
  if (!pack.transfer) return warnings;
  const PackFacts facts = pack_facts(pack, tile);
  if (facts.cell_mean_free_paths > kCellMeanFreePaths) {
    warnings.push_back({"cells",
                        fmt::format("{}: {} cells, as large as cubes of {:.1f} mean free paths "
                                    "({:.0f} um each); too dark and blocky",
                                    pack.name, pack.transfer->cell_count(),
                                    facts.cell_mean_free_paths, 1e3 * facts.mean_free_path_mm),
                        0.3, "A smaller cell_mean_free_paths in [transfer]"});
  }
  const double spread = std::hypot(facts.neighbour_angle, facts.lobe_width);
  if (facts.mean_free_path_mm > 0 && !pack.transfer->cones && spread < radians(kParallelDegrees)) {
    warnings.push_back({"truncation",
                        fmt::format("{}: neighbouring fibers lie within {:.1f} degrees of each "
                                    "other and scatter into lobes of {:.1f} "
                                    "degrees; harmonics of order {} cannot hold light that narrow",
                                    pack.name, degrees(facts.neighbour_angle),
                                    degrees(facts.lobe_width), pack.transfer->order),
                        0.25, "cones = \"on\" in [transfer], or --method path"});
  }
  return warnings;
}

std::vector<Warning> picture_warnings(const PictureSetup& setup) {
  std::vector<Warning> warnings;
  const std::uint32_t flipped = setup.scene->flipped_tets();
  const std::uint32_t degenerate = setup.scene->degenerate_tets();
  std::size_t tets = 0;
  for (std::uint32_t cloth = 0; cloth < setup.scene->cloth_count(); ++cloth)
    tets += setup.scene->shell(cloth).tets().size();
  const double hidden =
      tets > 0 ? static_cast<double>(flipped + degenerate) / static_cast<double>(tets) : 0;
  if (hidden > kHiddenTetShare) {
    warnings.push_back(
        {"shell",
         fmt::format("{} of {} tetrahedra of the cloth's shell are flipped and {} degenerate: "
                     "folds tighter than the "
                     "cloth is thick, or collapsed UVs; nothing is drawn inside them",
                     flipped, tets, degenerate),
         hidden, "A smoother mesh, or thinner cloth"});
  }
  if (traces_paths(setup.method)) return warnings;

  add_light_warnings(setup, warnings);
  const Probe probe = probe_of(setup);
  if (probe.hits == 0) return warnings;
  const auto share = [&](std::size_t count) {
    return static_cast<double>(count) / static_cast<double>(probe.hits);
  };
  for (std::size_t l = 0; l < setup.lights.size(); ++l) {
    const std::string name = light_name(l, setup.lights.size());
    if (share(probe.behind[l]) > kBehindShare) {
      warnings.push_back({"behind",
                          fmt::format("{} reaches {} of the cloth in the picture from behind, and "
                                      "the data hold light from the face "
                                      "only: light that shines through is missing",
                                      name, percent(share(probe.behind[l]))),
                          1,
                          "light_from = \"both\" in the fabric, an underlay where nothing should "
                          "shine through, or --method path"});
    }
    if (share(probe.close[l]) > kNearShare) {
      warnings.push_back(
          {"near-light",
           fmt::format("{} is as near as {:.2g} tiles to the cloth in the picture, and {} of it "
                       "lies within {:g}: light is taken as parallel within a tile",
                       name, probe.least_tiles[l], percent(share(probe.close[l])), kNearTiles),
           0.1, "A light further away, or --method path"});
    }
    if (share(probe.in_plane[l]) > 0.5) {
      warnings.push_back({"behind",
                          fmt::format("{} lies within {:g} degrees of the plane of {} of the cloth "
                                      "in the picture, whose data hold light "
                                      "from both sides: there it fades faster than harmonics tell",
                                      name, kPlaneDegrees, percent(share(probe.in_plane[l]))),
                          0.15, "light_from = \"face\", or --method path"});
    }
  }
  const double pixel = median(probe.pixel_radii);
  if (pixel < kPixelRadii) {
    warnings.push_back({"zoom",
                        fmt::format("a pixel is {:.2g} radii of a fiber wide: one sees that a "
                                    "segment has a single visibility",
                                    pixel),
                        0.35, "--method path"});
  }
  if (share(probe.grazing) > 0.5) {
    warnings.push_back(
        {"grazing",
         fmt::format(
             "{} of the cloth in the picture is seen at more than {:g} degrees from its normal",
             percent(share(probe.grazing)), kGrazingDegrees),
         0.15, "--method path"});
  }
  if (share(probe.near_rim) > kRimShare) {
    warnings.push_back({"rim",
                        fmt::format("{} of the cloth in the picture lies within its own thickness "
                                    "of a rim or a UV seam; the data are "
                                    "those of endless cloth",
                                    percent(share(probe.near_rim))),
                        0.1, "--method path, or UVs without a seam there"});
  }
  return warnings;
}

std::vector<Warning> frame_warnings(const PictureSetup& setup, const FrameBuffers& frame) {
  std::vector<Warning> warnings;
  double negative = 0;
  double all = 0;
  for (const Rgb& value : frame.multiple) {
    negative += static_cast<double>((-value).max(0.0F).sum());
    all += static_cast<double>(value.abs().sum());
  }
  if (all > 0 && negative / all > kNegativeShare) {
    warnings.push_back({"ringing",
                        fmt::format("{} of the light that scattered more than once is negative: "
                                    "harmonics ring under strong light from "
                                    "one side",
                                    percent(negative / all)),
                        0.2, "--method path, or softer light"});
  }
  if (frame.variance.empty()) return warnings;
  const Probe probe = probe_of(setup);
  if (probe.hits == 0 || median(probe.repeats) < 1) return warnings;
  double variance = 0;
  double mean = 0;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    if (frame.alpha[k] < 1) continue;
    variance += static_cast<double>(frame.variance[k].sum());
    mean += static_cast<double>(frame.beauty[k].sum());
  }
  const double count = static_cast<double>(
      std::count_if(frame.alpha.begin(), frame.alpha.end(), [](float a) { return a >= 1; }));
  const double noise = mean > 0 ? std::sqrt(variance * count * 3) / mean : 0;
  if (noise > kNoise) {
    warnings.push_back({"distance",
                        fmt::format("a pixel covers {:.1f} repeats of the cloth with {} samples",
                                    median(probe.repeats), frame.spp),
                        noise, "More samples, far_from = 1, or a surface model"});
  }
  return warnings;
}

}  // namespace heddle
