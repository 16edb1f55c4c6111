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
      bricks_{brick_count(volume.size[0]), brick_count(volume.size[1]),
              brick_count(volume.size[2])} {
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
    origin[a] =
        (static_cast<double>(ray.origin[a]) - static_cast<double>(origin_[a])) / voxel_mm_[a];
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
  // Start in tile (0, 0).
  for (int a = 0; a < 2; ++a)
    origin[a] -= std::floor((origin[a] + t * slope[a]) / size_[a]) * size_[a];

  // Slices across the axis along which the ray passes the most voxels; each is looked at where the
  // ray meets its middle.
  int axis = std::abs(slope[0]) >= std::abs(slope[1]) ? 0 : 1;
  if (std::abs(slope[2]) >= std::abs(slope[axis])) axis = 2;
  const bool ascending = slope[axis] > 0;
  // first slice whose middle is not before the parameter `at`
  const auto slice_from = [&](double at) {
    const double position = origin[axis] + at * slope[axis] - 0.5;
    return static_cast<int>(ascending ? std::ceil(position) : std::floor(position));
  };
  int slice = slice_from(t);
  const int last_slice = slice + (ascending ? 1 : -1) * TileScene::kMaxTiles * size_[axis];
  while (slice != last_slice) {
    t = (slice + 0.5 - origin[axis]) * inverse[axis];
    if (!(t <= t_end)) return {};
    int cell[3];     // not wrapped
    int wrapped[3];  // within the tile
    for (int a = 0; a < 3; ++a) {
      cell[a] = a == axis ? slice : static_cast<int>(std::floor(origin[a] + t * slope[a]));
      if (a == 2) cell[a] = std::clamp(cell[a], 0, size_[2] - 1);
      wrapped[a] = cell[a];
      if (cell[a] < 0 || cell[a] >= size_[a]) {
        wrapped[a] = cell[a] % size_[a];
        if (wrapped[a] < 0) wrapped[a] += size_[a];
      }
    }
    const std::uint32_t start =
        brick_start_[(static_cast<std::size_t>(wrapped[2] / kEdge) * bricks_[1] +
                      wrapped[1] / kEdge) *
                         bricks_[0] +
                     wrapped[0] / kEdge];
    if (start != kEmptyBrick) {
      const std::int32_t id =
          ids_[start + within_brick(wrapped[0] % kEdge, wrapped[1] % kEdge, wrapped[2] % kEdge)];
      if (id >= 0)
        return FiberHit{static_cast<float>(std::max(t, static_cast<double>(ray.t_min))),
                        static_cast<std::uint32_t>(id)};
      slice += ascending ? 1 : -1;
      continue;
    }
    // Past the empty brick in one step. Bricks at the far edge of the tile are cut off there.
    double t_exit = kInfinity;
    for (int a = 0; a < 3; ++a) {
      if (slope[a] == 0) continue;
      const int low = cell[a] - wrapped[a] % kEdge;
      const int high = low + std::min(kEdge, size_[a] - (wrapped[a] - wrapped[a] % kEdge));
      t_exit = std::min(t_exit, ((slope[a] > 0 ? high : low) - origin[a]) * inverse[a]);
    }
    if (!(t_exit <= t_end)) return {};
    const int next = slice_from(t_exit);
    // At least one slice further, and not past the limit.
    slice = ascending ? std::clamp(next, slice + 1, last_slice)
                      : std::clamp(next, last_slice, slice - 1);
  }
  return {};
}

}  // namespace heddle
