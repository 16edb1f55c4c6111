#include "fibers/tracing/cloth_tiling.h"

#include <cassert>
#include <utility>

namespace heddle {

ClothTiling::ClothTiling(Tile tile)
    : tiles_{std::move(tile)},
      width_mm_(tiles_[0]->exemplar().width_mm),
      height_mm_(tiles_[0]->exemplar().height_mm),
      z_min_(tiles_[0]->exemplar().z_min),
      z_max_(tiles_[0]->exemplar().z_max) {}

ClothTiling::ClothTiling(std::vector<Tile> tiles, BlockLayout layout)
    : tiles_(std::move(tiles)),
      layout_(std::move(layout)),
      width_mm_(layout_->width_mm),
      height_mm_(layout_->height_mm),
      z_min_(tiles_[0]->exemplar().z_min),
      z_max_(tiles_[0]->exemplar().z_max) {
  assert(layout_->tile_blocks.size() == tiles_.size());
  assert(layout_->pattern.size() ==
         static_cast<std::size_t>(layout_->columns) * static_cast<std::size_t>(layout_->rows));
  for (const Tile& tile : tiles_) {
    z_min_ = std::min(z_min_, tile->exemplar().z_min);
    z_max_ = std::max(z_max_, tile->exemplar().z_max);
  }
}

std::array<double, 2> ClothTiling::within_thickness(const Ray& ray) const {
  const double z = static_cast<double>(ray.origin.z());
  const double slope = static_cast<double>(ray.direction.z());
  const double slack = 1e-6 * (static_cast<double>(z_max_) - static_cast<double>(z_min_));
  const double low = static_cast<double>(z_min_) - slack;
  const double high = static_cast<double>(z_max_) + slack;
  double from = static_cast<double>(ray.t_min);
  double to = static_cast<double>(ray.t_max);
  if (slope == 0) return z < low || z > high ? std::array{1.0, 0.0} : std::array{from, to};
  from = std::max(from, std::min((low - z) / slope, (high - z) / slope));
  to = std::min(to, std::max((low - z) / slope, (high - z) / slope));
  return {from, to};
}

}  // namespace heddle
