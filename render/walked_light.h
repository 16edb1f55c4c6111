#ifndef HEDDLE_RENDER_WALKED_LIGHT_H_
#define HEDDLE_RENDER_WALKED_LIGHT_H_
// Light that one path brings back along the way it was walked: by shadow rays at every vertex and
// by the path's escape, weighed against each other by the power heuristic (Veach 1997). Shared by
// the path tracer of scenes (ClothTrace) and of flat swatches (TileTrace). Scattered rays find near
// lights on their way too, whatever lies beyond. Tested in tests/render/path_tracer_test.cpp and
// tests/render/near_lights_test.cpp.

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "fibers/math/sampling.h"
#include "fibers/tracing/path_walk.h"
#include "render/lights.h"
#include "render/pixel_sums.h"
#include "render/surface_cloth.h"

namespace heddle {

/// Light that leaves `vertex` towards `wo`. A Trace of path_walk.h, which also answers
/// `position(vertex)`, and `escapes(vertex, direction, distance)`: is the way clear for so many mm?
/// A Vertex may have `is_end`: the path brings nothing from there; or a `surface`, a SurfaceHit:
/// it is no fiber.
template <class Trace>
EyeSample walked_light(const Trace& trace, std::span<const BcsdfTable> materials,
                       std::span<const Light> lights, LightEstimator estimator,
                       const WalkLimits& limits, const typename Trace::Vertex& vertex,
                       const Vec3& wo, RandomStream& random) {
  EyeSample sample;
  const auto by_shadow_rays = [&](const auto& at, const Mat3& frame, const Vec3& out,
                                  const Rgb& throughput, int scattering) {
    if constexpr (requires { at.is_end; }) {
      if (at.is_end) return false;
    }
    if (estimator == LightEstimator::kEscapes) return true;
    if constexpr (requires { at.surface; }) {
      if (at.surface) {
        (scattering == 1 ? sample.single : sample.multiple) +=
            throughput * light_by_shadow_rays(*at.surface, out, lights, estimator, random,
                                              [&](const Vec3& direction, double distance) {
                                                return trace.escapes(at, direction, distance);
                                              });
        return true;
      }
    }
    const BcsdfTable& bcsdf = materials[at.material];
    const Vec3 local_out = frame.transpose() * out;
    for (const Light& light : lights) {
      const LightSample incoming = sample_light(light, trace.position(at), random);
      const Vec3 local_in = frame.transpose() * incoming.direction;
      const float cosine = std::sqrt(std::max(0.0F, 1.0F - local_in.x() * local_in.x()));
      Rgb value = throughput * incoming.weight * bcsdf.evaluate(local_in, local_out) * cosine;
      if constexpr (requires { at.tint; }) value *= at.tint;
      if (!(value.maxCoeff() > 0)) continue;
      if (estimator == LightEstimator::kCombined && !light.is_delta())
        value *= power_heuristic(incoming.pdf, bcsdf.pdf(local_in, local_out, throughput));
      if (!trace.escapes(at, incoming.direction, incoming.distance)) continue;
      (scattering == 1 ? sample.single : sample.multiple) += value;
    }
    return true;
  };
  const auto on_the_way = [&](const auto& from, const Vec3& direction, const Rgb& throughput,
                              float pdf, int scattering) {
    if (estimator == LightEstimator::kShadowRays) return;
    for (const Light& light : lights) {
      const std::optional<MetLight> met = meet_light(light, trace.position(from), direction);
      if (!met || !trace.escapes(from, direction, met->distance)) continue;
      Rgb value = throughput * met->radiance;
      if (estimator == LightEstimator::kCombined) value *= power_heuristic(pdf, met->pdf);
      (scattering == 1 ? sample.single : sample.multiple) += value;
    }
  };
  const std::optional<PathEscape> escape = walk_path(trace, materials, vertex, wo, Rgb(1, 1, 1),
                                                     random, limits, by_shadow_rays, on_the_way);
  if (!escape || estimator == LightEstimator::kShadowRays) return sample;
  Rgb light_sum = Rgb::Zero();
  for (const Light& light : lights) {
    Rgb incoming = light_radiance(light, escape->direction);
    if (estimator == LightEstimator::kCombined)
      incoming *= power_heuristic(escape->pdf, light_pdf(light, escape->direction));
    light_sum += incoming;
  }
  (escape->scatterings == 1 ? sample.single : sample.multiple) += escape->throughput * light_sum;
  return sample;
}

}  // namespace heddle

#endif  // HEDDLE_RENDER_WALKED_LIGHT_H_
