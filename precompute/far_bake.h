#ifndef HEDDLE_PRECOMPUTE_FAR_BAKE_H_
#define HEDDLE_PRECOMPUTE_FAR_BAKE_H_
// Makes a fabric's far form (fibers/baked/far_table.h) of its other precomputed data: means over
// what rays from one direction see of the flat, endless cloth.
//
// Visibility enters single scattering linearly. So the hits of a view are sorted by the tangents
// and materials of their fibers, and of each sort the maps of visibility are summed. The fiber's
// scattering is then evaluated once for each sort and light, not for each hit. Tangents of one sort
// differ by less than the blur in the light's direction, which keeps narrow lobes from falling
// between the cells of the grid. What that blur is stands in FarTable::light_variance.
//
// Multiple scattering is linear in the light's harmonics: coefficients are carried backwards from
// the eye through the fiber and through the cell's matrix. Light on cones is evaluated at a few of
// the hits. Tested in tests/precompute/far_bake_test.cpp.

#include <cstdint>
#include <functional>
#include <span>

#include "fibers/baked/far_table.h"
#include "fibers/baked/segment_visibility.h"
#include "fibers/baked/transfer.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/tile_scene.h"

namespace heddle {

struct FarSettings {
  int resolution = 32;  // of the grid of directions, a multiple of 4; cells of 4.5 degrees
  int rays = 2048;      // per view
  int cone_hits = 96;   // per view, at which light on cones is evaluated
  std::uint64_t seed = 1;
};

/// All that is pointed to outlives the bake.
struct FarInputs {
  const TileScene* scene;
  const SsdfVisibility* ssdf;
  const Transfer* transfer;
  std::span<const Vec3> bundle_tangent;  // [segment], where the transfer has cones
  std::span<const BcsdfTable> materials;
  double repeat_mm;  // edge of a square as large as the weave's repeat
};

/// progress: called with the share done; may throw. The result does not depend on threads.
FarTable bake_far(const FarInputs& inputs, const FarSettings& settings,
                  const std::function<void(double)>& progress);

/// Memory for the bake's tables, bytes.
std::uint64_t far_bake_bytes(std::uint64_t segments, bool both_sides, const FarSettings& settings);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_FAR_BAKE_H_
