#ifndef HEDDLE_RENDER_MESH_FILE_H_
#define HEDDLE_RENDER_MESH_FILE_H_
// The meshes that a scene names: read, subdivided, placed, and reduced to a group. Tested in
// tests/render/mesh_file_test.cpp.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "formats/toml_table.h"
#include "render/camera.h"
#include "render/limit_surface.h"
#include "render/shell.h"
#include "render/triangle_scene.h"

namespace heddle {

/// Where a piece stands: scaled about the origin, turned about the world's x, then y, then z, then
/// moved.
struct Placement {
  double scale = 1;
  Vec3d rotate = Vec3d::Zero();  // radians about x, y, z
  Vec3d translate_mm = Vec3d::Zero();

  bool is_identity() const { return scale == 1 && rotate.isZero(0) && translate_mm.isZero(0); }
  Mat3d rotation() const;
  Vec3d placed(const Vec3d& p) const {
    return is_identity() ? p : Vec3d(scale * (rotation() * p) + translate_mm);
  }
};

/// How the fabric lies on the UVs: turned about their origin, then moved; in millimetres of UVs.
struct FabricPlacement {
  Eigen::Vector2d tiling = {1, 1};  // factors of u and v
  double turn = 0;                  // radians, anticlockwise
  Eigen::Vector2d offset_mm = {0, 0};

  bool is_identity() const { return tiling.isOnes(0) && turn == 0 && offset_mm.isZero(0); }
  /// Fabric coordinates of a place of the UVs, both in millimetres.
  Eigen::Vector2d fabric_of(const Eigen::Vector2d& uv_mm) const;
  /// And back.
  Eigen::Vector2d uv_mm_of(const Eigen::Vector2d& fabric) const;
};

/// An OBJ file as a scene asks for it.
struct MeshFile {
  std::filesystem::path path;
  // of a sequence: one file per frame (numbered_file.h), of which `path` is one; else empty
  std::filesystem::path numbered;
  double mm_per_unit = 1;
  std::string group;      // name of a group or object; empty: all of the file
  std::string name = {};  // in mattes; empty: by its number. Of meshes only: cloths have their own
  // As a subdivision surface: 2^subdivide pieces of each edge, or so many that none of them is
  // longer than this in the pictures; neither: as it is.
  int subdivide = 0;
  std::optional<double> subdivide_px;
  bool sharp_corners = true;
  bool near_vertices = false;  // drawn_to_vertices()
  Placement placement;
  std::optional<TomlTable> table;  // that asked for it, for messages

  bool is_smooth() const { return subdivide > 0 || subdivide_px.has_value(); }
};

/// Longest edges on the fabric's plane, in pictures: pieces of an edge as seen by the cameras.
/// Outside of their frames pieces may be eight times as long.
EdgePieces pieces_in_pictures(std::span<const Camera> cameras, double most_pixels);

/// Errors: FileError (no UVs, no faces, what cannot be subdivided), ConfigError with its place (no
/// such group, too many triangles), MemoryError.
ClothMesh read_cloth_mesh(const MeshFile& file, double uv_size_mm, const FabricPlacement& fabric,
                          std::span<const Camera> cameras);

/// The same without a fabric.
TriangleMesh read_black_mesh(const MeshFile& file, std::span<const Camera> cameras);

/// The same of a coloured mesh: `fabric` is 0 throughout. Its normals are those of the surface
/// where it is subdivided, else those of the file. Where the file has none, a corner of a face has
/// the area-weighted mean of the faces about it that are bent by less than kSharpEdge from its own:
/// a ball is smooth, and a box has edges.
ClothMesh read_solid_mesh(const MeshFile& file, std::span<const Camera> cameras);
inline constexpr double kSharpEdge = 40 * kPi / 180;

/// The mesh where it stands.
ClothMesh placed(ClothMesh mesh, const Placement& placement);

/// The polygons of a file for subdivision, with vertices of equal position made one. `shown`: as of
/// cloth_mesh_of(). Errors: FileError naming `name` (a crease that is no edge).
ControlMesh control_mesh_of(const ObjMesh& obj, const std::string& name, double mm_per_unit,
                            double uv_size_mm, const std::vector<std::uint8_t>& shown = {});

}  // namespace heddle

#endif  // HEDDLE_RENDER_MESH_FILE_H_
