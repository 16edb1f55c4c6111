#ifndef HEDDLE_FORMATS_OBJ_MESH_H_
#define HEDDLE_FORMATS_OBJ_MESH_H_
// Wavefront OBJ as one indexed triangle mesh (polygons are fan-triangulated from their first corner).
// Every index and number is checked after parsing; errors: FileError with file, and face or vertex number.
// Tested in tests/formats/obj_mesh_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace heddle {

/// Corners with equal (position, uv, normal) indices share a vertex.
struct ObjMesh {
  std::vector<std::array<float, 3>> positions;          // [vertex], in the file's unit
  std::vector<std::array<float, 2>> uvs;                // [vertex], or empty where the file has none
  std::vector<std::array<float, 3>> normals;            // [vertex], unit length, or empty where the file has none
  std::vector<std::array<std::uint32_t, 3>> triangles;  // [triangle] vertex indices
};

/// Limits: 50 million triangles. A file where only some faces have UVs (or normals) is refused.
ObjMesh read_obj(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_OBJ_MESH_H_
