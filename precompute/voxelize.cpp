#include "precompute/voxelize.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fibers/math/wrapped.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"

namespace heddle {
namespace {

float squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const float s = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0F, 1.0F);
  return (a + s * along - p).squaredNorm();
}

}  // namespace

VolumeSettings read_volume_settings(const TomlTable& section) {
  VolumeSettings settings;
  settings.voxels_per_radius =
      section.number("voxels_per_radius", {0.1, 16}, settings.voxels_per_radius);
  return settings;
}

IdVolume voxelize(const Exemplar& exemplar, const VolumeSettings& settings) {
  const float thinnest = *std::min_element(exemplar.radius_mm.begin(), exemplar.radius_mm.end());
  const double edge = thinnest / settings.voxels_per_radius;
  const std::array<double, 3> extent = {exemplar.width_mm, exemplar.height_mm,
                                        exemplar.z_max - exemplar.z_min};
  IdVolume volume;
  volume.origin_mm = {0, 0, exemplar.z_min};
  double count = 1;
  for (int a = 0; a < 3; ++a) {
    const double voxels = std::max(1.0, std::round(extent[a] / edge));
    count *= voxels;
    if (!(count < 0x1p31)) {
      throw ConfigError(
          fmt::format("volume: {} voxels per fiber radius need more than 2^31 voxels for one tile; "
                      "lower voxels_per_radius",
                      settings.voxels_per_radius));
    }
    volume.size[a] = static_cast<int>(voxels);
    volume.voxel_mm[a] = extent[a] / voxels;
  }
  // Ids and distances here, the grid and its bytes when it is written.
  require_memory(static_cast<std::uint64_t>(4 * sizeof(float) * count),
                 fmt::format("a volume of {:.3g} voxels", count));
  volume.ids.assign(static_cast<std::size_t>(count), -1);
  std::vector<float> nearest(volume.ids.size(),
                             std::numeric_limits<float>::infinity());  // squared, to the axis

  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const Vec3& a = exemplar.points[exemplar.segment_point[s]];
    const Vec3& b = exemplar.points[exemplar.segment_point[s] + 1];
    const float radius = exemplar.radius_mm[exemplar.segment_fiber[s]];
    // Voxels whose centres may lie within the segment, not wrapped.
    std::array<int, 3> low;
    std::array<int, 3> high;
    for (int k = 0; k < 3; ++k) {
      const double from = std::min(a[k], b[k]) - radius - volume.origin_mm[k];
      const double to = std::max(a[k], b[k]) + radius - volume.origin_mm[k];
      low[k] = static_cast<int>(std::floor(from / volume.voxel_mm[k] - 0.5));
      high[k] = static_cast<int>(std::ceil(to / volume.voxel_mm[k] - 0.5));
    }
    low[2] = std::max(low[2], 0);
    high[2] = std::min(high[2], volume.size[2] - 1);
    for (int z = low[2]; z <= high[2]; ++z) {
      for (int y = low[1]; y <= high[1]; ++y) {
        const std::size_t row =
            (static_cast<std::size_t>(z) * volume.size[1] + wrapped(y, volume.size[1])) *
            volume.size[0];
        for (int x = low[0]; x <= high[0]; ++x) {
          const Vec3 centre(
              static_cast<float>(volume.origin_mm[0] + (x + 0.5) * volume.voxel_mm[0]),
              static_cast<float>(volume.origin_mm[1] + (y + 0.5) * volume.voxel_mm[1]),
              static_cast<float>(volume.origin_mm[2] + (z + 0.5) * volume.voxel_mm[2]));
          const float squared = squared_distance_to_segment(centre, a, b);
          const std::size_t voxel = row + wrapped(x, volume.size[0]);
          if (squared <= radius * radius && squared < nearest[voxel]) {
            nearest[voxel] = squared;
            volume.ids[voxel] = static_cast<std::int32_t>(s);
          }
        }
      }
    }
  }
  return volume;
}

}  // namespace heddle
