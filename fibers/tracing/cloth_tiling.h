#ifndef HEDDLE_FIBERS_TRACING_CLOTH_TILING_H_
#define HEDDLE_FIBERS_TRACING_CLOTH_TILING_H_
// The endless cloth made of one exemplar, or of blocks of several. One exemplar is repeated as its
// tile is (TileScene). With a layout, a ray marches from block to block, and each block's exemplar
// is asked for what lies within that block only: fibers are cut at the borders of blocks, as in
// Khungurn 2017, section 6.4. Where equal blocks fit, the cut does not show.
//
// A ray's own fiber is known by its exemplar and its id there. It is ignored in every block of that
// exemplar. Across a border to another exemplar its yarn goes on as another fiber, which counts.
// Fabric space, millimetres. Tested in tests/fibers/tracing/cloth_tiling_test.cpp.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fibers/tracing/block_layout.h"
#include "fibers/tracing/tile_scene.h"

namespace heddle {

/// A place on the cloth's plane: a block (of the layout, or a whole tile) and the position of a
/// point relative to its corner.
struct BlockPlace {
  std::int64_t column = 0;
  std::int64_t row = 0;
  Vec3d offset;
};

struct TilingHit {
  std::uint32_t exemplar;
  FiberHit hit;
};

class ClothTiling {
 public:
  using Tile = std::shared_ptr<const TileScene>;

  /// One exemplar, repeated.
  ClothTiling(Tile tile);  // NOLINT(google-explicit-constructor): a tile is a tiling
  template <class Scene>
  ClothTiling(std::shared_ptr<Scene> tile)  // NOLINT(google-explicit-constructor)
      : ClothTiling(Tile(std::move(tile))) {}
  /// Blocks of several. The layout's tile_blocks fit the tiles' sizes.
  ClothTiling(std::vector<Tile> tiles, BlockLayout layout);

  const std::vector<Tile>& tiles() const { return tiles_; }
  /// Nothing where one exemplar is repeated.
  const BlockLayout* layout() const { return layout_ ? &*layout_ : nullptr; }
  /// Lowest and highest point of any fiber.
  float z_min() const { return z_min_; }
  float z_max() const { return z_max_; }

  BlockPlace place_of(const Vec3d& fabric) const {
    const double column = std::floor(fabric.x() / width_mm_);
    const double row = std::floor(fabric.y() / height_mm_);
    return {static_cast<std::int64_t>(column), static_cast<std::int64_t>(row),
            Vec3d(fabric.x() - width_mm_ * column, fabric.y() - height_mm_ * row, fabric.z())};
  }
  /// A point of an exemplar's block as seen in the exemplar's tile; and which block that is.
  BlockLayout::Block block_at(const BlockPlace& place) const {
    return layout_ ? layout_->at(place.column, place.row) : BlockLayout::Block{};
  }
  Vec3d in_tile(const BlockPlace& place) const {
    const BlockLayout::Block block = block_at(place);
    return place.offset + Vec3d(block.column * width_mm_, block.row * height_mm_, 0);
  }

  /// The first hit of `query` on the ray, whose origin is relative to the corner of the place's
  /// block. query(exemplar, ray) -> std::optional<FiberHit> looks along a ray in the exemplar's
  /// tile.
  template <class Query>
  std::optional<TilingHit> first_hit(const BlockPlace& place, const Ray& ray, Query&& query) const {
    if (!layout_) {
      const std::optional<FiberHit> hit = query(0U, ray);
      if (!hit) return {};
      return TilingHit{0, *hit};
    }
    return march(place, ray, query);
  }

 private:
  // As of a tile in TileScene: a ray is followed so far beyond a block's edge.
  static constexpr double kOverlap = 0.5e-4;

  template <class Query>
  std::optional<TilingHit> march(const BlockPlace& place, const Ray& ray, Query&& query) const;
  /// The part of [t_min, t_max] within the thickness; empty where the first is larger.
  std::array<double, 2> within_thickness(const Ray& ray) const;

  std::vector<Tile> tiles_;
  std::optional<BlockLayout> layout_;
  double width_mm_;  // of a block
  double height_mm_;
  float z_min_;
  float z_max_;
};

template <class Query>
std::optional<TilingHit> ClothTiling::march(const BlockPlace& place, const Ray& ray,
                                            Query&& query) const {
  auto [t, t_end] = within_thickness(ray);
  if (!(t <= t_end)) return {};
  const Vec3d origin = ray.origin.cast<double>();
  const Vec3d direction = ray.direction.cast<double>();
  const double size[2] = {width_mm_, height_mm_};
  const Vec3d start = origin + t * direction;
  double cell[2];    // block, counted from the place's
  double t_next[2];  // where the ray leaves the block along this axis
  double t_step[2];
  double step[2];
  for (int axis = 0; axis < 2; ++axis) {
    cell[axis] = std::floor(start[axis] / size[axis]);
    const double d = direction[axis];
    step[axis] = d > 0 ? 1 : (d < 0 ? -1 : 0);
    t_step[axis] = t_next[axis] = std::numeric_limits<double>::infinity();
    if (d == 0) continue;
    t_step[axis] = size[axis] / std::abs(d);
    t_next[axis] = ((cell[axis] + (d > 0 ? 1 : 0)) * size[axis] - origin[axis]) / d;
  }
  for (int blocks = 0; blocks < TileScene::kMaxTiles; ++blocks) {
    const BlockLayout::Block block = layout_->at(place.column + static_cast<std::int64_t>(cell[0]),
                                                 place.row + static_cast<std::int64_t>(cell[1]));
    const double t_exit = std::min({t_next[0], t_next[1], t_end});
    const double overlap = kOverlap * std::min(t_step[0], t_step[1]);
    const double t_base = blocks == 0 ? t : std::max(t - overlap, static_cast<double>(ray.t_min));
    const Vec3d local =
        origin + t_base * direction +
        Vec3d((block.column - cell[0]) * size[0], (block.row - cell[1]) * size[1], 0);
    const float length = static_cast<float>(std::min(t_exit + overlap, t_end) - t_base);
    if (std::optional<FiberHit> hit =
            query(block.exemplar, Ray{local.cast<float>(), ray.direction, 0, length})) {
      hit->t = static_cast<float>(t_base + static_cast<double>(hit->t));
      return TilingHit{block.exemplar, *hit};
    }
    if (t_exit >= t_end) return {};
    const int axis = t_next[0] <= t_next[1] ? 0 : 1;
    cell[axis] += step[axis];
    t = t_next[axis];
    t_next[axis] += t_step[axis];
  }
  return {};
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_CLOTH_TILING_H_
