#ifndef HEDDLE_RENDER_WALKED_LIGHT_H_
#define HEDDLE_RENDER_WALKED_LIGHT_H_
// Light that one path brings back along the way it was walked: by shadow rays at every vertex and
// by the path's escape, weighed against each other by the power heuristic (Veach 1997). Shared by
// the path tracer of scenes (ClothTrace) and of flat swatches (TileTrace). Scattered rays find near
// lights on their way too, whatever lies beyond. Light may be kept apart by groups of lights, and
// single scattering by the fiber's lobes. Tested in tests/render/path_tracer_test.cpp and
// tests/render/near_lights_test.cpp.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "fibers/math/sampling.h"
#include "fibers/tracing/path_walk.h"
#include "render/lights.h"
#include "render/pixel_sums.h"
#include "render/surface_cloth.h"

namespace heddle {

/// What light is scattered by and where it comes from.
struct WalkedFrom {
  std::span<const BcsdfTable> materials;
  // the same fibers without TT, where EyeSample::transmitted is asked for; else empty
  std::span<const BcsdfTable> reflecting;
  std::span<const Light> lights;
  LightEstimator estimator;
  WalkLimits limits;
};

/// The share that TT has of S(in, out), per colour.
inline Rgb transmitted_share(const BcsdfTable& all, const BcsdfTable& reflecting, const Vec3& in,
                             const Vec3& out) {
  const Rgb both = all.evaluate(in, out);
  const Rgb reflected = reflecting.evaluate(in, out);
  Rgb share = Rgb::Zero();
  for (int c = 0; c < 3; ++c) {
    if (both[c] > 0) share[c] = std::max(0.0F, 1 - reflected[c] / both[c]);
  }
  return share;
}

/// Adds light that leaves `vertex` towards `wo` to by_group[Light::group]; all of it to the only
/// one, where there is one. A Trace of path_walk.h, which also answers
/// `position(vertex)`, and `escapes(vertex, direction, distance)`: is the way clear for so many mm?
/// A Vertex may have `is_end`: the path brings nothing from there; or a `surface`, a SurfaceHit:
/// it is no fiber.
template <class Trace>
void walked_light(const Trace& trace, const WalkedFrom& from, const typename Trace::Vertex& vertex,
                  const Vec3& wo, RandomStream& random, std::span<EyeSample> by_group) {
  const std::span<const BcsdfTable> materials = from.materials;
  const std::span<const BcsdfTable> reflecting = from.reflecting;
  const std::span<const Light> lights = from.lights;
  const LightEstimator estimator = from.estimator;
  const auto group_of = [&](const Light& light) -> std::size_t {
    return by_group.size() == 1 ? 0 : light.group;
  };
  // Light from `direction` that was scattered for the `scattering`th time when it left the fiber.
  const auto add = [&](std::size_t group, const Rgb& value, const Vec3& direction, int scattering) {
    EyeSample& sample = by_group[group];
    if (scattering > 1) {
      sample.multiple += value;
      return;
    }
    sample.single += value;
    if (reflecting.empty()) return;
    if constexpr (requires { vertex.surface; }) {
      if (vertex.surface) return;  // surfaces let nothing through
    }
    const Mat3 to_fiber = frame_about(vertex.tangent).transpose();
    sample.transmitted +=
        value * transmitted_share(materials[vertex.material], reflecting[vertex.material],
                                  to_fiber * direction, to_fiber * wo);
  };
  const auto by_shadow_rays = [&](const auto& at, const Mat3& frame, const Vec3& out,
                                  const Rgb& throughput, int scattering) {
    if constexpr (requires { at.is_end; }) {
      if (at.is_end) return false;
    }
    if (estimator == LightEstimator::kEscapes) return true;
    if constexpr (requires { at.surface; }) {
      if (at.surface) {
        const auto open = [&](const Vec3& direction, double distance) {
          return trace.escapes(at, direction, distance);
        };
        for (const Light& light : lights) {
          const Rgb value =
              light_by_shadow_rays(*at.surface, out, std::span(&light, 1), estimator, random, open);
          add(group_of(light), throughput * value, out, scattering);
        }
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
      add(group_of(light), value, incoming.direction, scattering);
    }
    return true;
  };
  const auto on_the_way = [&](const auto& start, const Vec3& direction, const Rgb& throughput,
                              float pdf, int scattering) {
    if (estimator == LightEstimator::kShadowRays) return;
    for (const Light& light : lights) {
      const std::optional<MetLight> met = meet_light(light, trace.position(start), direction);
      if (!met || !trace.escapes(start, direction, met->distance)) continue;
      Rgb value = throughput * met->radiance;
      if (estimator == LightEstimator::kCombined) value *= power_heuristic(pdf, met->pdf);
      add(group_of(light), value, direction, scattering);
    }
  };
  const std::optional<PathEscape> escape = walk_path(
      trace, materials, vertex, wo, Rgb(1, 1, 1), random, from.limits, by_shadow_rays, on_the_way);
  if (!escape || estimator == LightEstimator::kShadowRays) return;
  for (std::size_t group = 0; group < by_group.size(); ++group) {
    Rgb light_sum = Rgb::Zero();
    for (const Light& light : lights) {
      if (group_of(light) != group) continue;
      Rgb incoming = light_radiance(light, escape->direction);
      if (estimator == LightEstimator::kCombined)
        incoming *= power_heuristic(escape->pdf, light_pdf(light, escape->direction));
      light_sum += incoming;
    }
    add(group, escape->throughput * light_sum, escape->direction, escape->scatterings);
  }
}

/// The same of all lights together, whichever lobe scatters it.
template <class Trace>
EyeSample walked_light(const Trace& trace, std::span<const BcsdfTable> materials,
                       std::span<const Light> lights, LightEstimator estimator,
                       const WalkLimits& limits, const typename Trace::Vertex& vertex,
                       const Vec3& wo, RandomStream& random) {
  EyeSample sample;
  walked_light(trace, {materials, {}, lights, estimator, limits}, vertex, wo, random, {&sample, 1});
  return sample;
}

}  // namespace heddle

#endif  // HEDDLE_RENDER_WALKED_LIGHT_H_
