#include "fibers/baked/id_bricks.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace heddle {
namespace {

constexpr int kEdge = 8;  // voxels along a brick's edge
constexpr int kBrickVoxels = kEdge * kEdge * kEdge;
constexpr std::uint32_t kEmptyBrick = 0xffffffffU;

int brick_count(int voxels) {
  return (voxels + kEdge - 1) / kEdge;
}

/// Index of a voxel within its brick, from its coordinates within the brick.
std::size_t within_brick(int x, int y, int z) {
  return static_cast<std::size_t>((z * kEdge + y) * kEdge + x);
}

}  // namespace

IdBricks::IdBricks(const IdVolume& volume)
    : size_(volume.size),
      bricks_{brick_count(volume.size[0]), brick_count(volume.size[1]), brick_count(volume.size[2])} {
  for (int a = 0; a < 3; ++a) {
    assert(size_[a] > 0 && volume.voxel_mm[a] > 0);
    origin_[a] = static_cast<float>(volume.origin_mm[a]);
    voxel_mm_[a] = static_cast<float>(volume.voxel_mm[a]);
  }
  assert(volume.ids.size() == static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
  brick_start_.assign(static_cast<std::size_t>(bricks_[0]) * bricks_[1] * bricks_[2], kEmptyBrick);
  std::vector<std::int32_t> brick(kBrickVoxels);
  std::size_t index = 0;
  for (int bz = 0; bz < bricks_[2]; ++bz) {
    for (int by = 0; by < bricks_[1]; ++by) {
      for (int bx = 0; bx < bricks_[0]; ++bx, ++index) {
        std::fill(brick.begin(), brick.end(), -1);
        bool empty = true;
        for (int z = bz * kEdge; z < std::min((bz + 1) * kEdge, size_[2]); ++z) {
          for (int y = by * kEdge; y < std::min((by + 1) * kEdge, size_[1]); ++y) {
            const std::size_t row = (static_cast<std::size_t>(z) * size_[1] + y) * size_[0];
            for (int x = bx * kEdge; x < std::min((bx + 1) * kEdge, size_[0]); ++x) {
              const std::int32_t id = volume.ids[row + x];
              brick[within_brick(x - bx * kEdge, y - by * kEdge, z - bz * kEdge)] = id;
              empty = empty && id < 0;
            }
          }
        }
        if (empty) continue;
        brick_start_[index] = static_cast<std::uint32_t>(ids_.size());
        ids_.insert(ids_.end(), brick.begin(), brick.end());
      }
    }
  }
}

std::size_t IdBricks::memory_bytes() const {
  return ids_.size() * sizeof(ids_[0]) + brick_start_.size() * sizeof(brick_start_[0]);
}

std::optional<FiberHit> IdBricks::first_hit(const Ray& ray) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  // The ray in units of voxels, in double: planes of far copies stay exact integers.
  double origin[3];
  double slope[3];
  double inverse[3];
  for (int a = 0; a < 3; ++a) {
    origin[a] = (static_cast<double>(ray.origin[a]) - static_cast<double>(origin_[a])) / voxel_mm_[a];
    slope[a] = static_cast<double>(ray.direction[a]) / voxel_mm_[a];
    inverse[a] = 1 / slope[a];
  }
  double t = ray.t_min;
  double t_end = ray.t_max;

  // The part of the ray within the thickness of the cloth.
  if (slope[2] == 0) {
    if (!(origin[2] >= 0 && origin[2] < size_[2])) return {};
  } else {
    const double at_bottom = (0 - origin[2]) * inverse[2];
    const double at_top = (size_[2] - origin[2]) * inverse[2];
    t = std::max(t, std::min(at_bottom, at_top));
    t_end = std::min(t_end, std::max(at_bottom, at_top));
  }
  if (!(t <= t_end)) return {};

  // Start in tile (0, 0); `cell` counts voxels without wrapping, `wrapped` within the tile.
  int cell[3];
  int wrapped[3];
  for (int a = 0; a < 3; ++a) {
    if (a < 2) origin[a] -= std::floor((origin[a] + t * slope[a]) / size_[a]) * size_[a];
    cell[a] = std::clamp(static_cast<int>(std::floor(origin[a] + t * slope[a])), 0, size_[a] - 1);
    wrapped[a] = cell[a];
  }
  int tiles_left = TileScene::kMaxTiles;

  // Parameter where the ray crosses plane `plane` of axis a.
  const auto crossing = [&](int a, int plane) {
    return slope[a] == 0 ? kInfinity : (plane - origin[a]) * inverse[a];
  };
  // Brings `wrapped` of axis a back into the tile after a step out of it; false once the ray is over.
  const auto wrap = [&](int a) {
    if (wrapped[a] >= 0 && wrapped[a] < size_[a]) return true;
    if (a == 2 || --tiles_left == 0) return false;
    wrapped[a] = wrapped[a] < 0 ? size_[a] - 1 : 0;
    return true;
  };
  const auto earliest = [](const double* next) {
    if (next[0] <= next[1]) return next[0] <= next[2] ? 0 : 2;
    return next[1] <= next[2] ? 1 : 2;
  };

  while (true) {
    // The brick around the current voxel: voxels first .. last along each axis, not wrapped. Bricks at the
    // far edge of the tile are cut off there.
    int first[3];
    int last[3];
    int within[3];
    for (int a = 0; a < 3; ++a) {
      within[a] = wrapped[a] % kEdge;
      first[a] = cell[a] - within[a];
      last[a] = first[a] + std::min(kEdge, size_[a] - (wrapped[a] - within[a])) - 1;
    }
    const std::uint32_t start =
        brick_start_[(static_cast<std::size_t>(wrapped[2] / kEdge) * bricks_[1] + wrapped[1] / kEdge) *
                         bricks_[0] +
                     wrapped[0] / kEdge];
    double next[3];  // parameter of the next plane along each axis
    if (start == kEmptyBrick) {
      // Through the empty brick in one step.
      for (int a = 0; a < 3; ++a) next[a] = crossing(a, slope[a] > 0 ? last[a] + 1 : first[a]);
      const int axis = earliest(next);
      t = std::max(t, next[axis]);
      if (!(t <= t_end)) return {};
      for (int a = 0; a < 3; ++a) {
        const int from = cell[a];
        if (a == axis) {
          cell[a] = slope[a] > 0 ? last[a] + 1 : first[a] - 1;
        } else {
          cell[a] = std::clamp(static_cast<int>(std::floor(origin[a] + t * slope[a])), first[a], last[a]);
        }
        wrapped[a] += cell[a] - from;
      }
      if (!wrap(axis)) return {};
      continue;
    }
    // Voxel by voxel through the brick.
    const std::int32_t* ids = &ids_[start];
    for (int a = 0; a < 3; ++a) next[a] = crossing(a, slope[a] > 0 ? cell[a] + 1 : cell[a]);
    while (true) {
      const std::int32_t id = ids[within_brick(within[0], within[1], within[2])];
      if (id >= 0) return FiberHit{static_cast<float>(t), static_cast<std::uint32_t>(id)};
      const int axis = earliest(next);
      t = std::max(t, next[axis]);
      if (!(t <= t_end)) return {};
      const int step = slope[axis] > 0 ? 1 : -1;
      cell[axis] += step;
      wrapped[axis] += step;
      within[axis] += step;
      if (cell[axis] < first[axis] || cell[axis] > last[axis]) {
        if (!wrap(axis)) return {};
        break;
      }
      next[axis] = crossing(axis, slope[axis] > 0 ? cell[axis] + 1 : cell[axis]);
    }
  }
}

}  // namespace heddle
