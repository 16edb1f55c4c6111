#include "render/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "formats/input_error.h"
#include "formats/memory_need.h"
#include "formats/obj_mesh.h"

namespace heddle {
namespace {

constexpr int kMostPieces = 1024;  // of an edge
constexpr std::size_t kMostTriangles = 16'000'000;
// Towards the vertices. Two leave least stretch in the cloth of simulated drapes (docs/meshes.md).
constexpr int kRounds = 2;
// Of a shell or a mesh and what traces rays through it, per triangle, while it is built.
constexpr std::uint64_t kBytesPerTriangle = 1200;
// How much longer pieces may be that no camera sees: they throw shadows only.
constexpr double kUnseen = 8;

using Place = std::array<float, 3>;

Vec3d vector_at(const Place& p) {
  return {p[0], p[1], p[2]};
}

[[noreturn]] void fail(const MeshFile& file, std::string_view key, const std::string& message) {
  if (file.table) file.table->fail(key, message);
  throw ConfigError(fmt::format("{}: {}: {}", file.path.string(), key, message));
}

/// [triangle] of the group; empty where no group is asked for.
std::vector<std::uint8_t> shown_triangles(const MeshFile& file, const ObjMesh& obj) {
  if (file.group.empty()) return {};
  std::vector<std::uint8_t> shown = triangles_of_group(obj, file.group);
  if (std::find(shown.begin(), shown.end(), 1) == shown.end()) {
    const std::vector<std::string> names = group_names(obj);
    fail(file, "group",
         fmt::format("{} has no faces in a group or object of that name; it has {}",
                     file.path.string(),
                     names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  return shown;
}

EdgePieces pieces_for(const MeshFile& file, std::span<const Camera> cameras) {
  if (file.subdivide_px) return pieces_in_pictures(cameras, *file.subdivide_px);
  return [pieces = 1 << file.subdivide](const Vec3d&, const Vec3d&) { return pieces; };
}

/// Subdivision of a file, in the world.
ClothMesh smooth_mesh(const MeshFile& file, const ObjMesh& obj, double uv_size_mm,
                      const std::vector<std::uint8_t>& shown, std::span<const Camera> cameras) {
  ControlMesh control =
      control_mesh_of(obj, file.path.string(), file.mm_per_unit, uv_size_mm, shown);
  control.sharp_corners = file.sharp_corners;
  for (Vec3d& p : control.positions) p = file.placement.placed(p);
  if (file.near_vertices)
    control = drawn_to_vertices(std::move(control), kRounds, file.path.string());
  const EdgePieces pieces = pieces_for(file, cameras);
  const std::size_t triangles = limit_triangles(control, pieces);
  if (triangles > kMostTriangles) {
    fail(file, file.subdivide_px ? "subdivide_px" : "subdivide",
         fmt::format("{} has {} triangles then, and at most {} are made", file.path.string(),
                     triangles, kMostTriangles));
  }
  require_memory(kBytesPerTriangle * triangles,
                 fmt::format("{} in {} triangles", file.path.string(), triangles));
  return limit_surface(control, pieces, file.path.string());
}

/// Polygons of welded values and vertices.
class ControlMeshBuilder {
 public:
  ControlMeshBuilder(const ObjMesh& obj, double mm_per_unit, double uv_size_mm) : obj_(obj) {
    for (std::size_t v = 0; v < obj.positions.size(); ++v) {
      const Place& p = obj.positions[v];
      const std::array<float, 2> uv = obj.uvs.empty() ? std::array<float, 2>{} : obj.uvs[v];
      const auto [vertex, is_new] =
          vertex_.try_emplace(p, static_cast<std::uint32_t>(mesh_.positions.size()));
      if (is_new) mesh_.positions.emplace_back(mm_per_unit * vector_at(p));
      const auto [value, is_new_value] = value_.try_emplace(
          {p[0], p[1], p[2], uv[0], uv[1]}, static_cast<std::uint32_t>(mesh_.fabric.size()));
      if (is_new_value) {
        mesh_.fabric.emplace_back(uv_size_mm * Eigen::Vector2d(uv[0], uv[1]));
        mesh_.value_owner.push_back(vertex->second);
      }
      value_of_.push_back(value->second);
    }
  }

  /// corners: vertices of the file.
  void add_face(const std::vector<std::uint32_t>& corners, bool is_shown) {
    std::vector<std::uint32_t> values;
    for (const std::uint32_t corner : corners) {
      const std::uint32_t value = value_of_[corner];
      if (values.empty() || owner(value) != owner(values.back())) values.push_back(value);
    }
    while (values.size() > 1 && owner(values.front()) == owner(values.back())) values.pop_back();
    std::set<std::uint32_t> distinct;
    for (const std::uint32_t value : values) distinct.insert(owner(value));
    if (distinct.size() == values.size()) {
      add_polygon(values, is_shown);
    } else {
      // A polygon that touches itself: its fan, less what covers nothing.
      for (std::size_t k = 2; k < values.size(); ++k) {
        const std::array<std::uint32_t, 3> v = {values[0], values[k - 1], values[k]};
        if (owner(v[0]) != owner(v[1]) && owner(v[1]) != owner(v[2]) && owner(v[2]) != owner(v[0]))
          add_polygon({v[0], v[1], v[2]}, is_shown);
      }
    }
    for (std::size_t k = 2; k < corners.size() && !obj_.normals.empty(); ++k) {
      const Vec3d a = vector_at(obj_.positions[corners[0]]);
      const Vec3d area = (vector_at(obj_.positions[corners[k - 1]]) - a)
                             .cross(vector_at(obj_.positions[corners[k]]) - a);
      for (const std::uint32_t v : {corners[0], corners[k - 1], corners[k]})
        with_normals_ += area.dot(vector_at(obj_.normals[v]));
    }
  }

  ControlMesh finish(const std::string& name) {
    mesh_.normals_against_winding = with_normals_ < 0;
    for (const ObjSharpEdge& edge : obj_.sharp_edges) {
      const auto a = vertex_.find(edge.ends[0]);
      const auto b = vertex_.find(edge.ends[1]);
      if (a == vertex_.end() || b == vertex_.end() ||
          !edges_.contains(std::minmax(a->second, b->second))) {
        throw FileError(
            fmt::format("{}:{}: a crease between vertices that no edge joins", name, edge.line));
      }
      mesh_.sharp_edges.push_back({a->second, b->second, edge.sharpness});
    }
    for (const ObjSharpVertex& point : obj_.sharp_vertices) {
      if (const auto found = vertex_.find(point.place); found != vertex_.end())
        mesh_.sharp_vertices.push_back({found->second, point.sharpness});
    }
    return std::move(mesh_);
  }

 private:
  std::uint32_t owner(std::uint32_t value) const { return mesh_.value_owner[value]; }

  void add_polygon(const std::vector<std::uint32_t>& values, bool is_shown) {
    if (values.size() < 3) return;
    mesh_.face_corners.push_back(static_cast<std::uint32_t>(values.size()));
    mesh_.is_shown.push_back(is_shown ? 1 : 0);
    mesh_.values.insert(mesh_.values.end(), values.begin(), values.end());
    for (std::size_t k = 0; k < values.size() && !obj_.sharp_edges.empty(); ++k)
      edges_.insert(std::minmax(owner(values[k]), owner(values[(k + 1) % values.size()])));
  }

  const ObjMesh& obj_;
  ControlMesh mesh_;
  std::map<Place, std::uint32_t> vertex_;
  std::map<std::array<float, 5>, std::uint32_t> value_;
  std::vector<std::uint32_t> value_of_;  // [vertex of the file]
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges_;
  double with_normals_ = 0;  // of the faces: how far they agree with the file's normals
};

/// Corners of faces with normals of their own; no two triangles share any.
ClothMesh mesh_with_edges(const ObjMesh& obj, double mm_per_unit) {
  std::vector<Vec3d> areas;  // [triangle]
  std::map<Place, std::vector<std::size_t>> triangles_at;
  for (std::size_t t = 0; t < obj.triangles.size(); ++t) {
    const auto& [a, b, c] = obj.triangles[t];
    const Vec3d corner = vector_at(obj.positions[a]);
    areas.push_back(
        (vector_at(obj.positions[b]) - corner).cross(vector_at(obj.positions[c]) - corner));
    for (const std::uint32_t v : {a, b, c}) triangles_at[obj.positions[v]].push_back(t);
  }
  ClothMesh mesh;
  for (std::size_t t = 0; t < obj.triangles.size(); ++t) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.triangles.push_back({first, first + 1, first + 2});
    for (const std::uint32_t v : obj.triangles[t]) {
      Vec3d normal = Vec3d::Zero();
      for (const std::size_t other : triangles_at[obj.positions[v]]) {
        const double bent = std::cos(kSharpEdge) * areas[other].norm() * areas[t].norm();
        if (areas[other].dot(areas[t]) >= bent) normal += areas[other];
      }
      mesh.positions.emplace_back(mm_per_unit * vector_at(obj.positions[v]));
      mesh.normals.emplace_back(normal.norm() > 0 ? Vec3d(normal.normalized()) : Vec3d(0, 0, 1));
    }
  }
  return mesh;
}

/// As the file says.
ClothMesh mesh_with_normals(const ObjMesh& obj, double mm_per_unit) {
  ClothMesh mesh;
  for (const Place& p : obj.positions) mesh.positions.emplace_back(mm_per_unit * vector_at(p));
  for (const Place& normal : obj.normals) mesh.normals.emplace_back(vector_at(normal));
  mesh.triangles = obj.triangles;
  return mesh;
}

}  // namespace

Mat3d Placement::rotation() const {
  return (Eigen::AngleAxisd(rotate.z(), Vec3d::UnitZ()) *
          Eigen::AngleAxisd(rotate.y(), Vec3d::UnitY()) *
          Eigen::AngleAxisd(rotate.x(), Vec3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector2d FabricPlacement::fabric_of(const Eigen::Vector2d& uv_mm) const {
  return Eigen::Rotation2Dd(-turn) * (tiling.cwiseProduct(uv_mm) - offset_mm);
}

Eigen::Vector2d FabricPlacement::uv_mm_of(const Eigen::Vector2d& fabric) const {
  return (Eigen::Rotation2Dd(turn) * fabric + offset_mm).cwiseQuotient(tiling);
}

EdgePieces pieces_in_pictures(std::span<const Camera> cameras, double most_pixels) {
  return [cameras = std::vector<Camera>(cameras.begin(), cameras.end()), most_pixels](
             const Vec3d& a, const Vec3d& b) {
    const double length = (b - a).norm();
    const Vec3d middle = 0.5 * (a + b);
    double pieces = 1;
    for (const Camera& camera : cameras) {
      const double distance = std::max(camera.distance(middle), 0.5 * length);
      if (!(distance > 0)) continue;
      const double pixels = length / camera.pixel_size(distance);
      pieces = std::max(
          pieces, pixels / (camera.may_see(middle, length) ? most_pixels : kUnseen * most_pixels));
    }
    return static_cast<int>(std::ceil(std::min<double>(pieces, kMostPieces)));
  };
}

ControlMesh control_mesh_of(const ObjMesh& obj, const std::string& name, double mm_per_unit,
                            double uv_size_mm, const std::vector<std::uint8_t>& shown) {
  ControlMeshBuilder builder(obj, mm_per_unit, uv_size_mm);
  std::size_t triangle = 0;
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t count : obj.face_corners) {
    corners.assign({obj.triangles[triangle][0], obj.triangles[triangle][1]});
    const bool is_shown = shown.empty() || shown[triangle] != 0;
    for (std::uint32_t k = 2; k < count; ++k) corners.push_back(obj.triangles[triangle++][2]);
    builder.add_face(corners, is_shown);
  }
  ControlMesh mesh = builder.finish(name);
  if (mesh.face_corners.empty()) throw FileError(name + ": all faces are without area");
  return mesh;
}

ClothMesh placed(ClothMesh mesh, const Placement& placement) {
  if (placement.is_identity()) return mesh;
  const Mat3d turn = placement.rotation();
  for (Vec3d& p : mesh.positions) p = placement.placed(p);
  for (Vec3d& normal : mesh.normals) normal = turn * normal;
  return mesh;
}

ClothMesh read_cloth_mesh(const MeshFile& file, double uv_size_mm, const FabricPlacement& fabric,
                          std::span<const Camera> cameras) {
  const ObjMesh obj = read_obj(file.path, {file.mm_per_unit, uv_size_mm});
  require_uvs(obj, file.path.string());
  const std::vector<std::uint8_t> shown = shown_triangles(file, obj);
  ClothMesh mesh =
      file.is_smooth()
          ? smooth_mesh(file, obj, uv_size_mm, shown, cameras)
          : placed(cloth_mesh_of(obj, file.path.string(), file.mm_per_unit, uv_size_mm, shown),
                   file.placement);
  if (!fabric.is_identity()) {
    for (Eigen::Vector2d& place : mesh.fabric) place = fabric.fabric_of(place);
  }
  return mesh;
}

ClothMesh read_solid_mesh(const MeshFile& file, std::span<const Camera> cameras) {
  const ObjMesh obj = read_obj(file.path, {.mm_per_unit = file.mm_per_unit});
  if (obj.triangles.empty()) throw FileError(file.path.string() + ": the mesh has no faces");
  const std::vector<std::uint8_t> shown = shown_triangles(file, obj);
  if (file.is_smooth()) {
    ClothMesh mesh = smooth_mesh(file, obj, 0, shown, cameras);
    mesh.fabric.assign(mesh.positions.size(), Eigen::Vector2d::Zero());
    return mesh;
  }
  ClothMesh mesh = obj.normals.empty() ? mesh_with_edges(obj, file.mm_per_unit)
                                       : mesh_with_normals(obj, file.mm_per_unit);
  mesh.fabric.assign(mesh.positions.size(), Eigen::Vector2d::Zero());
  if (!shown.empty()) {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::size_t t = 0; t < shown.size(); ++t) {
      if (shown[t] != 0) triangles.push_back(mesh.triangles[t]);
    }
    mesh.triangles = std::move(triangles);
    mesh = without_unused_vertices(std::move(mesh));
  }
  return placed(std::move(mesh), file.placement);
}

TriangleMesh read_black_mesh(const MeshFile& file, std::span<const Camera> cameras) {
  const ObjMesh obj = read_obj(file.path, {.mm_per_unit = file.mm_per_unit});
  const std::vector<std::uint8_t> shown = shown_triangles(file, obj);
  TriangleMesh mesh;
  if (file.is_smooth()) {
    const ClothMesh smooth = smooth_mesh(file, obj, 0, shown, cameras);
    for (const Vec3d& p : smooth.positions) mesh.positions.push_back(p.cast<float>());
    mesh.triangles = smooth.triangles;
    return mesh;
  }
  for (const Place& p : obj.positions) {
    mesh.positions.push_back(file.placement.placed(file.mm_per_unit * vector_at(p)).cast<float>());
  }
  for (std::size_t t = 0; t < obj.triangles.size(); ++t) {
    if (shown.empty() || shown[t] != 0) mesh.triangles.push_back(obj.triangles[t]);
  }
  return mesh;
}

}  // namespace heddle
