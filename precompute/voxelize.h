#ifndef HEDDLE_PRECOMPUTE_VOXELIZE_H_
#define HEDDLE_PRECOMPUTE_VOXELIZE_H_
// Rasterises the exemplar into a volume of segment ids. With it the renderer finds what an eye ray
// sees without tracing fibers (Khungurn 2017, section 5.1).
//
// A voxel is filled if its centre lies within a fiber. It holds the segment whose axis is nearest
// to its centre, and the lower id of two that are equally near. The paper takes the nearest
// midpoint. Between long thin segments side by side that is often a segment of the neighbouring
// fiber, or the wrong one of the same fiber, with another tangent and another material. The grid is
// periodic in x and y. A tile is a whole number of voxels wide and high, so the edges of a voxel
// differ slightly from each other. Single-threaded. Tested in tests/precompute/voxelize_test.cpp.

#include "fibers/cloth/exemplar.h"
#include "formats/id_volume_file.h"
#include "formats/toml_table.h"

namespace heddle {

struct VolumeSettings {
  /// Voxels along the radius of the thinnest fiber. Flat swatch of a small cotton tile, RMSE of all
  /// light over 492 pairs of directions, and bytes of the file per segment:
  ///   voxels   1       1.5     2       3       (rays against the fibers)
  ///   RMSE     7.8 %   6.7 %   6.1 %   6.0 %   5.3 %
  ///   bytes    60      170     350     970
  double voxels_per_radius = 1.5;
};

/// Reads the keys of a fabric's section [volume].
VolumeSettings read_volume_settings(const TomlTable& section);

/// Throws ConfigError if the tile would need more than 2^31 voxels.
IdVolume voxelize(const Exemplar& exemplar, const VolumeSettings& settings);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_VOXELIZE_H_
