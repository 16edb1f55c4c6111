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
    const BcsdfTable& bcsdf = materials[vertex.material];
    const auto sample = bcsdf.sample(frame.transpose() * wo, random, throughput);
    throughput *= sample.weight;
    if constexpr (requires { vertex.tint; }) throughput *= vertex.tint;
    variance += sample.deviation * sample.deviation;
    if (n >= limits.roulette_from) {
      const float survival = std::min(1.0F, throughput.maxCoeff());
      if (!(random.uniform() < survival)) return {};
      throughput /= survival;
    } else if (!(throughput.maxCoeff() > 0)) {
      return {};
    }
    const Vec3 wi = frame * sample.wi;
    on_ray(vertex, wi, throughput, sample.pdf, n);
    std::optional<typename Trace::Vertex> next = trace.next(vertex, wi);
    if (!next) return PathEscape{wi, throughput, sample.pdf, n, variance};
    vertex = *next;
    wo = -wi;
  }
  return {};
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_PATH_WALK_H_
