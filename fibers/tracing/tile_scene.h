#ifndef HEDDLE_FIBERS_TRACING_TILE_SCENE_H_
#define HEDDLE_FIBERS_TRACING_TILE_SCENE_H_
// Ray queries on the exemplar tile, repeated without end and without seams. Embree holds the round
// curves of one tile, with what reaches in from its neighbours. A ray marches from tile to tile
// until it hits, leaves the thickness, or reaches t_max. Fabric space, millimetres. Ray directions
// need not have unit length (t is in units of the direction). This is the only place that includes
// Embree for fibers. Tested in tests/fibers/tracing/tile_scene_test.cpp.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "fibers/cloth/exemplar.h"
#include "fibers/math/vector.h"

namespace heddle {

struct Ray {
  Vec3 origin;
  Vec3 direction;
  float t_min = 0;
  float t_max = std::numeric_limits<float>::infinity();
};

struct FiberHit {
  float t;
  std::uint32_t segment;
};

class TileScene {
 public:
  /// Builds in one thread, so that the tree (and thus every tie) never depends on the machine's
  /// load.
  explicit TileScene(Exemplar exemplar);
  ~TileScene();
  TileScene(const TileScene&) = delete;
  TileScene& operator=(const TileScene&) = delete;

  const Exemplar& exemplar() const { return exemplar_; }

  /// First hit in [t_min, t_max], ignoring `own_fiber` in every copy of the tile (kNoFiber ignores
  /// none). A ray that starts inside another fiber hits that fiber's surface from inside.
  std::optional<FiberHit> intersect(const Ray& ray, std::uint32_t own_fiber) const;
  bool occluded(const Ray& ray, std::uint32_t own_fiber) const;

  /// Rays that were given up after kMaxTiles tiles (counted as not hit); a stage reports it when it
  /// is not 0.
  static constexpr int kMaxTiles = 4096;
  std::uint64_t abandoned_rays() const;

  /// Mean distance (mm) to the next fiber, own fiber ignored, over the rays that hit. `samples`
  /// rays start at random points of random segments (chosen by length) in uniform directions.
  double mean_free_path(std::uint64_t seed, int samples) const;

  /// Bytes of the ray-tracing structure.
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  template <bool kAnyHit>
  bool march(const Ray& ray, std::uint32_t own_fiber, FiberHit* hit) const;
  Exemplar exemplar_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_TILE_SCENE_H_
