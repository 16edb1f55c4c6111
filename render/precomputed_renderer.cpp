#include "render/precomputed_renderer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "formats/input_error.h"
#include "render/rivals/prt_scattering.h"
#include "render/rivals/tsai_shih_scattering.h"

namespace heddle {
namespace {

/// Draws after which a light counts as wholly behind the cloth. Of a light with a tenth of its mass
/// in front, 3 % of the draws find none of it.
constexpr int kFaceDraws = 32;

/// A block is this many pixels wide and high, and takes this many samples at a time: 2048 samples
/// fill a G-buffer of 400 KB, and give a close-up enough samples per cell to sort.
constexpr int kBlockEdge = 16;
constexpr int kBlockSamples = 8;

/// Blocks between two calls of the progress callback.
constexpr int kBlocksPerReport = 64;

Vec2 sample_gaussian2(RandomStream& random) {
  const float radius = std::sqrt(-2 * std::log(1 - random.uniform()));
  const float angle = 2 * kPif * random.uniform();
  return radius * Vec2(std::cos(angle), std::sin(angle));
}

void require(bool present, const FabricPack& pack, const char* what) {
  if (present) return;
  throw FileError(fmt::format("{}: the pack holds no {}, which this picture needs",
                              pack.folder.string(), what));
}

std::shared_ptr<const SingleScatteringModel> single_scattering_of(const FabricPack& pack,
                                                                  LocalShading shading,
                                                                  const VisibilityBlend& blend) {
  switch (shading) {
    case LocalShading::kPrt:
      return std::make_shared<const PrtScattering>(*pack.ssdf, pack.light_from_both_sides,
                                                   pack.materials);
    case LocalShading::kTsaiShih16:
    case LocalShading::kTsaiShihFull:
      return std::make_shared<const TsaiShihScattering>(
          *pack.ssdf, pack.light_from_both_sides, pack.materials,
          shading == LocalShading::kTsaiShih16 ? BcsdfFactors::kRecommendedTerms
                                               : BcsdfFactors::kAllTerms);
    default:
      return std::make_shared<const SingleScattering>(
          pack.ssdf ? &*pack.ssdf : nullptr, pack.sgs ? &*pack.sgs : nullptr, pack.materials, blend,
          shading == LocalShading::kPrinted ? SgMethod::kPrinted : SgMethod::kDefault);
  }
}

std::optional<float> shape_of(const Light& light) {
  if (light.is_directional()) return {};
  return light.sharpness;
}

}  // namespace

PrecomputedRenderer::PrecomputedRenderer(const ClothScene& scene,
                                         std::span<const FabricPack* const> packs,
                                         std::span<const Light> lights, const Rgb& background,
                                         const PrecomputedSettings& settings)
    : scene_(&scene),
      scene_lights_(lights),
      fitted_(fit_environments(lights)),
      lights_(fitted_.lights),
      background_(background),
      settings_(settings) {
  using FaceLight = MultipleScattering::LightShape::FaceLight;
  const bool printed = settings.shading == LocalShading::kPrinted;
  const bool dual = settings.shading == LocalShading::kDualScattering;
  bool any_sharp = false;
  bool any_soft = false;
  for (const Light& light : lights_) {
    shapes_.emplace_back(shape_of(light), printed ? FaceLight::kPrinted : FaceLight::kDual);
    any_sharp =
        any_sharp || light.is_directional() || settings.blend.uses_distance(light.sharpness);
    any_soft = any_soft || (!light.is_directional() && settings.blend.uses_lobes(light.sharpness));
  }
  if (settings.shading == LocalShading::kPrt || settings.shading == LocalShading::kTsaiShih16 ||
      settings.shading == LocalShading::kTsaiShihFull) {
    any_sharp = true;  // they take their visibility from the signed distances
    any_soft = false;
  }
  std::map<const FabricPack*, std::shared_ptr<const IdBricks>> bricks;
  std::map<const FabricPack*, Cloth> by_pack;
  for (std::uint32_t cloth = 0; cloth < packs.size(); ++cloth) {
    const FabricPack& pack = *packs[cloth];
    require(pack.transfer.has_value() || dual, pack, "transfer");
    require(pack.ssdf.has_value() || !any_sharp || dual, pack, "signed distances");
    require(pack.sgs.has_value() || !any_soft || dual, pack, "sums of Gaussians");
    require(pack.volume.has_value() || !settings.volume, pack, "volume");
    std::shared_ptr<const IdBricks>& own_bricks = bricks[&pack];
    if (settings.volume && !own_bricks) own_bricks = std::make_shared<const IdBricks>(*pack.volume);
    const Shell& shell = scene.shell(cloth);
    const auto [known, is_new] = by_pack.try_emplace(&pack);
    if (is_new) {
      Cloth& first = known->second;
      if (dual) {
        first.dual = std::make_shared<const DualScattering>(scene.tile(cloth), pack.materials);
      } else {
        first.single = single_scattering_of(pack, settings.shading, settings.blend);
        if (settings.transfer_order) {
          first.cut_transfer = std::make_shared<const Transfer>(
              cut_to_order(*pack.transfer, *settings.transfer_order));
        }
        first.multiple.emplace(first.cut_transfer ? *first.cut_transfer : *pack.transfer,
                               pack.materials, pack.bundle_tangent);
      }
    }
    cloths_.push_back(known->second);
    cloths_.back().pack = &pack;
    cloths_.back().bricks = own_bricks;
    cloths_.back().shadow_sigma = settings.shadow_sigma_mm.value_or(shell.z_max() - shell.z_min());
  }
}

std::optional<ShellHit> PrecomputedRenderer::eye_hit(const SceneRay& ray) const {
  if (!settings_.volume) return scene_->first_fiber(ray);
  return scene_->first_hit(ray, RayReach::kEverything,
                           [this](std::uint32_t cloth, const Ray& local, std::uint32_t) {
                             return cloths_[cloth].bricks->first_hit(local);
                           });
}

PrecomputedRenderer::GlobalVisibility PrecomputedRenderer::global_visibility(
    const ShellHit& hit, const Light& light, RandomStream& random) const {
  const Cloth& cloth = cloths_[hit.cloth];
  const bool both_sides = cloth.pack->light_from_both_sides;
  Vec3 direction = light.axis;
  float height = 0;
  for (int draw = 0; draw < kFaceDraws; ++draw) {
    if (!light.is_directional()) direction = sample_light(light, random).direction;
    height = scene_->fabric_direction(hit, direction).z();
    if (both_sides || height > 0 || light.is_directional()) break;
  }
  if (!both_sides && !(height > 0)) return {};
  const ClothSide side = height > 0 ? ClothSide::kFace : ClothSide::kBack;

  GlobalVisibility result;
  result.at_point = scene_->globally_visible(scene_->surface_point(hit, side), direction);
  const Eigen::Vector2d moved =
      hit.fabric.head<2>() + cloth.shadow_sigma * sample_gaussian2(random).cast<double>();
  const std::optional<Shell::SurfacePoint> nearby = scene_->surface_point(hit, moved, side);
  // Beyond a rim there is no cloth to take light from.
  result.nearby = nearby ? scene_->globally_visible(*nearby, direction) : result.at_point;
  return result;
}

Rgb PrecomputedRenderer::surface_light(const SurfaceHit& hit, std::uint32_t surface, const Vec3& wo,
                                       RandomStream& random) const {
  if (surface < settings_.interactive.size() && settings_.interactive[surface]) {
    return settings_.interactive[surface]->light(hit, wo, lights_);
  }
  return surface_direct_light(
      hit, wo, scene_lights_, LightEstimator::kCombined, random, [&](const Vec3& direction) {
        return scene_->globally_visible({hit.position, hit.normal}, direction);
      });
}

DualScattering::Parts PrecomputedRenderer::dual_scattered(const ShellHit& hit,
                                                          const ShadingPoint& point,
                                                          const Light& light,
                                                          RandomStream& random) const {
  const Cloth& cloth = cloths_[hit.cloth];
  const Vec3 world = sample_light(light, random).direction;
  const Vec3 fabric = scene_->fabric_direction(hit, world);
  if (!cloth.pack->light_from_both_sides && !(fabric.z() > 0)) return {};
  // The hit in the base tile.
  const Exemplar& exemplar = cloth.pack->exemplar;
  Vec3d position = hit.fabric;
  position.x() -= std::floor(position.x() / exemplar.width_mm) * exemplar.width_mm;
  position.y() -= std::floor(position.y() / exemplar.height_mm) * exemplar.height_mm;
  return cloth.dual->directional(point, position.cast<float>(), {world, fabric});
}

void PrecomputedRenderer::shade(const Camera& camera, const PixelRect& block, int first, int last,
                                std::vector<Sample>& samples,
                                std::vector<std::optional<Seen>>& seen) const {
  const int pixels = block.width * block.height;
  const int per_pixel = last - first;
  samples.assign(static_cast<std::size_t>(pixels * per_pixel), Sample{});
  if (first == 0) seen.assign(static_cast<std::size_t>(pixels), std::nullopt);
  const auto address = [&](int pixel) {
    return static_cast<std::uint64_t>(block.y0 + pixel / block.width) *
               static_cast<std::uint64_t>(camera.width()) +
           static_cast<std::uint64_t>(block.x0 + pixel % block.width);
  };

  // G-buffer of the samples that see cloth.
  std::vector<ShellHit> hits;
  std::vector<ShadingPoint> points;  // [hit]
  std::vector<int> sample_of;        // [hit] index into samples
  for (int i = 0; i < pixels * per_pixel; ++i) {
    const int pixel = i / per_pixel;
    const int s = first + i % per_pixel;
    RandomStream eye(settings_.seed, RandomStage::kEyeRay, address(pixel),
                     static_cast<std::uint64_t>(s));
    const double x = block.x0 + pixel % block.width + eye.uniform_double();
    const double y = block.y0 + pixel / block.width + eye.uniform_double();
    const EyeRay ray = camera.ray(x, y);
    SceneRay scene_ray{ray.origin, ray.direction};
    const std::optional<MeshHit> mesh = scene_->first_mesh(ray.origin, ray.direction);
    if (mesh) scene_ray.t_max = mesh->t;
    const std::optional<ShellHit> hit = eye_hit(scene_ray);
    samples[i].alpha = hit || mesh ? 1.0F : 0.0F;
    if (!hit && mesh && mesh->surface != nullptr) {
      const SurfaceHit surface =
          mesh->surface->hit(mesh->triangle, mesh->u, mesh->v, ray.direction, ray.spread * mesh->t);
      RandomStream random(settings_.seed, RandomStage::kLightVisibility, address(pixel),
                          static_cast<std::uint64_t>(s));
      samples[i].single = surface_light(surface, mesh->mesh, -ray.direction, random);
      const Vec2& place = surface.point.position_mm;
      if (s == 0) {
        seen[pixel] =
            Seen{Seen::kNone, Seen::kNone, surface.position, Vec3d(place.x(), place.y(), 0),
                 surface.world_from_patch.col(0).cast<float>()};
      }
    }
    if (!hit) {
      if (!mesh) samples[i].background = background_;
      continue;
    }
    const FabricPack& pack = *cloths_[hit->cloth].pack;
    const Vec3 wo = -ray.direction;
    points.push_back({hit->segment,
                      pack.transfer ? pack.transfer->cell_of_segment[hit->segment] : 0,
                      pack.exemplar.segment_material(hit->segment),
                      {scene_->world_tangent(*hit), pack.exemplar.segment_tangent(hit->segment)},
                      {wo, scene_->fabric_direction(*hit, wo)}});
    hits.push_back(*hit);
    sample_of.push_back(i);
    if (s == 0) {
      seen[pixel] = Seen{hit->segment, points.back().cell, hit->position, hit->fabric,
                         points.back().tangent.world};
    }
  }

  // Samples of one cell and one tetrahedron side by side.
  std::vector<std::uint32_t> order(hits.size());
  for (std::uint32_t k = 0; k < order.size(); ++k) order[k] = k;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tie(hits[a].cloth, points[a].cell, hits[a].tet, a) <
           std::tie(hits[b].cloth, points[b].cell, hits[b].tet, b);
  });

  struct KeptField {
    std::uint32_t cloth = 0xffffffffU;
    std::uint32_t cell = 0;
    Vec3 axis;
    CellLight light;
  };
  std::vector<KeptField> kept(lights_.size());
  for (const std::uint32_t k : order) {
    const ShellHit& hit = hits[k];
    const ShadingPoint& point = points[k];
    const Cloth& cloth = cloths_[hit.cloth];
    const int values = cloth.multiple ? 3 * cloth.pack->transfer->coefficients() : 0;
    Sample& sample = samples[sample_of[k]];
    RandomStream random(settings_.seed, RandomStage::kLightVisibility,
                        address(sample_of[k] / per_pixel),
                        static_cast<std::uint64_t>(first + sample_of[k] % per_pixel));
    IncomingField field;
    std::fill_n(field.begin(), values, 0.0F);
    bool any_nearby = false;
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      const Light& light = lights_[l];
      const GlobalVisibility visible = global_visibility(hit, light, random);
      if (cloth.dual) {
        if (!visible.at_point) continue;
        const DualScattering::Parts parts = dual_scattered(hit, point, light, random);
        sample.single += light.irradiance * parts.single;
        sample.multiple += light.irradiance * parts.multiple;
        continue;
      }
      const DirectionPair axis = {light.axis, scene_->fabric_direction(hit, light.axis)};
      if (visible.at_point) {
        sample.single += light.irradiance *
                         (light.is_directional()
                              ? cloth.single->directional(point, axis)
                              : cloth.single->spherical_gaussian(point, axis, light.sharpness));
      }
      if (!visible.nearby) continue;
      any_nearby = true;
      KeptField& own = kept[l];
      if (own.cloth != hit.cloth || own.cell != point.cell || own.axis != axis.fabric) {
        own.cloth = hit.cloth;
        own.cell = point.cell;
        own.axis = axis.fabric;
        cloth.multiple->incoming(point.cell, shapes_[l], axis.fabric, own.light);
      }
      for (int j = 0; j < values; ++j) field[j] += light.irradiance[j % 3] * own.light.harmonics[j];
      sample.multiple += light.irradiance *
                         cloth.multiple->outgoing_from_cones(own.light, shapes_[l], axis.fabric,
                                                             point.segment, point.material,
                                                             point.tangent.fabric, point.wo.fabric);
    }
    if (any_nearby) {
      sample.multiple +=
          cloth.multiple->outgoing(field, point.material, point.tangent.fabric, point.wo.fabric);
    }
  }
}

FrameBuffers shade_picture(const PrecomputedRenderer& renderer, const Camera& camera,
                           const PixelRect& crop, int spp, const RenderProgress& progress,
                           const MoreSamples& more) {
  FrameBuffers frame(crop.width, crop.height);
  const std::size_t count = frame.pixel_count();
  frame.segment.assign(count, PrecomputedRenderer::Seen::kNone);
  frame.cell.assign(count, PrecomputedRenderer::Seen::kNone);
  frame.fabric_position.assign(count, Vec3::Zero());
  frame.depth.assign(count, 0.0F);
  frame.tangent.assign(count, Vec3::Zero());
  if (spp >= 2) {
    frame.half0.resize(count);
    frame.half1.resize(count);
    frame.variance.resize(count);
  }

  const int columns = (crop.width + kBlockEdge - 1) / kBlockEdge;
  const int rows = (crop.height + kBlockEdge - 1) / kBlockEdge;
  const int blocks = columns * rows;
  constexpr std::size_t kBlockPixels = kBlockEdge * kBlockEdge;
  // [block][pixel]
  std::vector<PixelSums> all_sums(static_cast<std::size_t>(blocks) * kBlockPixels);
  const auto shade_block = [&](int index, int first_sample, int last_sample) {
    const int left = index % columns * kBlockEdge;  // within the crop
    const int top = index / columns * kBlockEdge;
    const PixelRect block = {crop.x0 + left, crop.y0 + top, std::min(kBlockEdge, crop.width - left),
                             std::min(kBlockEdge, crop.height - top)};
    const int pixels = block.width * block.height;
    PixelSums* const sums = &all_sums[static_cast<std::size_t>(index) * kBlockPixels];
    std::vector<PrecomputedRenderer::Sample> samples;
    std::vector<std::optional<PrecomputedRenderer::Seen>> seen;
    for (int first = first_sample; first < last_sample; first += kBlockSamples) {
      const int last = std::min(last_sample, first + kBlockSamples);
      renderer.shade(camera, block, first, last, samples, seen);
      for (int i = 0; i < pixels * (last - first); ++i) {
        sums[i / (last - first)].add(samples[i], first + i % (last - first));
      }
    }
    for (int p = 0; p < pixels; ++p) {
      const std::size_t k =
          static_cast<std::size_t>(top + p / block.width) * crop.width + left + p % block.width;
      sums[p].store(last_sample, k, frame);
      if (first_sample > 0 || !seen[p]) continue;
      frame.segment[k] = seen[p]->segment;
      frame.cell[k] = seen[p]->cell;
      frame.fabric_position[k] = seen[p]->fabric.cast<float>();
      frame.depth[k] = static_cast<float>(camera.depth(seen[p]->world));
      frame.tangent[k] = seen[p]->tangent;
    }
  };
  for (int wanted = spp; wanted > frame.spp; wanted += more ? more(frame) : 0) {
    for (int start = 0; start < blocks; start += kBlocksPerReport) {
      progress(static_cast<double>(start) / blocks);
      tbb::parallel_for(start, std::min(blocks, start + kBlocksPerReport),
                        [&](int index) { shade_block(index, frame.spp, wanted); });
    }
    progress(1.0);
    frame.spp = wanted;
  }
  return frame;
}

}  // namespace heddle
