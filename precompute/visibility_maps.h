#ifndef HEDDLE_PRECOMPUTE_VISIBILITY_MAPS_H_
#define HEDDLE_PRECOMPUTE_VISIBILITY_MAPS_H_
// Which directions are open from the origin of each segment (fibers/tracing/segment_origins.h), on
// the endless flat cloth. A map has 128 x 128 lat-long cells, with one ray through the centre of
// each. The segment's own fiber is ignored in every copy of the tile. (Khungurn 2017, section 4.1,
// where the origin is the midpoint of the axis.)
//
// With light from the face only, just the cells of the upper hemisphere are traced. The lower half
// counts as closed, here and in the signed distances and Gaussians fitted to these maps.
//
// Rays are saved without changing the result. Where a ray hits, the fiber around the hit is
// projected onto the map. All cells whose ray passes within its radius, less a margin for rounding,
// are closed without a ray of their own. A map costs about one ray per open cell and one per piece
// of fiber seen. A segment that sees nothing costs only the latter. A segment's map depends on that
// segment alone, so it is the same for any range and number of threads. Tested in
// tests/precompute/visibility_maps_test.cpp.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fibers/math/spherical_map.h"
#include "fibers/tracing/segment_origins.h"
#include "fibers/tracing/tile_scene.h"

namespace heddle {

/// Maps of a run of segments.
struct VisibilityMaps {
  static constexpr int kResolution = 128;

  std::uint32_t first_segment = 0;
  // otherwise only the upper half is stored, and the lower half is closed
  bool both_sides = false;
  std::vector<std::uint64_t> words;        // [segment][words_per_map()], bits as in SphericalMap
  std::vector<std::uint8_t> sees_nothing;  // [segment] 1 where no cell is open

  std::size_t count() const { return sees_nothing.size(); }
  std::size_t words_per_map() const {
    return SphericalMap::word_count(kResolution) / (both_sides ? 1 : 2);
  }
  /// The i-th map of the run, that of segment first_segment + i.
  SphericalMap map(std::size_t i) const;
  /// Adds the run that follows this one.
  void append(const VisibilityMaps& next);
};

/// Segments first .. last - 1, in parallel.
VisibilityMaps bake_visibility_maps(const TileScene& scene, const SegmentOrigins& origins,
                                    bool both_sides, std::uint32_t first, std::uint32_t last);

void write_visibility_maps(const std::filesystem::path& path, const VisibilityMaps& maps,
                           const std::map<std::string, std::string>& metadata);
/// Throws FileError.
VisibilityMaps read_visibility_maps(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_VISIBILITY_MAPS_H_
