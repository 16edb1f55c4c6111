#include "render/path_tracer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cstddef>

namespace heddle {

PathTracer::PathTracer(const ClothScene& scene, std::span<const BcsdfTable> materials,
                       std::span<const Light> lights, const Rgb& background,
                       const PathTracerSettings& settings, std::span<const BcsdfTable> reflecting)
    : scene_(&scene),
      materials_(materials),
      reflecting_(reflecting),
      lights_(lights),
      background_(background),
      settings_(settings),
      trace_(scene, settings.local) {
  if (settings.light_groups == 1) return;
  lights_of_groups_.resize(settings.light_groups);
  for (const Light& light : lights) lights_of_groups_[light.group].push_back(light);
}

PathTracer::Sample PathTracer::radiance(const ClothTrace::Vertex& vertex, const Vec3& wo,
                                        RandomStream& random) const {
  Sample sample;
  walked_light(trace_, walked_from(), vertex, wo, random, {&sample, 1});
  return sample;
}

PathTracer::Sample PathTracer::trace(const EyeRay& ray, RandomStream& random) const {
  if (light_groups() == 1) {
    Sample sample;
    trace(ray, random, {&sample, 1});
    return sample;
  }
  std::vector<Sample> by_group(light_groups());
  trace(ray, random, by_group);
  return sum_of_groups(by_group);
}

void PathTracer::trace(const EyeRay& ray, RandomStream& random, std::span<Sample> by_group) const {
  const SceneRay scene_ray{ray.origin, ray.direction};
  const std::optional<ShellHit> hit = scene_->first_fiber(scene_ray);
  by_group[0].alpha = 1;
  if (const auto mesh =
          scene_->first_mesh(ray.origin, ray.direction, hit ? hit->t : scene_ray.t_max)) {
    if (mesh->surface == nullptr) return;
    const SurfaceHit surface =
        mesh->surface->hit(mesh->triangle, mesh->u, mesh->v, ray.direction, ray.spread * mesh->t);
    if (mesh->surface->is_solid() && !settings_.local) {
      walked_light(trace_, walked_from(), ClothTrace::vertex(surface), -ray.direction, random,
                   by_group);
      return;
    }
    for (std::size_t group = 0; group < by_group.size(); ++group) {
      by_group[group].single = surface_direct_light(
          surface, -ray.direction,
          by_group.size() == 1 ? lights_ : std::span<const Light>(lights_of_groups_[group]),
          settings_.estimator, random, [&](const Vec3& direction, double distance) {
            return scene_->visible({surface.position, surface.normal}, direction, distance);
          });
    }
  } else if (hit) {
    walked_light(trace_, walked_from(), trace_.vertex(*hit), -ray.direction, random, by_group);
  } else {
    by_group[0].alpha = 0;
    by_group[0].background = background_;
  }
}

std::vector<BcsdfTable> scene_materials(const ClothScene& scene) {
  return bcsdf_tables(scene.materials());
}

std::vector<BcsdfTable> without_transmission(std::span<const BcsdfTable> materials) {
  std::vector<BcsdfTable> tables;
  for (const BcsdfTable& material : materials) {
    FiberScattering fiber = material.fiber();
    fiber.color_tt = Rgbd::Zero();
    tables.emplace_back(fiber);
  }
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
  PartSums parts(sums.size(), tracer.light_groups(), tracer.tells_transmitted());
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
            std::vector<EyeSample> by_group(tracer.light_groups());
            const int first = done[place];
            done[place] = budget.seconds ? first + count : std::min(wanted[place], first + count);
            for (int s = first; s < done[place]; ++s) {
              RandomStream eye = RandomStream::stratified(seed, RandomStage::kEyeRay, pixel,
                                                          static_cast<std::uint64_t>(s));
              RandomStream random(seed, RandomStage::kPathTracer, pixel,
                                  static_cast<std::uint64_t>(s));
              const double px = x + tracer.filter().place(eye.uniform_double());
              const double py = y + tracer.filter().place(eye.uniform_double());
              std::fill(by_group.begin(), by_group.end(), EyeSample{});
              tracer.trace(camera.ray(px, py), random, by_group);
              sum.add(sum_of_groups(by_group), s);
              parts.add(place, by_group);
            }
          }
        });
  };

  FrameBuffers frame(crop.width, crop.height);
  frame.half0.resize(sums.size());
  frame.half1.resize(sums.size());
  frame.variance.resize(sums.size());
  frame.keep_parts(tracer.light_groups(), tracer.tells_transmitted());
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
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k].store(done[k], k, frame);
      parts.store(k, done[k], k, frame);
    }
    set_samples(done, frame);
  } while (budget.more && add_samples(budget.more(frame), frame, wanted));
  return frame;
}

}  // namespace heddle
