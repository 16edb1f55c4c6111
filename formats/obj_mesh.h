#ifndef HEDDLE_FORMATS_OBJ_MESH_H_
#define HEDDLE_FORMATS_OBJ_MESH_H_
// Wavefront OBJ as one indexed triangle mesh (polygons are fan-triangulated from their first
// corner), with what its faces were, the groups and objects that they belong to, and how sharp a
// subdivision surface shall keep an edge. OBJ has no line for that; Pixar's tags are read: "t
// crease 2/1/0 A B SHARPNESS" (any number of pairs, one sharpness or one for each) and "t corner
// 1/1/0 V SHARPNESS". They count vertices from 0, and 10 is as sharp as can be. Every index and
// number is checked after parsing; errors: FileError with file, and face or vertex number. Tested
// in tests/formats/obj_mesh_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace heddle {

/// An edge or a vertex that stays sharp. Vertices are named by their positions.
struct ObjSharpEdge {
  std::array<std::array<float, 3>, 2> ends;
  float sharpness;
  std::size_t line;  // of the file
};
struct ObjSharpVertex {
  std::array<float, 3> place;
  float sharpness;
};

/// Corners with equal (position, uv, normal) indices share a vertex.
struct ObjMesh {
  std::vector<std::array<float, 3>> positions;  // [vertex], in the file's unit
  // [vertex], or empty where the file has none
  std::vector<std::array<float, 2>> uvs;
  // [vertex], unit length, or empty where the file has none
  std::vector<std::array<float, 3>> normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // [triangle] vertex indices

  // [face] corners; its fan takes corners - 2 triangles, face after face
  std::vector<std::uint32_t> face_corners;
  std::vector<std::uint32_t> face_part;         // [face] index into parts
  std::vector<std::vector<std::string>> parts;  // names of groups and object; maybe none
  std::vector<ObjSharpEdge> sharp_edges;
  std::vector<ObjSharpVertex> sharp_vertices;
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

/// Names of all groups and objects that hold faces, sorted.
std::vector<std::string> group_names(const ObjMesh& mesh);

/// [triangle] Does it belong to the group or object of that name?
std::vector<std::uint8_t> triangles_of_group(const ObjMesh& mesh, const std::string& name);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_OBJ_MESH_H_
