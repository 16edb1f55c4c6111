#ifndef HEDDLE_FIBERS_BAKED_ID_BRICKS_H_
#define HEDDLE_FIBERS_BAKED_ID_BRICKS_H_
// The segment-id volume of one tile as 8^3 bricks. A ray marches through endless copies of the tile
// and skips an empty brick in one step. Fabric space, millimetres.
//
// The ray passes most voxels along one axis. The volume is sampled once per slice of voxels across
// that axis, where the ray meets the middle of the slice (Khungurn 2017, section 5.1, samples at
// equal distances). If every voxel that the ray touches counted, fibers would look thicker the more
// obliquely they are seen: single scattering of cotton came out 5 % too bright. Tested in
// tests/fibers/baked/id_bricks_test.cpp.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/id_volume_file.h"

namespace heddle {

class IdBricks {
 public:
  explicit IdBricks(const IdVolume& volume);

  /// First sample in [t_min, t_max] in a filled voxel, and the voxel's segment. Gives up after
  /// TileScene::kMaxTiles tiles.
  std::optional<FiberHit> first_hit(const Ray& ray) const;

  std::array<int, 3> size() const { return size_; }
  std::size_t memory_bytes() const;

 private:
  std::array<int, 3> size_{};    // voxels
  std::array<int, 3> bricks_{};  // bricks along each axis
  Vec3 origin_;                  // corner of voxel (0, 0, 0)
  Vec3 voxel_mm_;
  std::vector<std::uint32_t> brick_start_;  // [brick] offset into ids_, or kEmpty
  std::vector<std::int32_t> ids_;           // [brick][8][8][8]
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_ID_BRICKS_H_
