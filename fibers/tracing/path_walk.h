#ifndef HEDDLE_FIBERS_TRACING_PATH_WALK_H_
#define HEDDLE_FIBERS_TRACING_PATH_WALK_H_
// One light path among explicit fibers, followed backwards from an eye or from a segment's origin.
// This is the only place where paths scatter. The transfer stage (flat tile) and the reference path
// tracer (shell-mapped cloth) share it. At each hit the incoming direction is drawn from the BCSDF
// given the outgoing one. A scattered ray starts at the hit point and ignores its own fiber.
//
// A Trace offers
//   // tangent: unit, in the space of the directions; a Vertex may have an `Rgb tint`, a factor of
//   // what is scattered there
//   struct Vertex { Vec3 position; Vec3 tangent; std::uint16_t material; ... };
//   // first hit, own fiber ignored
//   std::optional<Vertex> next(const Vertex& from, const Vec3& direction) const;
//   // Only if a Vertex has a `surface`: true where it is no fiber. Nothing if all is absorbed.
//   std::optional<WalkStep> scatter(const Vertex&, const Vec3& wo, RandomStream&) const;
// Tested in tests/fibers/tracing/path_walk_test.cpp.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"

namespace heddle {

struct WalkLimits {
  int max_scatterings = 4096;  // scattering events; a path cut here loses its remaining light
  int roulette_from = 6;       // Russian roulette from this scattering event on
};

/// One scattering event, followed backwards.
struct WalkStep {
  Vec3 wi;  // where the light came from, in the space of the Trace
  Rgb weight;
  float pdf;           // 1/sr
  float variance = 0;  // see PathEscape
};

/// Where a path left the cloth.
struct PathEscape {
  Vec3 direction;  // towards the light
  Rgb throughput;
  float pdf;        // density with which the last direction was drawn, 1/sr
  int scatterings;  // scattering events
  // sum of the variances of the lobes that scattered it: of inclination about each fiber's cone,
  // square radians
  float variance;
};

/// For walks that have no use for scattered rays.
struct IgnoreRay {
  template <class Vertex>
  void operator()(const Vertex&, const Vec3&, const Rgb&, float, int) const {}
};

/// Scattering by the fiber at a vertex.
template <class Vertex>
WalkStep scatter_by_fiber(std::span<const BcsdfTable> materials, const Vertex& vertex,
                          const Mat3& frame, const Vec3& wo, const Rgb& throughput,
                          RandomStream& random) {
  const auto sample = materials[vertex.material].sample(frame.transpose() * wo, random, throughput);
  return {frame * sample.wi, sample.weight, sample.pdf, sample.deviation * sample.deviation};
}

/// Follows the path that arrives at `vertex` and leaves it towards `wo` with the given throughput.
/// at_vertex(vertex, frame, wo, throughput, n) is called at each vertex before scattering event n =
/// 1, 2, .... The path ends there if it returns false. frame has the fiber frame's axes as columns
/// (x = tangent). on_ray(vertex, direction, throughput, pdf, n) is called for the ray that event n
/// sends on. Returns where the path escaped, or nothing if it was absorbed or ended.
template <class Trace, class AtVertex, class OnRay = IgnoreRay>
std::optional<PathEscape> walk_path(const Trace& trace, std::span<const BcsdfTable> materials,
                                    typename Trace::Vertex vertex, Vec3 wo, Rgb throughput,
                                    RandomStream& random, const WalkLimits& limits,
                                    AtVertex&& at_vertex, OnRay&& on_ray = {}) {
  float variance = 0;
  for (int n = 1; n <= limits.max_scatterings; ++n) {
    const Mat3 frame = frame_about(vertex.tangent);
    if (!at_vertex(vertex, frame, wo, throughput, n)) return {};
    WalkStep step;
    if constexpr (requires { vertex.surface; }) {
      if (vertex.surface) {
        const std::optional<WalkStep> drawn = trace.scatter(vertex, wo, random);
        if (!drawn) return {};
        step = *drawn;
      } else {
        step = scatter_by_fiber(materials, vertex, frame, wo, throughput, random);
      }
    } else {
      step = scatter_by_fiber(materials, vertex, frame, wo, throughput, random);
    }
    throughput *= step.weight;
    if constexpr (requires { vertex.tint; }) throughput *= vertex.tint;
    variance += step.variance;
    if (n >= limits.roulette_from) {
      const float survival = std::min(1.0F, throughput.maxCoeff());
      if (!(random.uniform() < survival)) return {};
      throughput /= survival;
    } else if (!(throughput.maxCoeff() > 0)) {
      return {};
    }
    on_ray(vertex, step.wi, throughput, step.pdf, n);
    std::optional<typename Trace::Vertex> next = trace.next(vertex, step.wi);
    if (!next) return PathEscape{step.wi, throughput, step.pdf, n, variance};
    vertex = *next;
    wo = -step.wi;
  }
  return {};
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_PATH_WALK_H_
