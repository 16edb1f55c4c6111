#ifndef HEDDLE_FIBERS_CLOTH_EXEMPLAR_H_
#define HEDDLE_FIBERS_CLOTH_EXEMPLAR_H_
// The exemplar: explicit fibers of one fabric tile, in millimetres. The tile is periodic in x (weft
// direction) and y (warp direction). z = 0 is the middle plane, and +z points out of the face.
//
// A fiber is a polyline of straight round segments. The last point of a fiber that goes on is its
// first point shifted by one period, so the curve runs through every copy of the tile under one id.
// An open fiber, such as a hair, starts and ends within its tile.
// Invariants, checked by validate_exemplar():
//   1. first_point is ascending, starts at 0, ends at points.size(), and every fiber has at least 2
//      segments;
//   2. the tile is at most 10 m wide and high; points lie within one tile around it and 1 m of its
//      plane; radii are at least 1 nm and below half the tile;
//   3. the last point of a fiber that is not open is its first point shifted by (width, 0, 0) or
//      (0, height, 0), in either sense;
//   4. no segment is shorter than a thousandth of its radius;
//   5. materials are below material_count, and those are at most 64;
//   6. colours lie within [0, 1], deviations of lobes between 0.01 degrees and 90 (azimuth: 360).
// Tested in tests/fibers/cloth/exemplar_test.cpp.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/scattering/fiber_bcsdf.h"

namespace heddle {

/// Id that belongs to no fiber.
inline constexpr std::uint32_t kNoFiber = 0xffffffffU;

inline constexpr float kMaxTileMm = 1e4F;
/// Each takes 0.1 s and some memory when a pack is opened.
inline constexpr std::size_t kMaxMaterials = 64;

struct Exemplar {
  float width_mm = 0;   // period along x
  float height_mm = 0;  // period along y
  // [fiber + 1]  fiber f owns points first_point[f] .. first_point[f + 1] - 1
  std::vector<std::uint32_t> first_point;
  std::vector<Vec3> points;             // [point] millimetres
  std::vector<float> radius_mm;         // [fiber]
  std::vector<std::uint16_t> material;  // [fiber] index into `scattering`
  // [fiber] which yarn of the tile it belongs to; index_segments() takes yarn 0 where none is told
  std::vector<std::uint32_t> yarn;
  // [fiber] 1: it ends within the tile; index_segments() takes 0 where it is not told
  std::vector<std::uint8_t> is_open;
  std::vector<FiberScattering> scattering;  // [material]

  // Derived by index_segments(): segment s runs from points[segment_point[s]] to the next point.
  std::vector<std::uint32_t> segment_point;  // [segment]
  std::vector<std::uint32_t> segment_fiber;  // [segment]
  float z_min = 0;                           // lowest and highest point of any fiber surface
  float z_max = 0;

  std::size_t fiber_count() const { return radius_mm.size(); }
  std::size_t segment_count() const { return segment_point.size(); }
  Vec3 segment_midpoint(std::uint32_t s) const {
    return 0.5F * (points[segment_point[s]] + points[segment_point[s] + 1]);
  }
  /// Unit tangent of segment s.
  Vec3 segment_tangent(std::uint32_t s) const {
    return (points[segment_point[s] + 1] - points[segment_point[s]]).normalized();
  }
  std::uint16_t segment_material(std::uint32_t s) const { return material[segment_fiber[s]]; }
};

/// Makes a fiber of the points that were appended since the last one.
void end_fiber(Exemplar& exemplar, double radius_mm, int material, std::uint32_t yarn,
               bool is_open);

/// Fills the derived arrays from the others, and `yarn` and `is_open` where they are shorter than
/// the list of fibers.
void index_segments(Exemplar& exemplar);

/// Throws FileError with the number of the first broken invariant. `name` is the file named in the
/// message.
void validate_exemplar(const Exemplar& exemplar, const std::string& name);

/// The fibers artifact (tensor file); layout in fibers/README.md.
void write_exemplar(const std::filesystem::path& path, const Exemplar& exemplar,
                    const std::map<std::string, std::string>& metadata);
Exemplar read_exemplar(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_EXEMPLAR_H_
