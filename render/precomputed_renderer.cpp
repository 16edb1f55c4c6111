#include "render/precomputed_renderer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "formats/input_error.h"
#include "render/near_lights.h"
#include "render/yarn_tints.h"

namespace heddle {
namespace {

std::optional<float> far_from_of(const PrecomputedSettings& settings) {
  return method_row(settings.method).has_far_form ? settings.far_from : std::nullopt;
}

void require(bool present, bool needed, const FabricPack& pack, const char* what) {
  if (present || !needed) return;
  throw FileError(fmt::format("{}: the pack holds no {}, which this picture needs",
                              pack.folder.string(), what));
}

/// The packs, if all hold what is needed.
std::vector<const FabricPack*> checked(std::span<const FabricPack* const> packs,
                                       const Needs& needs) {
  for (const FabricPack* pack : packs) {
    require(pack->transfer.has_value(), needs.transfer, *pack, "transfer");
    require(pack->ssdf.has_value(), needs.ssdf, *pack, "signed distances");
    require(pack->sgs.has_value(), needs.sgs, *pack, "sums of Gaussians");
    require(pack->volume.has_value(), needs.volume, *pack, "volume");
    require(pack->far.has_value(), needs.far, *pack, "far form");
  }
  return {packs.begin(), packs.end()};
}

/// What the renderer needs of its packs.
Needs needs_of_settings(const PrecomputedSettings& settings, std::span<const Light> lights) {
  return needs_with_far_forms(needs_of(settings.method, lights, settings.blend), settings.method,
                              settings.far_from.has_value(), settings.bounces);
}

/// [part]; empty where eye rays do not march through volumes.
std::vector<std::shared_ptr<const IdBricks>> bricks_of(std::span<const FabricPack* const> packs,
                                                       const MethodRow& method) {
  std::map<const FabricPack*, std::shared_ptr<const IdBricks>> by_pack;
  std::vector<std::shared_ptr<const IdBricks>> bricks;
  if (!method.marches_volume) return bricks;
  for (const FabricPack* pack : packs) {
    std::shared_ptr<const IdBricks>& own = by_pack[pack];
    if (!own) own = std::make_shared<const IdBricks>(*pack->volume);
    bricks.push_back(own);
  }
  return bricks;
}

std::vector<LightVisibilityPass::Part> visibility_parts(const ClothScene& scene,
                                                        std::span<const FabricPack* const> packs,
                                                        std::optional<double> shadow_sigma_mm) {
  std::vector<LightVisibilityPass::Part> parts;
  for (std::uint32_t part = 0; part < packs.size(); ++part) {
    const std::uint32_t cloth = scene.cloth_of_part(part);
    const Shell& shell = scene.shell(cloth);
    parts.push_back({packs[part]->light_from_both_sides && !scene.has_underlay(cloth),
                     shadow_sigma_mm.value_or(shell.z_max() - shell.z_min())});
  }
  return parts;
}

/// [part]
std::vector<std::optional<Rgb>> own_scatterings_of(const ClothScene& scene,
                                                   std::span<const FabricPack* const> packs) {
  std::vector<std::optional<Rgb>> scatterings(packs.size());
  for (std::uint32_t part = 0; part < packs.size(); ++part) {
    if (scene.has_tints(part))
      scatterings[part] = own_yarn_scatterings(scene.tile(part), packs[part]->materials);
  }
  return scatterings;
}

MultipleScattering::LightShape::Projection projection_of(const MethodRow& method) {
  using Projection = MultipleScattering::LightShape::Projection;
  return method.as_printed ? Projection::kPrinted : Projection::kDual;
}

bool takes_both_sides(std::span<const FabricPack* const> packs) {
  return std::any_of(packs.begin(), packs.end(),
                     [](const FabricPack* pack) { return pack->light_from_both_sides; });
}

/// [light]; of near lights, a directional one, which nobody uses.
std::vector<MultipleScattering::LightShape> shapes_of(std::span<const Light> lights,
                                                      const MethodRow& method, bool both_sides) {
  std::vector<MultipleScattering::LightShape> shapes;
  if (!method.takes_transfer) return shapes;
  for (const Light& light : lights) {
    std::optional<float> sharpness;
    if (light.type == LightType::kSphericalGaussian) sharpness = light.sharpness;
    shapes.emplace_back(sharpness, projection_of(method), both_sides);
  }
  return shapes;
}

/// The lights of the precomputed methods: environments as Gaussians, rectangles in parts.
FittedLights lights_for(const ClothScene& scene, std::span<const Light> lights) {
  FittedLights fitted = fit_environments(lights);
  std::vector<Light> split;
  for (const Light& light : fitted.lights) {
    if (light.type != LightType::kRectangle) {
      split.push_back(light);
      continue;
    }
    for (const Light& part :
         split_rectangle(light, [&](const Vec3d& place) { return scene.distance_to_cloth(place); }))
      split.push_back(part);
  }
  fitted.lights = std::move(split);
  return fitted;
}

/// What stands for the lights at a point.
std::vector<Light> far_lights_at(std::span<const Light> lights, const Vec3d& point) {
  std::vector<Light> far;
  for (const Light& light : lights) {
    const SeenLight seen = seen_from(light, point);
    Light& own = far.emplace_back();
    own.type = seen.is_directional ? LightType::kDirectional : LightType::kSphericalGaussian;
    own.axis = seen.axis;
    own.sharpness = seen.sharpness;
    own.irradiance = seen.irradiance;
  }
  return far;
}

/// Places in g_buffer.fibers, those of one part, cell and tetrahedron side by side.
std::vector<std::uint32_t> shading_order(const GBuffer& g_buffer) {
  const std::vector<SeenFiber>& fibers = g_buffer.fibers;
  std::vector<std::uint32_t> order(fibers.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tie(fibers[a].hit.part, fibers[a].point.cell, fibers[a].hit.tet, a) <
           std::tie(fibers[b].hit.part, fibers[b].point.cell, fibers[b].hit.tet, b);
  });
  return order;
}

}  // namespace

PrecomputedRenderer::PrecomputedRenderer(const ClothScene& scene,
                                         std::span<const FabricPack* const> packs,
                                         std::span<const Light> lights, const Rgb& background,
                                         const PrecomputedSettings& settings)
    : scene_(&scene),
      scene_lights_(lights),
      fitted_(lights_for(scene, lights)),
      lights_(fitted_.lights),
      background_(background),
      settings_(settings),
      packs_(checked(packs, needs_of_settings(settings, lights_))),
      shapes_(shapes_of(lights_, method_row(settings.method), takes_both_sides(packs_))),
      near_shapes_(projection_of(method_row(settings.method)), takes_both_sides(packs_)),
      shadings_(make_shadings()),
      own_scatterings_(own_scatterings_of(scene, packs_)),
      g_buffer_pass_(scene, packs_, bricks_of(packs, method_row(settings.method)),
                     far_from_of(settings), settings.seed, settings.filter),
      visibility_pass_(scene, visibility_parts(scene, packs, settings.shadow_sigma_mm), lights_,
                       method_row(settings.method).draws_light, settings.seed),
      far_shading_(scene, settings.far_forms, lights_, shapes_, near_shapes_),
      fold_light_(scene, packs_, far_shading_, visibility_pass_, lights_.size()) {}

std::vector<std::shared_ptr<const FabricShading>> PrecomputedRenderer::make_shadings() const {
  const MethodRow& method = method_row(settings_.method);
  assert(method.make_shading != nullptr && "expected a method that traces no paths");
  std::map<const FabricPack*, std::shared_ptr<const FabricShading>> by_pack;
  std::vector<std::shared_ptr<const FabricShading>> shadings;
  for (std::uint32_t part = 0; part < packs_.size(); ++part) {
    std::shared_ptr<const FabricShading>& own = by_pack[packs_[part]];
    if (!own) {
      own = method.make_shading({.scene = scene_,
                                 .tile = &scene_->tile(part),
                                 .pack = packs_[part],
                                 .lights = lights_,
                                 .shapes = shapes_,
                                 .near_shapes = &near_shapes_,
                                 .blend = settings_.blend,
                                 .transfer_order = settings_.transfer_order,
                                 .reflecting = settings_.reflecting.empty()
                                                   ? std::span<const BcsdfTable>{}
                                                   : settings_.reflecting[part]});
    }
    shadings.push_back(own);
  }
  return shadings;
}

GBuffer PrecomputedRenderer::g_buffer(const Camera& camera, const PixelRect& block, int first,
                                      int last, KeptChunk& kept) const {
  return g_buffer_pass_.restore(
      camera, block, first, last,
      [&kept](std::uint32_t sample, const EyeRay& ray) { return kept.next_sight(sample, ray); });
}

std::optional<std::string> PrecomputedRenderer::visibility_text() const {
  if (method_row(settings_.method).draws_light) return {};
  return heddle::visibility_text(lights_);
}

std::vector<EyeSample> PrecomputedRenderer::unlit(const GBuffer& g_buffer) const {
  std::vector<EyeSample> seen(g_buffer.sample_count());
  for (std::size_t sample = 0; sample < seen.size(); ++sample) {
    seen[sample].alpha = g_buffer.covered[sample];
    if (g_buffer.covered[sample] < 1)
      seen[sample].background = (1 - g_buffer.covered[sample]) * background_;
  }
  return seen;
}

std::vector<EyeSample> PrecomputedRenderer::shade(const GBuffer& g_buffer,
                                                  const LightVisibility& visibility) const {
  std::vector<EyeSample> seen = unlit(g_buffer);
  for (const SeenSurface& surface : g_buffer.surfaces) {
    RandomStream random =
        g_buffer.random(settings_.seed, RandomStage::kLightVisibility, surface.sample);
    seen[surface.sample].single += surface.weight * surface_light(surface, random);
  }
  const std::vector<std::uint32_t> order = shading_order(g_buffer);
  const auto part_of = [&](std::uint32_t k) { return g_buffer.fibers[k].hit.part; };
  for (auto first = order.begin(); first != order.end();) {
    const std::uint32_t part = part_of(*first);
    const auto last =
        std::find_if(first, order.end(), [&](std::uint32_t k) { return part_of(k) != part; });
    shadings_[part]->shade(g_buffer, visibility, {first, last}, seen);
    first = last;
  }
  for (const SeenFiber& fiber : g_buffer.fibers) {
    if (const std::optional<SeenLight> light = fold_light(g_buffer, fiber.sample, fiber.hit)) {
      seen[fiber.sample].multiple += fiber.weight * shadings_[fiber.hit.part]->under(fiber, *light);
    }
  }
  tint_yarns(g_buffer, seen);
  shade_far(g_buffer, visibility, seen);
  return seen;
}

void PrecomputedRenderer::shade_far(const GBuffer& g_buffer, const LightVisibility& visibility,
                                    std::span<EyeSample> seen) const {
  for (std::size_t k = 0; k < g_buffer.far.size(); ++k) {
    const SeenFar& far = g_buffer.far[k];
    const std::size_t first = (g_buffer.fibers.size() + k) * lights_.size();
    const FarShading::Radiance light = far_shading_.under_lights(
        far.hit, far.wo, std::span(visibility.visible).subspan(first, lights_.size()));
    EyeSample& sample = seen[far.sample];
    sample.single += far.weight * light.single;
    sample.multiple += far.weight * light.multiple;
    if (const std::optional<SeenLight> more = fold_light(g_buffer, far.sample, far.hit)) {
      const FarShading::Radiance sent = far_shading_.under(far.hit, far.wo, *more);
      sample.multiple += far.weight * (sent.single + sent.multiple);
    }
  }
}

std::optional<SeenLight> PrecomputedRenderer::fold_light(const GBuffer& g_buffer,
                                                         std::uint32_t sample,
                                                         const ShellHit& hit) const {
  if (settings_.bounces == 0 || !method_row(settings_.method).has_far_form) return {};
  RandomStream random = g_buffer.random(settings_.seed, RandomStage::kFar, sample);
  return fold_light_.at(hit, settings_.bounces, random);
}

void PrecomputedRenderer::tint_yarns(const GBuffer& g_buffer, std::span<EyeSample> seen) const {
  for (const SeenFiber& fiber : g_buffer.fibers) {
    const std::optional<Rgb>& scatterings = own_scatterings_[fiber.hit.part];
    if (!scatterings) continue;
    const Rgb tint = scene_->tint(fiber.hit);
    EyeSample& sample = seen[fiber.sample];
    sample.single *= tint;
    sample.transmitted *= tint;
    for (int c = 0; c < 3; ++c) sample.multiple[c] *= std::pow(tint[c], (*scatterings)[c]);
  }
}

Rgb PrecomputedRenderer::surface_light(const SeenSurface& surface, RandomStream& random) const {
  const SurfaceHit& hit = surface.hit;
  if (surface.met.mesh < settings_.interactive.size() && settings_.interactive[surface.met.mesh]) {
    const InteractiveSurface& interactive = *settings_.interactive[surface.met.mesh];
    if (std::none_of(lights_.begin(), lights_.end(), [](const Light& l) { return l.is_near(); }))
      return interactive.light(hit, surface.wo, lights_);
    return interactive.light(hit, surface.wo, far_lights_at(lights_, hit.position));
  }
  const bool is_solid = scene_->surfaces()[surface.met.mesh].is_solid();
  return surface_direct_light(
      hit, surface.wo, scene_lights_, LightEstimator::kCombined, random,
      [&](const Vec3& direction, double distance) {
        // A ball under a voile is seen through the voile, and so is its light.
        if (is_solid) return scene_->visible({hit.position, hit.normal}, direction, distance);
        return scene_->globally_visible({hit.position, hit.normal}, direction, distance);
      });
}

namespace {

FrameBuffers empty_frame(int width, int height, int spp) {
  FrameBuffers frame(width, height);
  const std::size_t count = frame.pixel_count();
  keep_first_samples(frame);
  if (spp >= 2) {
    frame.half0.resize(count);
    frame.half1.resize(count);
    frame.variance.resize(count);
  }
  return frame;
}

/// A picture that grows by blocks of pixels.
class BlockPicture {
 public:
  BlockPicture(std::span<const PrecomputedRenderer* const> by_group, const Camera& camera,
               const PixelRect& crop, const SampleStore& store, FrameBuffers& frame)
      : by_group_(by_group),
        camera_(&camera),
        blocks_{crop},
        store_(&store),
        frame_(&frame),
        sums_(static_cast<std::size_t>(block_count()) * kBlockPixels),
        parts_(sums_.size(), by_group.size(), by_group[0]->tells_transmitted()) {}

  int block_count() const { return blocks_.count(); }
  std::size_t first_pixel(int index) const {
    return place_in_picture(blocks_.at(index), blocks_.crop, 0);
  }

  /// Samples first_sample .. last_sample - 1 of a block's pixels; those before are there.
  void shade_block(int index, int first_sample, int last_sample) {
    if (first_sample == last_sample) return;
    const PixelRect block = blocks_.at(index);
    const std::size_t first_sum = static_cast<std::size_t>(index) * kBlockPixels;
    std::vector<std::vector<EyeSample>> seen(by_group_.size());  // [group][sample]
    std::vector<EyeSample> by_group(by_group_.size());           // of one sample
    for (int first = first_sample; first < last_sample; first += kBlockSamples) {
      const int last = std::min(last_sample, first + kBlockSamples);
      const GBuffer g_buffer = look_and_shade(index, first, last, seen);
      for (int k = 0; k < static_cast<int>(seen[0].size()); ++k) {
        for (std::size_t g = 0; g < seen.size(); ++g)
          by_group[g] = seen[g][static_cast<std::size_t>(k)];
        const std::size_t pixel = first_sum + static_cast<std::size_t>(k / (last - first));
        sums_[pixel].add(sum_of_groups(by_group), first + k % (last - first));
        parts_.add(pixel, by_group);
      }
      if (first == 0)
        store_first_samples(by_group_[0]->scene(), g_buffer, *camera_, blocks_.crop, *frame_);
    }
    for (int pixel = 0; pixel < block.width * block.height; ++pixel) {
      const std::size_t sum = first_sum + static_cast<std::size_t>(pixel);
      const std::size_t place = place_in_picture(block, blocks_.crop, pixel);
      sums_[sum].store(last_sample, place, *frame_);
      parts_.store(sum, last_sample, place, *frame_);
    }
  }

  /// Makes room for what blocks first .. last - 1 leave to be kept.
  void begin_keeping(int first, int last) {
    if (store_->to == nullptr) return;
    first_kept_ = first;
    kept_.assign(static_cast<std::size_t>(last - first), {});
  }
  /// Writes that, in the order of the blocks.
  void keep() {
    for (const std::vector<std::string>& chunks : kept_) {
      for (const std::string& chunk : chunks) store_->to->add(chunk);
    }
    kept_.clear();
  }

 private:
  /// What eye rays see, and the samples of each group.
  GBuffer look_and_shade(int index, int first, int last,
                         std::vector<std::vector<EyeSample>>& seen) {
    const PixelRect block = blocks_.at(index);
    const PrecomputedRenderer& looking = *by_group_[0];
    if (store_->from != nullptr) {
      KeptChunk chunk(looking.scene(), *store_->from, block, blocks_.crop, first, frame_->spp);
      GBuffer g_buffer = looking.g_buffer(*camera_, block, first, last, chunk);
      for (std::size_t g = 0; g < seen.size(); ++g) {
        const bool is_kept = g < store_->kept_groups;
        seen[g] = relit(g, g_buffer, is_kept ? chunk.next_group(g_buffer) : KeptGroup{});
      }
      return g_buffer;
    }
    GBuffer g_buffer = looking.g_buffer(*camera_, block, first, last);
    std::vector<KeptGroup> groups(seen.size());
    for (std::size_t g = 0; g < seen.size(); ++g) {
      groups[g].visibility = by_group_[g]->light_visibility(g_buffer);
      seen[g] = by_group_[g]->shade(g_buffer, groups[g].visibility);
      if (store_->keeps_light) groups[g].light = seen[g];
    }
    if (store_->to != nullptr) {
      kept_[static_cast<std::size_t>(index - first_kept_)].push_back(
          encode_samples(looking.scene(), g_buffer, groups));
    }
    return g_buffer;
  }

  std::vector<EyeSample> relit(std::size_t group, const GBuffer& g_buffer,
                               const KeptGroup& kept) const {
    using enum SampleStore::Use;
    const PrecomputedRenderer& renderer = *by_group_[group];
    const SampleStore::Use use = store_->use[group];
    if (use == kSights) return renderer.shade(g_buffer, renderer.light_visibility(g_buffer));
    if (use == kVisibility) return renderer.shade(g_buffer, kept.visibility);
    std::vector<EyeSample> seen = renderer.unlit(g_buffer);
    for (std::size_t k = 0; k < kept.light.size(); ++k) {
      seen[k].single = kept.light[k].single;
      seen[k].multiple = kept.light[k].multiple;
      seen[k].transmitted = kept.light[k].transmitted;
    }
    return seen;
  }

  static constexpr std::size_t kBlockPixels = kBlockEdge * kBlockEdge;

  std::span<const PrecomputedRenderer* const> by_group_;
  const Camera* camera_;
  PictureBlocks blocks_;
  const SampleStore* store_;
  FrameBuffers* frame_;
  std::vector<PixelSums> sums_;  // [block][pixel]
  PartSums parts_;               // the same
  int first_kept_ = 0;
  std::vector<std::vector<std::string>> kept_;  // [block - first_kept_][chunk]
};

}  // namespace

FrameBuffers shade_picture(const PrecomputedRenderer& renderer, const Camera& camera,
                           const PixelRect& crop, int spp, const RenderProgress& progress,
                           const MoreSamples& more) {
  const PrecomputedRenderer* all[] = {&renderer};
  return shade_picture(all, camera, crop, spp, progress, more);
}

FrameBuffers shade_picture(std::span<const PrecomputedRenderer* const> by_group,
                           const Camera& camera, const PixelRect& crop, int spp,
                           const RenderProgress& progress, const MoreSamples& more,
                           const SampleStore& store) {
  assert(!more || (store.to == nullptr && store.from == nullptr));
  FrameBuffers frame = empty_frame(crop.width, crop.height, spp);
  frame.spp = spp;
  frame.keep_parts(by_group.size(), by_group[0]->tells_transmitted());
  BlockPicture picture(by_group, camera, crop, store, frame);
  const int blocks = picture.block_count();
  std::vector<int> done(frame.pixel_count(), 0);
  std::vector<int> wanted(frame.pixel_count(), spp);
  do {
    for (int start = 0; start < blocks; start += kBlocksPerReport) {
      progress(static_cast<double>(start) / blocks);
      const int end = std::min(blocks, start + kBlocksPerReport);
      picture.begin_keeping(start, end);
      tbb::parallel_for(start, end, [&](int index) {
        const std::size_t first = picture.first_pixel(index);
        picture.shade_block(index, done[first], wanted[first]);
      });
      picture.keep();
    }
    progress(1.0);
    done = wanted;
    set_samples(done, frame);
  } while (more && add_samples(more(frame), frame, wanted));
  return frame;
}

}  // namespace heddle
