#ifndef HEDDLE_FIBERS_BAKED_CELL_GRID_H_
#define HEDDLE_FIBERS_BAKED_CELL_GRID_H_
// The regular grid of cells over one tile in which indirect light is averaged. Cell index (z * ny + y) * nx + x.

#include <array>
#include <cstdint>

#include "fibers/math/vector.h"

namespace heddle {

struct CellGrid {
  std::array<int, 3> cells = {1, 1, 1};  // along x, y, z
  float width_mm = 1;                    // of the tile
  float height_mm = 1;
  float z_min = 0;
  float z_max = 1;

  std::uint32_t count() const { return static_cast<std::uint32_t>(cells[0] * cells[1] * cells[2]); }
  /// Cell of a fabric-space position; x and y wrap, z is clamped.
  std::uint32_t cell_of(const Vec3& position) const;
};

/// The grid whose cell edges come as near as possible to `edge_mm` with a whole number of cells along each axis.
CellGrid make_cell_grid(float width_mm, float height_mm, float z_min, float z_max, float edge_mm);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_CELL_GRID_H_
