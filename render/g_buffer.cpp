#include "render/g_buffer.h"

#include <utility>

#include "render/far_way.h"

namespace heddle {

RandomStream GBuffer::random(std::uint64_t seed, RandomStage stage, std::uint32_t sample) const {
  const int pixel = static_cast<int>(sample) / per_pixel();
  const auto x = static_cast<std::uint64_t>(block.x0 + pixel % block.width);
  const auto y = static_cast<std::uint64_t>(block.y0 + pixel / block.width);
  return RandomStream::stratified(
      seed, stage, y * frame_width + x,
      static_cast<std::uint64_t>(first + static_cast<int>(sample) % per_pixel()));
}

GBufferPass::GBufferPass(const ClothScene& scene, std::vector<const FabricPack*> packs,
                         std::vector<std::shared_ptr<const IdBricks>> bricks,
                         std::optional<float> far_from, std::uint64_t seed, PixelFilter filter)
    : scene_(&scene),
      packs_(std::move(packs)),
      bricks_(std::move(bricks)),
      far_from_(far_from),
      seed_(seed),
      filter_(std::move(filter)) {}

template <class See>
GBuffer GBufferPass::fill(const Camera& camera, const PixelRect& block, int first, int last,
                          See&& see) const {
  GBuffer g_buffer;
  g_buffer.block = block;
  g_buffer.first = first;
  g_buffer.last = last;
  g_buffer.frame_width = static_cast<std::uint64_t>(camera.width());
  g_buffer.covered.assign(g_buffer.sample_count(), 0);
  for (std::uint32_t sample = 0; sample < g_buffer.sample_count(); ++sample) {
    const int pixel = static_cast<int>(sample) / g_buffer.per_pixel();
    RandomStream random = g_buffer.random(seed_, RandomStage::kEyeRay, sample);
    const double x = block.x0 + pixel % block.width + filter_.place(random.uniform_double());
    const double y = block.y0 + pixel / block.width + filter_.place(random.uniform_double());
    const EyeRay ray = camera.ray(x, y);
    add(ray, sample, see(sample, ray, far_from_ ? random.uniform() : 0.0F), g_buffer);
  }
  return g_buffer;
}

GBuffer GBufferPass::run(const Camera& camera, const PixelRect& block, int first, int last) const {
  return fill(camera, block, first, last,
              [this](std::uint32_t sample, const EyeRay& ray, float far_draw) {
                return look(ray, sample, far_draw);
              });
}

GBuffer GBufferPass::restore(const Camera& camera, const PixelRect& block, int first, int last,
                             const Sights& sights) const {
  return fill(camera, block, first, last,
              [&](std::uint32_t sample, const EyeRay& ray, float) { return sights(sample, ray); });
}

std::optional<ShellHit> GBufferPass::first_fiber(const SceneRay& ray, FarWay& way) const {
  const auto pass = [&](std::uint32_t cloth, const ShellInterval& interval) {
    return far_from_ ? way.pass(cloth, interval) : ClothScene::Passing::kLook;
  };
  const auto query = [this](std::uint32_t part, const Ray& local, std::uint32_t own_fiber) {
    return bricks_.empty() ? scene_->tile(part).intersect(local, own_fiber)
                           : bricks_[part]->first_hit(local);
  };
  return scene_->first_hit(ray, RayReach::kEverything, query, pass);
}

Sight GBufferPass::look(const EyeRay& ray, std::uint32_t sample, float far_draw) const {
  Sight sight;
  SceneRay scene_ray{ray.origin, ray.direction};
  sight.mesh = scene_->first_mesh(ray.origin, ray.direction);
  if (sight.mesh) scene_ray.t_max = sight.mesh->t;
  FarWay way(*scene_, packs_, far_from_.value_or(0), ray, far_draw);
  sight.fiber = first_fiber(scene_ray, way);
  for (const FarWay::Stop& stop : way.stops())
    sight.far.push_back({sample, stop.hit, stop.wo, stop.weight});
  sight.left = way.left();
  return sight;
}

void GBufferPass::add(const EyeRay& ray, std::uint32_t sample, Sight&& sight,
                      GBuffer& g_buffer) const {
  g_buffer.far.insert(g_buffer.far.end(), sight.far.begin(), sight.far.end());
  const std::optional<ShellHit>& hit = sight.fiber;
  const std::optional<MeshHit>& mesh = sight.mesh;
  g_buffer.covered[sample] = hit || mesh ? 1 : 1 - sight.left;
  if (!(sight.left > 0)) return;
  const Vec3 wo = -ray.direction;
  if (hit) {
    const FabricPack& pack = *packs_[hit->part];
    const ShadingPoint point{
        hit->segment,
        pack.transfer ? pack.transfer->cell_of_segment[hit->segment] : 0,
        pack.exemplar.segment_material(hit->segment),
        {scene_->world_tangent(*hit), pack.exemplar.segment_tangent(hit->segment)},
        {wo, scene_->fabric_direction(*hit, wo)}};
    g_buffer.fibers.push_back({sample, *hit, point, sight.left});
  } else if (mesh && mesh->surface != nullptr) {
    g_buffer.surfaces.push_back(
        {sample, *mesh,
         mesh->surface->hit(mesh->triangle, mesh->u, mesh->v, ray.direction, ray.spread * mesh->t),
         wo, sight.left});
  } else if (mesh) {
    g_buffer.meshes.push_back(
        {sample, mesh->mesh - static_cast<std::uint32_t>(scene_->surfaces().size()), mesh->t,
         ray.origin + mesh->t * ray.direction.cast<double>(), sight.left});
  }
}

std::size_t place_in_picture(const PixelRect& block, const PixelRect& crop, int pixel) {
  const int x = block.x0 - crop.x0 + pixel % block.width;
  const int y = block.y0 - crop.y0 + pixel / block.width;
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(crop.width) +
         static_cast<std::size_t>(x);
}

void keep_first_samples(FrameBuffers& frame) {
  const std::size_t count = frame.pixel_count();
  frame.segment.assign(count, kNoSegment);
  frame.cell.assign(count, kNoSegment);
  frame.fabric_position.assign(count, Vec3::Zero());
  frame.depth.assign(count, 0.0F);
  frame.tangent.assign(count, Vec3::Zero());
}

void store_first_samples(const ClothScene& scene, const GBuffer& g_buffer, const Camera& camera,
                         const PixelRect& crop, FrameBuffers& frame) {
  const auto store = [&](std::uint32_t sample, std::uint32_t segment, std::uint32_t cell,
                         const Vec3d& world, const Vec3& fabric, const Vec3& tangent) {
    const int place = static_cast<int>(sample);
    if (place % g_buffer.per_pixel() != 0) return;
    const std::size_t k = place_in_picture(g_buffer.block, crop, place / g_buffer.per_pixel());
    frame.segment[k] = segment;
    if (!frame.cell.empty()) frame.cell[k] = cell;
    frame.fabric_position[k] = fabric;
    frame.depth[k] = static_cast<float>(camera.depth(world));
    frame.tangent[k] = tangent;
  };
  for (const SeenFiber& fiber : g_buffer.fibers) {
    store(fiber.sample, fiber.hit.segment, fiber.point.cell, fiber.hit.position,
          fiber.hit.fabric.cast<float>(), fiber.point.tangent.world);
  }
  for (const SeenFar& far : g_buffer.far) {
    // of the weft
    const Vec3 tangent = scene.shell(far.hit.cloth).world_from_fabric(far.hit.tet).col(0);
    store(far.sample, kNoSegment, kNoSegment, far.hit.position, far.hit.fabric.cast<float>(),
          tangent.normalized());
  }
  for (const SeenSurface& surface : g_buffer.surfaces) {
    const Vec2& place = surface.hit.point.position_mm;
    store(surface.sample, kNoSegment, kNoSegment, surface.hit.position,
          Vec3(place.x(), place.y(), 0), surface.hit.world_from_patch.col(0).cast<float>());
  }
}

}  // namespace heddle
