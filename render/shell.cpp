#include "render/shell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "formats/input_error.h"

namespace heddle {

namespace {

Vec3d vec3d(const std::array<float, 3>& v) {
  return {v[0], v[1], v[2]};
}

// A tetrahedron whose volume is below this share of its longest edge's cube has no usable map.
constexpr double kDegenerate = 1e-12;

Mat3d edges(const std::vector<Vec3d>& points, const std::array<std::uint32_t, 4>& v) {
  Mat3d matrix;
  for (int k = 0; k < 3; ++k)
    matrix.col(k) = points[v[static_cast<std::size_t>(k + 1)]] - points[v[0]];
  return matrix;
}

bool is_degenerate(const Mat3d& edges) {
  const double longest = std::sqrt(edges.colwise().squaredNorm().maxCoeff());
  return !(std::abs(edges.determinant()) > kDegenerate * longest * longest * longest);
}

}  // namespace

void require_uvs(const ObjMesh& obj, const std::string& name) {
  if (obj.triangles.empty()) throw FileError(name + ": the mesh has no faces");
  if (obj.uvs.empty()) throw FileError(name + ": cloth needs UVs, but the mesh has none");
}

ClothMesh cloth_mesh_of(const ObjMesh& obj, const std::string& name, double mm_per_unit,
                        double uv_size_mm, const std::vector<std::uint8_t>& shown) {
  require_uvs(obj, name);
  ClothMesh mesh;
  // Normals are shared by all vertices at one position, so that the shell has no cracks at UV
  // seams.
  std::map<std::array<float, 3>, Vec3d> normal_at;
  std::map<std::array<float, 5>, std::uint32_t> welded;
  std::vector<std::uint32_t> index(obj.positions.size());
  std::vector<std::array<float, 3>> position_of;  // [welded vertex]
  for (std::size_t v = 0; v < obj.positions.size(); ++v) {
    const std::array<float, 3>& p = obj.positions[v];
    const std::array<float, 2>& uv = obj.uvs[v];
    const auto [place, is_new] = welded.try_emplace({p[0], p[1], p[2], uv[0], uv[1]},
                                                    static_cast<std::uint32_t>(position_of.size()));
    index[v] = place->second;
    if (is_new) {
      position_of.push_back(p);
      mesh.positions.push_back(mm_per_unit * vec3d(p));
      mesh.fabric.push_back(uv_size_mm * Eigen::Vector2d(uv[0], uv[1]));
    }
    Vec3d& normal = normal_at.try_emplace(p, Vec3d::Zero()).first->second;
    if (!obj.normals.empty()) normal += vec3d(obj.normals[v]);
  }
  for (std::size_t k = 0; k < obj.triangles.size(); ++k) {
    const std::array<std::uint32_t, 3>& t = obj.triangles[k];
    const std::array<std::uint32_t, 3> triangle = {index[t[0]], index[t[1]], index[t[2]]};
    // A triangle that welding folded into an edge covers nothing.
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0])
      continue;
    if (shown.empty() || shown[k] != 0) mesh.triangles.push_back(triangle);
    if (!obj.normals.empty()) continue;
    const Vec3d& a = mesh.positions[triangle[0]];
    const Vec3d doubled_area =
        (mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a);
    for (const std::uint32_t v : triangle) normal_at[position_of[v]] += doubled_area;
  }
  for (const std::array<float, 3>& p : position_of) {
    const Vec3d& normal = normal_at[p];
    mesh.normals.push_back(normal.norm() > 0 ? Vec3d(normal.normalized()) : Vec3d(0, 0, 1));
  }
  if (shown.empty()) return mesh;
  return without_unused_vertices(std::move(mesh));
}

ClothMesh without_unused_vertices(ClothMesh mesh) {
  ClothMesh result;
  std::vector<std::uint32_t> index(mesh.positions.size(), Shell::kNone);
  for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) index[v] = 0;
  }
  for (std::size_t v = 0; v < index.size(); ++v) {
    if (index[v] == Shell::kNone) continue;
    index[v] = static_cast<std::uint32_t>(result.positions.size());
    result.positions.push_back(mesh.positions[v]);
    result.normals.push_back(mesh.normals[v]);
    result.fabric.push_back(mesh.fabric[v]);
  }
  for (std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
    for (std::uint32_t& v : triangle) v = index[v];
  }
  result.triangles = std::move(mesh.triangles);
  return result;
}

ClothMesh flat_cloth(double width_mm, double height_mm, std::uint32_t cells) {
  ClothMesh mesh;
  for (std::uint32_t row = 0; row <= cells; ++row) {
    for (std::uint32_t column = 0; column <= cells; ++column) {
      const double x = (static_cast<double>(column) / cells - 0.5) * width_mm;
      const double y = (static_cast<double>(row) / cells - 0.5) * height_mm;
      mesh.positions.emplace_back(x, y, 0);
      mesh.normals.emplace_back(0, 0, 1);
      mesh.fabric.emplace_back(x, y);
      if (row == cells || column == cells) continue;
      const std::uint32_t below = row * (cells + 1) + column;
      const std::uint32_t above = below + cells + 1;
      mesh.triangles.push_back({below, below + 1, above + 1});
      mesh.triangles.push_back({below, above + 1, above});
    }
  }
  return mesh;
}

Shell::Shell(const ClothMesh& mesh, double z_min, double z_max, const Options& options)
    : normals_(mesh.normals), triangles_(mesh.triangles), z_min_(z_min), z_max_(z_max) {
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    for (const double z : {z_min, z_max}) {
      world_.push_back(mesh.positions[v] + options.thickness * z * mesh.normals[v]);
      fabric_.emplace_back(mesh.fabric[v].x(), mesh.fabric[v].y(), z);
    }
  }
  cut_prisms();
  if (options.thin_tight_folds) thin_tight_folds(mesh, options.thickness);
  map_tets();
  connect_tets();
  connect_triangles();
}

void Shell::cut_prisms() {
  double volume = 0;
  for (std::array<std::uint32_t, 3> t : triangles_) {
    // Vertices in ascending order; is_odd where that reverses the triangle's winding.
    bool is_odd = false;
    for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{0, 1}}) {
      if (t[static_cast<std::size_t>(i)] > t[static_cast<std::size_t>(j)]) {
        std::swap(t[static_cast<std::size_t>(i)], t[static_cast<std::size_t>(j)]);
        is_odd = !is_odd;
      }
    }
    const std::uint32_t a = 2 * t[0];
    const std::uint32_t b = 2 * t[1];
    const std::uint32_t c = 2 * t[2];
    for (std::array<std::uint32_t, 4> v :
         {std::array{a, b, c, c + 1}, std::array{a, b + 1, b, c + 1},
          std::array{a, a + 1, b + 1, c + 1}}) {
      if (is_odd) std::swap(v[2], v[3]);
      tets_.push_back({v, {kNone, kNone, kNone, kNone}});
      volume += edges(world_, v).determinant();
    }
  }
  // Faces are wound against the normals throughout: turn all tetrahedra instead of calling all of
  // them flipped.
  if (volume < 0) {
    for (Tet& tet : tets_) std::swap(tet.vertex[2], tet.vertex[3]);
  }
}

void Shell::thin_tight_folds(const ClothMesh& mesh, double thickness) {
  constexpr int kRounds = 60;
  constexpr double kThinner = 0.85;  // in each round
  const auto is_flipped = [&](const Tet& tet) {
    return edges(world_, tet.vertex).determinant() < 0;
  };
  if (std::none_of(tets_.begin(), tets_.end(), is_flipped)) return;
  // Vertices on both sides of a UV seam stay together: [surface vertex] the first at its place.
  std::vector<std::uint32_t> first(mesh.positions.size());
  std::map<std::array<double, 3>, std::uint32_t> first_at;
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    const Vec3d& p = mesh.positions[v];
    first[v] = first_at.try_emplace({p.x(), p.y(), p.z()}, v).first->second;
  }
  std::vector<double> share(2 * first.size(), 1);  // [vertex of the shell]
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::uint8_t> is_too_thick(share.size(), 0);
    bool any = false;
    for (std::uint32_t tet = 0; tet < tets_.size(); ++tet) {
      if (!is_flipped(tets_[tet])) continue;
      any = true;
      const std::array<std::uint32_t, 3>& t = triangles_[tet / 3];
      const Vec3d middle = (mesh.positions[t[1]] - mesh.positions[t[0]])
                               .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
      std::array<double, 2> left_over;  // of the triangle's area on each side
      for (std::uint32_t side = 0; side < 2; ++side) {
        const Vec3d& corner = world_[2 * t[0] + side];
        left_over[side] =
            middle.dot((world_[2 * t[1] + side] - corner).cross(world_[2 * t[2] + side] - corner));
      }
      const std::uint32_t inner = left_over[0] < left_over[1] ? 0 : 1;
      for (const std::uint32_t v : t) is_too_thick[2 * first[v] + inner] = 1;
    }
    if (!any) break;
    for (std::uint32_t v = 0; v < share.size(); ++v) {
      if (is_too_thick[2 * first[v / 2] + v % 2] == 0) continue;
      share[v] *= kThinner;
      const double z = v % 2 == 0 ? z_min_ : z_max_;
      world_[v] = mesh.positions[v / 2] + share[v] * thickness * z * mesh.normals[v / 2];
    }
  }
  thinned_count_ = static_cast<std::uint32_t>(
      std::count_if(share.begin(), share.end(), [](double s) { return s < 1; }));
}

void Shell::map_tets() {
  for (const Tet& tet : tets_) {
    const Mat3d world = edges(world_, tet.vertex);
    const Mat3d fabric = edges(fabric_, tet.vertex);
    Maps maps = {Mat3::Zero(), Mat3::Zero()};
    const bool degenerate = is_degenerate(world) || is_degenerate(fabric);
    const bool flipped = !degenerate && world.determinant() < 0;
    if (!degenerate) {
      maps.world_from_fabric = (world * fabric.inverse()).cast<float>();
      maps.fabric_from_world = (fabric * world.inverse()).cast<float>();
    }
    maps_.push_back(maps);
    is_hidden_.push_back(degenerate || flipped ? 1 : 0);
    degenerate_count_ += degenerate ? 1 : 0;
    flipped_count_ += flipped ? 1 : 0;
  }
}

void Shell::connect_tets() {
  // Faces with the same three vertices belong together; where not exactly two meet, the shell is
  // open.
  struct Face {
    std::array<std::uint32_t, 3> vertices;
    std::uint32_t id;
  };
  std::vector<Face> faces;
  for (std::uint32_t tet = 0; tet < tets_.size(); ++tet) {
    for (std::uint32_t face = 0; face < 4; ++face) {
      std::array<std::uint32_t, 3> vertices = face_vertices(tet, face);
      std::sort(vertices.begin(), vertices.end());
      faces.push_back({vertices, 4 * tet + face});
    }
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return a.vertices != b.vertices ? a.vertices < b.vertices : a.id < b.id;
  });
  for (std::size_t first = 0; first < faces.size();) {
    std::size_t last = first + 1;
    while (last < faces.size() && faces[last].vertices == faces[first].vertices) ++last;
    if (last - first == 2) {
      const std::uint32_t a = faces[first].id;
      const std::uint32_t b = faces[first + 1].id;
      tets_[a / 4].neighbour[a % 4] = b;
      tets_[b / 4].neighbour[b % 4] = a;
    } else {
      for (std::size_t k = first; k < last; ++k) boundary_faces_.push_back(faces[k].id);
    }
    first = last;
  }
  std::sort(boundary_faces_.begin(), boundary_faces_.end());
}

void Shell::connect_triangles() {
  struct Side {
    std::array<std::uint32_t, 2> edge;
    std::uint32_t triangle;
    std::uint32_t corner;  // opposite the edge
  };
  std::vector<Side> sides;
  triangle_neighbours_.assign(triangles_.size(), {kNone, kNone, kNone});
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (std::uint32_t corner = 0; corner < 3; ++corner) {
      const auto [low, high] =
          std::minmax({triangles_[t][(corner + 1) % 3], triangles_[t][(corner + 2) % 3]});
      sides.push_back({{low, high}, t, corner});
    }
  }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.edge < b.edge; });
  for (std::size_t first = 0; first < sides.size();) {
    std::size_t last = first + 1;
    while (last < sides.size() && sides[last].edge == sides[first].edge) ++last;
    if (last - first == 2) {
      const Side& a = sides[first];
      const Side& b = sides[first + 1];
      triangle_neighbours_[a.triangle][a.corner] = b.triangle;
      triangle_neighbours_[b.triangle][b.corner] = a.triangle;
    }
    first = last;
  }
}

TriangleMesh Shell::boundary_mesh() const {
  TriangleMesh mesh;
  for (const Vec3d& p : world_) mesh.positions.push_back(p.cast<float>());
  for (const std::uint32_t id : boundary_faces_)
    mesh.triangles.push_back(face_vertices(id / 4, id % 4));
  return mesh;
}

TriangleMesh Shell::underside_mesh(double gap_mm) const {
  TriangleMesh mesh;
  for (std::size_t v = 0; v < normals_.size(); ++v) {
    mesh.positions.push_back((world_[2 * v] - gap_mm * normals_[v]).cast<float>());
  }
  mesh.triangles = triangles_;
  return mesh;
}

Vec3d Shell::weights_in(std::uint32_t triangle, const Eigen::Vector2d& p) const {
  const auto area = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  const std::array<std::uint32_t, 3>& v = triangles_[triangle];
  const Eigen::Vector2d a = fabric_[2 * v[0]].head<2>();
  const Eigen::Vector2d b = fabric_[2 * v[1]].head<2>();
  const Eigen::Vector2d c = fabric_[2 * v[2]].head<2>();
  return Vec3d(area(b - p, c - p), area(c - p, a - p), area(a - p, b - p)) / area(b - a, c - a);
}

std::optional<std::uint32_t> Shell::find_triangle(std::uint32_t triangle,
                                                  const Eigen::Vector2d& fabric_xy) const {
  // Each step crosses the edge that the point lies furthest behind, so the walk is short. Folded
  // UVs could make it circle, so it is capped.
  constexpr int kMaxSteps = 4096;
  for (int step = 0; step < kMaxSteps && triangle != kNone; ++step) {
    const Vec3d weights = weights_in(triangle, fabric_xy);
    if (!weights.allFinite()) return {};
    Vec3d::Index behind = 0;
    // A point on an edge belongs to either side.
    if (weights.minCoeff(&behind) >= -1e-9) return triangle;
    triangle = triangle_neighbours_[triangle][static_cast<std::size_t>(behind)];
  }
  return {};
}

Shell::SurfacePoint Shell::surface_point(std::uint32_t triangle, const Eigen::Vector2d& fabric_xy,
                                         ClothSide side) const {
  const Vec3d weights = weights_in(triangle, fabric_xy);
  const std::array<std::uint32_t, 3>& v = triangles_[triangle];
  const std::uint32_t top = side == ClothSide::kFace ? 1 : 0;
  SurfacePoint point = {Vec3d::Zero(), Vec3d::Zero()};
  for (int k = 0; k < 3; ++k) {
    point.position += weights[k] * world_[2 * v[static_cast<std::size_t>(k)] + top];
    point.normal += weights[k] * normals_[v[static_cast<std::size_t>(k)]];
  }
  point.normal = (side == ClothSide::kFace ? point.normal : Vec3d(-point.normal)).normalized();
  return point;
}

Shell::RayFrame Shell::ray_frame(const Vec3d& origin, const Vec3d& direction) {
  RayFrame frame;
  frame.origin = origin;
  frame.direction = direction;
  frame.across = direction.unitOrthogonal();
  frame.above = direction.cross(frame.across);
  return frame;
}

bool Shell::move_onto(RayFrame& frame, std::array<Seen, 3>& corner) {
  // Far enough from the edge to survive rounding, near enough to be invisible.
  constexpr double kInside = 1e-9;
  Vec3d weight(area(corner[1], corner[2]), area(corner[2], corner[0]), area(corner[0], corner[1]));
  const double sum = weight.sum();
  if (!(sum > 0)) return false;
  weight = (weight / sum).cwiseMax(kInside);
  weight /= weight.sum();
  const double x = weight[0] * corner[0].x + weight[1] * corner[1].x + weight[2] * corner[2].x;
  const double y = weight[0] * corner[0].y + weight[1] * corner[1].y + weight[2] * corner[2].y;
  frame.shift_x += x;
  frame.shift_y += y;
  for (Seen& seen : corner) {
    seen.x -= x;
    seen.y -= y;
  }
  return contains_ray(corner);
}

}  // namespace heddle
