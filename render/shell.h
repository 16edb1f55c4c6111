#ifndef HEDDLE_RENDER_SHELL_H_
#define HEDDLE_RENDER_SHELL_H_
// The shell map: a cloth surface with UVs, thickened along its vertex normals into tetrahedra. Each
// has an affine map between world space and fabric space (Porumbescu et al. 2005; Khungurn 2017,
// section 5.1). The surface is the fabric's plane z = 0. World and fabric are in millimetres, in
// double: a fiber is 1e-5 of a drape.
//
// Every triangle's prism is cut into 3 tetrahedra. Their diagonals run from the bottom of the lower
// vertex index to the top of the higher one, so that neighbours agree. Triangle t owns the
// tetrahedra 3 t, 3 t + 1 and 3 t + 2. Vertex v of the surface becomes 2 v (bottom) and 2 v + 1
// (top).
//
// A ray walks from tetrahedron to tetrahedron. In the plane across the ray, signs of cross products
// decide by which face it leaves. They are computed once per edge, up to their sign, so the walk
// has no gaps. Every step can be undone, so it cannot loop. Through a flipped tetrahedron the walk
// goes backwards along the ray, and nothing is visible there. Tested in
// tests/render/shell_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fibers/math/vector.h"
#include "formats/obj_mesh.h"
#include "render/triangle_scene.h"

namespace heddle {

/// A surface of cloth in world space.
struct ClothMesh {
  std::vector<Vec3d> positions;                         // [vertex] mm
  std::vector<Vec3d> normals;                           // [vertex] unit, out of the face
  std::vector<Eigen::Vector2d> fabric;                  // [vertex] fabric x, y, mm
  std::vector<std::array<std::uint32_t, 3>> triangles;  // [triangle]
};

/// Vertices with equal position and UV become one; at a UV seam they stay apart (an open rim) and
/// share their normal. Normals are the file's, averaged per position, or area-weighted face normals
/// where the file has none. `shown`: [triangle] of those that become cloth, all where it is empty;
/// normals are those of the whole. Errors: FileError naming `name` (no UVs, no triangles).
ClothMesh cloth_mesh_of(const ObjMesh& obj, const std::string& name, double mm_per_unit,
                        double uv_size_mm, const std::vector<std::uint8_t>& shown = {});

/// Errors: FileError naming `name` where the mesh has no faces or no UVs.
void require_uvs(const ObjMesh& obj, const std::string& name);

/// The mesh without the vertices that no triangle has.
ClothMesh without_unused_vertices(ClothMesh mesh);

/// A flat swatch centred on the origin in which fabric space is world space, of cells * cells
/// rectangles.
ClothMesh flat_cloth(double width_mm, double height_mm, std::uint32_t cells = 1);

/// One straight piece of a ray inside one tetrahedron.
struct ShellInterval {
  std::uint32_t tet;
  double t0, t1;           // along the ray, mm
  Vec3d fabric0, fabric1;  // fabric-space ends
};

enum class ClothSide : std::uint8_t { kFace, kBack };

class Shell {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  struct Tet {
    std::array<std::uint32_t, 4> vertex;
    std::array<std::uint32_t, 4>
        neighbour;  // across the face opposite each vertex: 4 * tet + that face there, or kNone
  };

  struct Options {
    double thickness = 1;  // of the shell in the world, relative to the fabric's
    // Where a fold is tighter than the cloth is thick, its inner side is drawn towards the surface
    // until no tetrahedron is flipped.
    bool thin_tight_folds = false;
  };
  Shell(const ClothMesh& mesh, double z_min, double z_max, const Options& options);
  Shell(const ClothMesh& mesh, double z_min, double z_max) : Shell(mesh, z_min, z_max, {}) {}

  const std::vector<Tet>& tets() const { return tets_; }
  std::size_t triangle_count() const { return tets_.size() / 3; }
  const Vec3d& world(std::uint32_t vertex) const { return world_[vertex]; }
  const Vec3d& fabric(std::uint32_t vertex) const { return fabric_[vertex]; }
  double z_min() const { return z_min_; }
  double z_max() const { return z_max_; }

  /// Tetrahedra turned inside out by folds tighter than the thickness; those without volume in
  /// either space.
  std::uint32_t flipped_count() const { return flipped_count_; }
  std::uint32_t degenerate_count() const { return degenerate_count_; }
  /// Vertices of either side that were drawn towards the surface.
  std::uint32_t thinned_count() const { return thinned_count_; }

  /// Outer faces (top, bottom, rims): [face] 4 * tet + face, in the order of boundary_mesh()'s
  /// triangles.
  const std::vector<std::uint32_t>& boundary_faces() const { return boundary_faces_; }
  TriangleMesh boundary_mesh() const;
  /// The underside, moved `gap_mm` further out.
  TriangleMesh underside_mesh(double gap_mm) const;

  /// Linear parts of the maps of one tetrahedron; zero where it is degenerate.
  const Mat3& world_from_fabric(std::uint32_t tet) const { return maps_[tet].world_from_fabric; }
  const Mat3& fabric_from_world(std::uint32_t tet) const { return maps_[tet].fabric_from_world; }

  /// The triangle that holds a fabric position, searched across edges from `triangle` on; nothing
  /// beyond a rim.
  std::optional<std::uint32_t> find_triangle(std::uint32_t triangle,
                                             const Eigen::Vector2d& fabric_xy) const;

  /// World position on the shell's top (kFace) or bottom (kBack) over a fabric position in
  /// `triangle`; the normal points out of the shell.
  struct SurfacePoint {
    Vec3d position;
    Vec3d normal;
  };
  SurfacePoint surface_point(std::uint32_t triangle, const Eigen::Vector2d& fabric_xy,
                             ClothSide side) const;

  enum class WalkEnd : std::uint8_t { kStopped, kLeft, kFailed };

  /// Visits the intervals of the ray origin + t direction (unit) inward from boundary face `face`
  /// (an index into boundary_faces); visit(interval) returns true to stop. A face that the ray
  /// leaves by gives kLeft at once. A ray that misses the face by rounding is moved onto it.
  template <class Visit>
  WalkEnd walk_from_face(const Vec3d& origin, const Vec3d& direction, std::uint32_t face,
                         Visit&& visit) const;

  /// The same from a point inside `tet`, whose fabric position the caller knows.
  template <class Visit>
  WalkEnd walk_from_inside(const Vec3d& origin, const Vec3d& direction, std::uint32_t tet,
                           const Vec3d& fabric_origin, Visit&& visit) const;

  /// Vertices of the face opposite vertex `face`, anticlockwise seen from outside.
  std::array<std::uint32_t, 3> face_vertices(std::uint32_t tet, std::uint32_t face) const {
    const std::array<std::uint32_t, 4>& v = tets_[tet].vertex;
    switch (face) {
      case 0:
        return {v[1], v[2], v[3]};
      case 1:
        return {v[0], v[3], v[2]};
      case 2:
        return {v[0], v[1], v[3]};
      default:
        return {v[0], v[2], v[1]};
    }
  }

 private:
  struct Maps {
    Mat3 world_from_fabric;
    Mat3 fabric_from_world;
  };
  // A vertex seen along the ray: x, y across it, z along it, relative to the origin.
  struct Seen {
    std::uint32_t vertex;
    double x, y, z;
  };
  // The frame of one ray; shift moves the ray sideways.
  struct RayFrame {
    Vec3d origin, across, above, direction;
    double shift_x = 0, shift_y = 0;
  };
  // A face with the ray through it, anticlockwise looking along the ray, and where the ray crosses
  // it.
  struct Crossed {
    std::array<Seen, 3> corner;
    double t;
    Vec3d fabric;
  };

  // The constructor's steps: three tetrahedra for each triangle; none of them flipped; their maps;
  // what lies behind their faces; what lies behind the edges of the triangles.
  void cut_prisms();
  void thin_tight_folds(const ClothMesh& mesh, double thickness);
  void map_tets();
  void connect_tets();
  void connect_triangles();

  // Barycentric coordinates of a fabric position in a triangle; not finite where that has no area.
  Vec3d weights_in(std::uint32_t triangle, const Eigen::Vector2d& fabric_xy) const;
  static RayFrame ray_frame(const Vec3d& origin, const Vec3d& direction);
  Seen see(const RayFrame& frame, std::uint32_t vertex) const {
    const Vec3d offset = world_[vertex] - frame.origin;
    return {vertex, offset.dot(frame.across) - frame.shift_x,
            offset.dot(frame.above) - frame.shift_y, offset.dot(frame.direction)};
  }
  // Twice the area of the triangle (ray, a, b); exactly antisymmetric.
  static double area(const Seen& a, const Seen& b) { return a.x * b.y - a.y * b.x; }
  // Does the ray pass to the left of the edge from a to b? Never both for an edge and its reverse.
  static bool is_left(const Seen& a, const Seen& b) {
    const double value = area(a, b);
    return value > 0 || (value == 0 && a.vertex < b.vertex);
  }
  static bool contains_ray(const std::array<Seen, 3>& c) {
    return is_left(c[0], c[1]) && is_left(c[1], c[2]) && is_left(c[2], c[0]);
  }
  // Moves the ray to the point of the face nearest in barycentric terms; false where the face has
  // no area.
  static bool move_onto(RayFrame& frame, std::array<Seen, 3>& corner);
  Crossed cross(const std::array<Seen, 3>& corner) const;
  template <class Visit>
  WalkEnd walk(const RayFrame& frame, Crossed entry, std::uint32_t next, Visit&& visit) const;

  std::vector<Vec3d> world_;    // [2 * surface vertex]
  std::vector<Vec3d> fabric_;   // [2 * surface vertex]
  std::vector<Vec3d> normals_;  // [surface vertex]
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::array<std::uint32_t, 3>>
      triangle_neighbours_;  // [triangle] across the edge opposite each corner
  std::vector<Tet> tets_;
  std::vector<Maps> maps_;
  std::vector<std::uint8_t> is_hidden_;  // [tet] flipped or degenerate
  std::vector<std::uint32_t> boundary_faces_;
  double z_min_;
  double z_max_;
  std::uint32_t flipped_count_ = 0;
  std::uint32_t degenerate_count_ = 0;
  std::uint32_t thinned_count_ = 0;
};

inline Shell::Crossed Shell::cross(const std::array<Seen, 3>& c) const {
  // Barycentric weights; not negative, except by the rounding of an exact zero.
  std::array<double, 3> weight = {area(c[1], c[2]), area(c[2], c[0]), area(c[0], c[1])};
  const double sum = weight[0] + weight[1] + weight[2];
  for (double& w : weight) w = sum > 0 ? w / sum : 1.0 / 3.0;
  return {c, weight[0] * c[0].z + weight[1] * c[1].z + weight[2] * c[2].z,
          weight[0] * fabric_[c[0].vertex] + weight[1] * fabric_[c[1].vertex] +
              weight[2] * fabric_[c[2].vertex]};
}

template <class Visit>
Shell::WalkEnd Shell::walk(const RayFrame& frame, Crossed entry, std::uint32_t next,
                           Visit&& visit) const {
  // A walk crosses a face at most once in each sense.
  for (std::size_t step = 0; step <= 8 * tets_.size(); ++step) {
    if (next == kNone) return WalkEnd::kLeft;
    const std::uint32_t tet = next / 4;
    const Tet& here = tets_[tet];
    const std::array<Seen, 3>& c = entry.corner;
    const Seen apex = see(frame, here.vertex[next % 4]);
    const bool left0 = is_left(c[0], apex);
    const bool left1 = is_left(c[1], apex);
    const bool left2 = is_left(c[2], apex);
    // The corner that the exit face does without.
    int dropped = 0;
    if (left1 && !left0) {
      dropped = 2;
    } else if (left2 && !left1) {
      dropped = 0;
    } else if (left0 && !left2) {
      dropped = 1;
    } else {
      return WalkEnd::kFailed;
    }
    std::array<Seen, 3> corner = c;
    corner[static_cast<std::size_t>(dropped)] = apex;
    const Crossed exit = cross(corner);
    if (!is_hidden_[tet] && exit.t > entry.t &&
        visit(ShellInterval{tet, entry.t, exit.t, entry.fabric, exit.fabric})) {
      return WalkEnd::kStopped;
    }
    const std::uint32_t gone = c[static_cast<std::size_t>(dropped)].vertex;
    std::size_t face = 0;
    while (here.vertex[face] != gone) ++face;
    next = here.neighbour[face];
    entry = exit;
  }
  return WalkEnd::kFailed;
}

template <class Visit>
Shell::WalkEnd Shell::walk_from_face(const Vec3d& origin, const Vec3d& direction,
                                     std::uint32_t face, Visit&& visit) const {
  RayFrame frame = ray_frame(origin, direction);
  const std::uint32_t id = boundary_faces_[face];
  const std::array<std::uint32_t, 3> outward = face_vertices(id / 4, id % 4);
  std::array<Seen, 3> corner = {see(frame, outward[0]), see(frame, outward[2]),
                                see(frame, outward[1])};
  if (!(area(corner[0], corner[1]) + area(corner[1], corner[2]) + area(corner[2], corner[0]) > 0)) {
    return WalkEnd::kLeft;
  }
  if (!contains_ray(corner) && !move_onto(frame, corner)) return WalkEnd::kFailed;
  return walk(frame, cross(corner), id, visit);
}

template <class Visit>
Shell::WalkEnd Shell::walk_from_inside(const Vec3d& origin, const Vec3d& direction,
                                       std::uint32_t tet, const Vec3d& fabric_origin,
                                       Visit&& visit) const {
  RayFrame frame = ray_frame(origin, direction);
  const Tet& here = tets_[tet];
  std::array<Seen, 4> seen;
  for (std::size_t k = 0; k < 4; ++k) seen[k] = see(frame, here.vertex[k]);
  // Outward faces as in face_vertices().
  const std::array<std::array<Seen, 3>, 4> faces = {{{seen[1], seen[2], seen[3]},
                                                     {seen[0], seen[3], seen[2]},
                                                     {seen[0], seen[1], seen[3]},
                                                     {seen[0], seen[2], seen[1]}}};
  std::size_t exit_face = 4;
  for (std::size_t k = 0; k < 4 && exit_face == 4; ++k) {
    if (contains_ray(faces[k])) exit_face = k;
  }
  if (exit_face == 4) return WalkEnd::kFailed;
  const Crossed exit = cross(faces[exit_face]);
  if (exit.t > 0 && visit(ShellInterval{tet, 0.0, exit.t, fabric_origin, exit.fabric}))
    return WalkEnd::kStopped;
  return walk(frame, exit, here.neighbour[exit_face], visit);
}

}  // namespace heddle

#endif  // HEDDLE_RENDER_SHELL_H_
