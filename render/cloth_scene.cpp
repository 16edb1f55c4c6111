#include "render/cloth_scene.h"

#include <cmath>
#include <map>
#include <utility>

namespace heddle {

namespace {

// Room above the highest and below the lowest fiber, in thicknesses: no fiber touches the shell's
// faces.
constexpr double kShellMargin = 1e-3;
// Distance of an underlay from the shell, in thicknesses.
constexpr double kUnderlayGap = 1e-2;
// Start of shadow rays above a shell or a mesh: some 30 times the rounding of a float at 300 mm.
constexpr double kLiftMm = 1e-3;

double thickness(const Exemplar& exemplar) {
  return static_cast<double>(exemplar.z_max) - static_cast<double>(exemplar.z_min);
}

Shell make_shell(const ClothMesh& mesh, const Exemplar& exemplar) {
  const double margin = kShellMargin * thickness(exemplar);
  return Shell(mesh, static_cast<double>(exemplar.z_min) - margin,
               static_cast<double>(exemplar.z_max) + margin);
}

ClothMesh read_cloth_mesh(const MeshFile& file, double uv_size_mm) {
  const ObjMesh obj = read_obj(file.path, {file.mm_per_unit, uv_size_mm});
  return cloth_mesh_of(obj, file.path.string(), file.mm_per_unit, uv_size_mm);
}

TriangleMesh read_black_mesh(const MeshFile& file) {
  const ObjMesh obj = read_obj(file.path, {.mm_per_unit = file.mm_per_unit});
  TriangleMesh mesh;
  for (const std::array<float, 3>& p : obj.positions) {
    mesh.positions.push_back((file.mm_per_unit * Vec3d(p[0], p[1], p[2])).cast<float>());
  }
  mesh.triangles = obj.triangles;
  return mesh;
}

/// Rectangles along each side of a flat cloth; its vertices may have to know what they see.
std::uint32_t flat_cells(const ClothConfig& cloth) {
  return cloth.surface_method == SurfaceMethod::kInteractive ? 48 : 1;
}

}  // namespace

std::vector<TriangleMesh> ClothScene::boundaries(const std::vector<Cloth>& cloths) {
  std::vector<TriangleMesh> meshes;
  for (const Cloth& cloth : cloths) meshes.push_back(cloth.shell.boundary_mesh());
  return meshes;
}

ClothScene::ClothScene(std::vector<ClothPiece> pieces, std::vector<TriangleMesh> black_meshes,
                       std::vector<SurfaceCloth> surfaces)
    : cloths_([&] {
        std::vector<Cloth> cloths;
        std::map<const TileScene*, std::uint16_t> offsets;
        for (ClothPiece& piece : pieces) {
          const Exemplar& exemplar = piece.tile->exemplar();
          const auto [place, is_new] =
              offsets.try_emplace(piece.tile.get(), static_cast<std::uint16_t>(materials_.size()));
          if (is_new) {
            materials_.insert(materials_.end(), exemplar.scattering.begin(),
                              exemplar.scattering.end());
          }
          Shell shell = make_shell(piece.mesh, exemplar);
          if (piece.underlay)
            black_meshes.push_back(shell.underside_mesh(kUnderlayGap * thickness(exemplar)));
          cloths.push_back({std::move(piece.tile), std::move(shell), place->second});
        }
        return cloths;
      }()),
      boundary_(boundaries(cloths_)),
      surfaces_(std::move(surfaces)),
      meshes_([&] {
        std::vector<TriangleMesh> meshes;
        for (const SurfaceCloth& surface : surfaces_) meshes.push_back(surface.triangle_mesh());
        meshes.insert(meshes.end(), black_meshes.begin(), black_meshes.end());
        return meshes;
      }()) {}

std::optional<MeshHit> ClothScene::first_mesh(const Vec3d& origin, const Vec3& direction,
                                              double t_max) const {
  const std::optional<TriangleScene::Hit> hit =
      meshes_.intersect(origin.cast<float>(), direction, static_cast<float>(t_max));
  if (!hit) return {};
  const SurfaceCloth* surface = hit->mesh < surfaces_.size() ? &surfaces_[hit->mesh] : nullptr;
  return MeshHit{static_cast<double>(hit->t), surface, hit->mesh, hit->triangle, hit->u, hit->v};
}

bool ClothScene::occluded(const SceneRay& ray) const {
  // Meshes first: a ray through them costs a quarter of one through fibers.
  if (meets_mesh(ray.origin, ray.direction, ray.t_max)) return true;
  bool is_blocked = false;
  double limit = ray.t_max;
  walk(ray, RayReach::kEverything, limit,
       [&](std::uint32_t cloth, const ShellInterval& interval, std::uint32_t own_fiber) {
         const LocalRay local =
             local_ray(interval, exemplar(cloth), ray.from != nullptr && interval.t0 == 0.0);
         if (!cloths_[cloth].tile->occluded(local.ray, own_fiber)) return false;
         is_blocked = true;
         limit = -1;
         return true;
       });
  return is_blocked;
}

bool ClothScene::globally_visible(const Shell::SurfacePoint& point, const Vec3& direction) const {
  const Vec3 origin = (point.position + kLiftMm * point.normal).cast<float>();
  return !boundary_.occluded(origin, direction) && !meshes_.occluded(origin, direction);
}

bool ClothScene::visible(const Shell::SurfacePoint& point, const Vec3& direction) const {
  return !occluded({point.position + kLiftMm * point.normal, direction});
}

ClothScene::LocalRay ClothScene::local_ray(const ShellInterval& interval, const Exemplar& exemplar,
                                           bool at_start) {
  const double margin = std::min(1.0, kMarginMm / (interval.t1 - interval.t0));
  const double before = at_start ? 0.0 : margin;
  const Vec3d direction = interval.fabric1 - interval.fabric0;
  Vec3d origin = interval.fabric0 - before * direction;
  const double width = exemplar.width_mm;
  const double height = exemplar.height_mm;
  origin.x() -= width * std::floor(origin.x() / width);
  origin.y() -= height * std::floor(origin.y() / height);
  return {{origin.cast<float>(), direction.cast<float>(), 0.0F,
           static_cast<float>(1.0 + before + margin)},
          before};
}

std::uint32_t ClothScene::flipped_tets() const {
  std::uint32_t count = 0;
  for (const Cloth& cloth : cloths_) count += cloth.shell.flipped_count();
  return count;
}

std::uint32_t ClothScene::degenerate_tets() const {
  std::uint32_t count = 0;
  for (const Cloth& cloth : cloths_) count += cloth.shell.degenerate_count();
  return count;
}

ClothScene make_cloth_scene(const SceneConfig& config,
                            std::span<const std::shared_ptr<const TileScene>> tiles) {
  std::vector<ClothPiece> pieces;
  std::vector<SurfaceCloth> surfaces;
  for (const ClothConfig& cloth : config.cloths) {
    ClothMesh mesh = cloth.mesh
                         ? read_cloth_mesh(*cloth.mesh, cloth.uv_size_mm)
                         : flat_cloth(cloth.flat_width_mm, cloth.flat_height_mm, flat_cells(cloth));
    if (cloth.surface) {
      surfaces.emplace_back(cloth.surface->model, std::move(mesh));
    } else {
      pieces.push_back({tiles[pieces.size()], std::move(mesh), cloth.underlay});
    }
  }
  std::vector<TriangleMesh> black;
  for (const MeshFile& mesh : config.meshes) black.push_back(read_black_mesh(mesh));
  return {std::move(pieces), std::move(black), std::move(surfaces)};
}

}  // namespace heddle
