#ifndef HEDDLE_RENDER_STAND_IN_FLAT_RESPONSE_H_
#define HEDDLE_RENDER_STAND_IN_FLAT_RESPONSE_H_
// What flat, endless cloth sends to the eye in the mean, for pairs of view and directional light:
// the path-traced reference that a stand-in is fitted to and judged by. Directions in fabric space.
// Tested in tests/render/stand_in/flat_response_test.cpp.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/tile_scene.h"

namespace heddle {

struct FlatResponse {
  std::vector<Vec3> views;   // unit, z > 0
  std::vector<Vec3> lights;  // unit; from below where z < 0
  // [view * lights + light][half] radiance per unit of the cloth's area, gaps black, for light of
  // irradiance 1 across its axis; from two sets of rays independent of each other
  std::vector<std::array<Rgbd, 2>> radiance;

  std::size_t pair_count() const { return radiance.size(); }
  const Vec3& view(std::size_t pair) const { return views[pair / lights.size()]; }
  const Vec3& light(std::size_t pair) const { return lights[pair % lights.size()]; }
  Rgbd mean(std::size_t pair) const { return 0.5 * (radiance[pair][0] + radiance[pair][1]); }
};

/// rays: per view, rounded to two squares of strata. Progress as a share.
FlatResponse trace_flat_response(const TileScene& scene, std::span<const BcsdfTable> materials,
                                 std::vector<Vec3> views, std::vector<Vec3> lights, int rays,
                                 std::uint64_t seed, const std::function<void(double)>& progress);

/// Directions spread evenly over the cap of `most_degrees` about +z; other turns give other ones.
std::vector<Vec3> cap_directions(int count, double most_degrees, double turn);

}  // namespace heddle

#endif  // HEDDLE_RENDER_STAND_IN_FLAT_RESPONSE_H_
