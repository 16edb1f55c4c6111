#ifndef HEDDLE_FORMATS_OBJ_MESH_H_
#define HEDDLE_FORMATS_OBJ_MESH_H_
// Wavefront OBJ as one indexed triangle mesh (polygons are fan-triangulated from their first
// corner). Every index and number is checked after parsing; errors: FileError with file, and face
// or vertex number. Tested in tests/formats/obj_mesh_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace heddle {

/// Corners with equal (position, uv, normal) indices share a vertex.
struct ObjMesh {
  std::vector<std::array<float, 3>> positions;  // [vertex], in the file's unit
  // [vertex], or empty where the file has none
  std::vector<std::array<float, 2>> uvs;
  // [vertex], unit length, or empty where the file has none
  std::vector<std::array<float, 3>> normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // [triangle] vertex indices
};

/// What the file's numbers mean in millimetres; 0 if that is not known.
struct ObjUnits {
  double mm_per_unit = 0;  // of positions
  double mm_per_uv = 0;    // of texture coordinates, on flat cloth
};

/// Coordinates in millimetres reach as far as a camera may be moved. At 1 km a float resolves
/// places 0.06 mm apart. From 1e19 mm on, squares of lengths overflow, and Embree aborts.
inline constexpr double kMaxCoordinateMm = 1e6;

/// Limits: 50 million triangles; coordinates whose unit is known, kMaxCoordinateMm either way. A
/// file in which only some faces have UVs (or normals) is refused.
ObjMesh read_obj(const std::filesystem::path& path, const ObjUnits& units = {});

}  // namespace heddle

#endif  // HEDDLE_FORMATS_OBJ_MESH_H_
