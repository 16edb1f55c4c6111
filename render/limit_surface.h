#ifndef HEDDLE_RENDER_LIMIT_SURFACE_H_
#define HEDDLE_RENDER_LIMIT_SURFACE_H_
// The smooth surface that a mesh of polygons stands for: the limit of Catmull and Clark's
// subdivision (1978), or of Loop's (1987) where all faces are triangles, with the semi-sharp
// creases of DeRose et al. (1998), cut into triangles. OpenSubdiv evaluates it; this is the only
// place that includes it. Points and normals are those of the limit, at whatever number of pieces
// an edge is cut into, and neighbours share them. Fabric coordinates are subdivided by the same
// rules on their own topology, which ends at UV seams. So a boundary in UV follows the same curve
// as a boundary in space, and a sheet that bends without stretch keeps doing so. Beside
// extraordinary vertices and creases OpenSubdiv approximates the limit after 2 and 6 levels. Tested
// in tests/render/limit_surface_test.cpp.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "render/shell.h"

namespace heddle {

/// The polygons. Where fabric coordinates differ on both sides of an edge, its vertices have
/// several values.
struct ControlMesh {
  std::vector<Vec3d> positions;             // [vertex] mm
  std::vector<Eigen::Vector2d> fabric;      // [value] mm
  std::vector<std::uint32_t> value_owner;   // [value] the vertex that it belongs to
  std::vector<std::uint32_t> face_corners;  // [face] how many
  std::vector<std::uint32_t> values;        // [face][corner]; vertices of a face are distinct
  struct SharpEdge {
    std::uint32_t a, b;  // vertices that an edge joins
    float sharpness;     // 0 smooth, 10 infinitely sharp
  };
  struct SharpVertex {
    std::uint32_t vertex;
    float sharpness;
  };
  std::vector<SharpEdge> sharp_edges;
  std::vector<SharpVertex> sharp_vertices;
  // The corner of a sheet, a vertex of one face only, stays a corner. Boundaries are smooth curves
  // beside their corners, apart from what lies inside.
  bool sharp_corners = true;
  bool normals_against_winding = false;
  std::vector<std::uint8_t> is_shown;  // [face] empty: all; the others shape these
};

/// Into how many pieces is the edge between two vertices cut? At least 1.
using EdgePieces = std::function<int(const Vec3d& a, const Vec3d& b)>;

/// A mesh whose limit surface passes near the vertices of `mesh` instead of inside of them: each
/// round moves vertices by what the surface still lacks. Waves of four edges keep 96 % of their
/// height after 2 rounds (67 % before), the finest ones, of two edges, 70 % (33 % before), so noise
/// is not drawn in full. Fabric coordinates likewise. Errors: as limit_surface().
ControlMesh drawn_to_vertices(ControlMesh mesh, int rounds, const std::string& name);

/// Triangles that limit_surface() makes.
std::size_t limit_triangles(const ControlMesh& mesh, const EdgePieces& pieces);

/// Vertices at one place share their normal, the mean over its faces where those differ (creases).
/// The first vertices of the result are the values, in their order, that a shown face has.
/// Errors: FileError naming `name` (faces or vertices beyond OpenSubdiv's limits).
ClothMesh limit_surface(const ControlMesh& mesh, const EdgePieces& pieces, const std::string& name);

}  // namespace heddle

#endif  // HEDDLE_RENDER_LIMIT_SURFACE_H_
