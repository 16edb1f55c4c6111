#include "render/path_tracer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <chrono>

#include "render/walked_light.h"

namespace heddle {

PathTracer::PathTracer(const ClothScene& scene, std::span<const BcsdfTable> materials,
                       std::span<const Light> lights, const Rgb& background,
                       const PathTracerSettings& settings)
    : scene_(&scene),
      materials_(materials),
      lights_(lights),
      background_(background),
      settings_(settings),
      trace_(scene, settings.local) {}

PathTracer::Sample PathTracer::radiance(const ClothTrace::Vertex& vertex, const Vec3& wo,
                                        RandomStream& random) const {
  return walked_light(trace_, materials_, lights_, settings_.estimator, settings_.limits, vertex,
                      wo, random);
}

PathTracer::Sample PathTracer::trace(const EyeRay& ray, RandomStream& random) const {
  const SceneRay scene_ray{ray.origin, ray.direction};
  const std::optional<ShellHit> hit = scene_->first_fiber(scene_ray);
  Sample sample;
  if (const auto mesh =
          scene_->first_mesh(ray.origin, ray.direction, hit ? hit->t : scene_ray.t_max)) {
    sample.alpha = 1;
    if (mesh->surface == nullptr) return sample;
    const SurfaceHit surface =
        mesh->surface->hit(mesh->triangle, mesh->u, mesh->v, ray.direction, ray.spread * mesh->t);
    if (mesh->surface->is_solid() && !settings_.local) {
      sample = radiance(ClothTrace::vertex(surface), -ray.direction, random);
      sample.alpha = 1;
      return sample;
    }
    sample.single = surface_direct_light(
        surface, -ray.direction, lights_, settings_.estimator, random,
        [&](const Vec3& direction, double distance) {
          return scene_->visible({surface.position, surface.normal}, direction, distance);
        });
  } else if (hit) {
    sample = radiance(trace_.vertex(*hit), -ray.direction, random);
    sample.alpha = 1;
  } else {
    sample.background = background_;
  }
  return sample;
}

std::vector<BcsdfTable> scene_materials(const ClothScene& scene) {
  std::vector<BcsdfTable> tables;
  for (const FiberScattering& fiber : scene.materials()) tables.emplace_back(fiber);
  return tables;
}

namespace {

int most_missing(const std::vector<int>& done, const std::vector<int>& wanted) {
  int most = 0;
  for (std::size_t k = 0; k < done.size(); ++k) most = std::max(most, wanted[k] - done[k]);
  return most;
}

}  // namespace

FrameBuffers trace_picture(const PathTracer& tracer, const Camera& camera, const PixelRect& crop,
                           std::uint64_t seed, const SampleBudget& budget,
                           const RenderProgress& progress) {
  assert(budget.seconds || (budget.spp >= 2 && budget.spp % 2 == 0));
  const int pixel_count = crop.width * crop.height;
  std::vector<PixelSums> sums(static_cast<std::size_t>(pixel_count));
  std::vector<int> done(sums.size(), 0);
  std::vector<int> wanted(sums.size(), budget.spp);

  const auto pass = [&](int count) {
    // 16 pixels: long enough to pay for a task, short enough to share out a few expensive ones.
    tbb::parallel_for(
        tbb::blocked_range<int>(0, pixel_count, 16), [&](const tbb::blocked_range<int>& range) {
          for (int k = range.begin(); k < range.end(); ++k) {
            const int x = crop.x0 + k % crop.width;
            const int y = crop.y0 + k / crop.width;
            const auto pixel =
                static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(camera.width()) +
                static_cast<std::uint64_t>(x);
            const auto place = static_cast<std::size_t>(k);
            PixelSums& sum = sums[place];
            const int first = done[place];
            done[place] = budget.seconds ? first + count : std::min(wanted[place], first + count);
            for (int s = first; s < done[place]; ++s) {
              RandomStream eye = RandomStream::stratified(seed, RandomStage::kEyeRay, pixel,
                                                          static_cast<std::uint64_t>(s));
              RandomStream random(seed, RandomStage::kPathTracer, pixel,
                                  static_cast<std::uint64_t>(s));
              const double px = x + eye.uniform_double();
              const double py = y + eye.uniform_double();
              sum.add(tracer.trace(camera.ray(px, py), random), s);
            }
          }
        });
  };

  FrameBuffers frame(crop.width, crop.height);
  frame.half0.resize(sums.size());
  frame.half1.resize(sums.size());
  frame.variance.resize(sums.size());
  const auto start = std::chrono::steady_clock::now();
  do {
    const int most = most_missing(done, wanted);
    for (double share = 0; share < 1;) {
      progress(share);
      pass(budget.seconds ? 2 : 8);
      const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
      share = budget.seconds ? spent.count() / *budget.seconds
                             : 1 - static_cast<double>(most_missing(done, wanted)) / most;
    }
    progress(1.0);
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k].store(done[k], k, frame);
    set_samples(done, frame);
  } while (budget.more && add_samples(budget.more(frame), frame, wanted));
  return frame;
}

}  // namespace heddle
