#include "fibers/baked/cell_grid.h"

#include <algorithm>
#include <cmath>

namespace heddle {

std::uint32_t CellGrid::cell_of(const Vec3& position) const {
  auto place = [](float share, int count, bool wraps) {
    if (wraps) share -= std::floor(share);
    return std::clamp(static_cast<int>(share * static_cast<float>(count)), 0, count - 1);
  };
  const int x = place(position.x() / width_mm, cells[0], true);
  const int y = place(position.y() / height_mm, cells[1], true);
  const int z = place((position.z() - z_min) / (z_max - z_min), cells[2], false);
  return static_cast<std::uint32_t>((z * cells[1] + y) * cells[0] + x);
}

CellGrid make_cell_grid(float width_mm, float height_mm, float z_min, float z_max, float edge_mm) {
  auto count = [&](float length) { return std::max(1, static_cast<int>(std::lround(length / edge_mm))); };
  return {{count(width_mm), count(height_mm), count(z_max - z_min)}, width_mm, height_mm, z_min, z_max};
}

}  // namespace heddle
