#ifndef HEDDLE_RENDER_STAND_IN_FLAT_MAPS_H_
#define HEDDLE_RENDER_STAND_IN_FLAT_MAPS_H_
// One repeat of a fabric as seen from straight above, texel by texel: what baked maps for other
// renderers are made of. Rays meet the fibers themselves, so neighbours across the edges of the
// maps are neighbours on the cloth. Fabric space; row 0 is the top of a map, where y is largest.
// Tested in tests/render/stand_in/flat_maps_test.cpp.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/tile_scene.h"
#include "render/lights.h"

namespace heddle {

struct FlatMaps {
  int width = 0;  // texels
  int height = 0;
  float width_mm = 0;  // of the repeat
  float height_mm = 0;
  // [texel] share of its area that is fiber. Texels without fiber hold the means of the others.
  std::vector<float> opacity;
  std::vector<float> relief_mm;  // [texel] mean z of the fibers seen
  // [texel] what the fibers send up of the light of an even sky, radiance 1 from z > 0
  std::vector<Rgb> albedo;
  std::vector<Vec3> normal;        // [texel] mean normal of the surfaces seen, unit, z > 0
  std::vector<Vec2> along;         // [texel] direction of the fibers in the cloth's plane, unit
  std::vector<float> tilt_along;   // [texel] variance of the normals' component along the fibers
  std::vector<float> tilt_across;  // [texel] and of that across them
  std::vector<Rgb> picture;        // [texel] radiance under the lights asked for, gaps black

  std::size_t texel_count() const { return opacity.size(); }
  /// Share of the repeat that is fiber.
  double cover() const;
  /// Least and largest of relief_mm.
  std::pair<float, float> relief_range_mm() const;
};

struct FlatMapSettings {
  int pixels = 512;  // texels along the longer side; the other by the repeat's shape
  int spp = 64;      // rays and paths per texel
  std::uint64_t seed = 0;
};

/// `lights`: environments and spherical Gaussians, which paths meet by escaping. Progress as a
/// share.
FlatMaps bake_flat_maps(const TileScene& scene, std::span<const BcsdfTable> materials,
                        std::span<const Light> lights, const FlatMapSettings& settings,
                        const std::function<void(double)>& progress);

}  // namespace heddle

#endif  // HEDDLE_RENDER_STAND_IN_FLAT_MAPS_H_
