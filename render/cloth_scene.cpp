#include "render/cloth_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace heddle {

namespace {

// Room above the highest and below the lowest fiber, in thicknesses: no fiber touches the shell's
// faces.
constexpr double kShellMargin = 1e-3;
// Distance of an underlay from the shell, in thicknesses.
constexpr double kUnderlayGap = 1e-2;

double thickness(const ClothTiling& tiling) {
  return static_cast<double>(tiling.z_max()) - static_cast<double>(tiling.z_min());
}

Shell make_shell(const ClothPiece& piece) {
  const ClothTiling& tiling = piece.tiling;
  const double margin = kShellMargin * thickness(tiling);
  return Shell(piece.mesh, static_cast<double>(tiling.z_min()) - margin,
               static_cast<double>(tiling.z_max()) + margin, piece.shell);
}

/// Squared distance of a point to a triangle: to its plane, or to the nearest edge.
double square_distance(const Vec3d& point, const std::array<Vec3d, 3>& corner) {
  const Vec3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  bool is_above = normal.squaredNorm() > 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d edge = corner[(k + 1) % 3] - corner[k];
    const Vec3d way = point - corner[k];
    is_above = is_above && normal.cross(edge).dot(way) >= 0;
    const double along = std::clamp(way.dot(edge) / std::max(edge.squaredNorm(), 1e-30), 0.0, 1.0);
    nearest = std::min(nearest, (way - along * edge).squaredNorm());
  }
  if (!is_above) return nearest;
  const double height = normal.dot(point - corner[0]);
  return height * height / normal.squaredNorm();
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
          const auto first_part = static_cast<std::uint32_t>(parts_.size());
          for (const ClothTiling::Tile& tile : piece.tiling.tiles()) {
            const std::vector<FiberScattering>& scattering = tile->exemplar().scattering;
            const auto [place, is_new] =
                offsets.try_emplace(tile.get(), static_cast<std::uint16_t>(materials_.size()));
            if (is_new) materials_.insert(materials_.end(), scattering.begin(), scattering.end());
            parts_.push_back({static_cast<std::uint32_t>(cloths.size()), tile, place->second});
          }
          Shell shell = make_shell(piece);
          if (piece.underlay)
            black_meshes.push_back(shell.underside_mesh(kUnderlayGap * piece.shell.thickness *
                                                        thickness(piece.tiling)));
          std::optional<YarnTints> tints;
          if (piece.yarn_tint) tints.emplace(piece.tiling, *piece.yarn_tint);
          cloths.push_back({std::move(piece.tiling), std::move(shell), first_part, std::move(tints),
                            piece.underlay});
        }
        return cloths;
      }()),
      boundary_(boundaries(cloths_)),
      surfaces_(std::move(surfaces)),
      black_mesh_count_(black_meshes.size()),
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
       [&](std::uint32_t cloth, ShellInterval interval, const OwnFiber& own) {
         if (interval.t1 > ray.t_max) {
           const double share = (ray.t_max - interval.t0) / (interval.t1 - interval.t0);
           interval.fabric1 = interval.fabric0 + share * (interval.fabric1 - interval.fabric0);
           interval.t1 = ray.t_max;
           if (!(interval.t1 > interval.t0)) return false;
         }
         const Cloth& here = cloths_[cloth];
         const LocalRay local =
             local_ray(interval, here.tiling, ray.from != nullptr && interval.t0 == 0.0);
         const auto meets_fiber = [&](std::uint32_t exemplar,
                                      const Ray& in_tile) -> std::optional<FiberHit> {
           const std::uint32_t part = here.first_part + exemplar;
           if (!parts_[part].tile->occluded(in_tile, own.within(part))) return {};
           return FiberHit{0, 0};
         };
         if (!here.tiling.first_hit(local.place, local.ray, meets_fiber)) return false;
         is_blocked = true;
         limit = -1;
         return true;
       });
  return is_blocked;
}

bool ClothScene::globally_visible(const Shell::SurfacePoint& point, const Vec3& direction,
                                  double distance) const {
  const Vec3 origin = ray_from(point, direction, distance).origin.cast<float>();
  const auto reach = static_cast<float>(distance);
  return !boundary_.occluded(origin, direction, reach) &&
         !meshes_.occluded(origin, direction, reach);
}

SceneRay ClothScene::ray_from(const Shell::SurfacePoint& point, const Vec3& direction,
                              double distance) {
  // Some 30 times the rounding of a float at 300 mm above the surface.
  constexpr double kLiftMm = 1e-3;
  return {point.position + kLiftMm * point.normal, direction, nullptr, distance};
}

bool ClothScene::visible(const Shell::SurfacePoint& point, const Vec3& direction,
                         double distance) const {
  return !occluded(ray_from(point, direction, distance));
}

double ClothScene::distance_to_cloth(const Vec3d& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  const auto look_at = [&](const TriangleMesh& mesh) {
    for (const std::array<std::uint32_t, 3>& t : mesh.triangles) {
      nearest = std::min(nearest, square_distance(point, {mesh.positions[t[0]].cast<double>(),
                                                          mesh.positions[t[1]].cast<double>(),
                                                          mesh.positions[t[2]].cast<double>()}));
    }
  };
  for (const Cloth& cloth : cloths_) look_at(cloth.shell.boundary_mesh());
  for (const SurfaceCloth& surface : surfaces_) {
    if (!surface.is_solid()) look_at(surface.triangle_mesh());
  }
  return std::sqrt(nearest);
}

ClothScene::LocalRay ClothScene::local_ray(const ShellInterval& interval, const ClothTiling& tiling,
                                           bool at_start) {
  const double margin = std::min(1.0, kMarginMm / (interval.t1 - interval.t0));
  const double before = at_start ? 0.0 : margin;
  const Vec3d direction = interval.fabric1 - interval.fabric0;
  const BlockPlace place = tiling.place_of(interval.fabric0 - before * direction);
  return {place,
          {place.offset.cast<float>(), direction.cast<float>(), 0.0F,
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

std::uint32_t ClothScene::thinned_vertices() const {
  std::uint32_t count = 0;
  for (const Cloth& cloth : cloths_) count += cloth.shell.thinned_count();
  return count;
}

ClothScene make_cloth_scene(const SceneConfig& config, std::span<const ClothTiling> tilings) {
  std::vector<Camera> cameras;
  for (const CameraConfig& camera : cameras_of_cuts(config)) cameras.emplace_back(camera);
  std::vector<ClothPiece> pieces;
  std::vector<SurfaceCloth> surfaces;
  for (const ClothConfig& cloth : config.cloths) {
    ClothMesh mesh =
        cloth.mesh
            ? read_cloth_mesh(*cloth.mesh, cloth.uv_size_mm, cloth.on_uvs, cameras)
            : placed(flat_cloth(cloth.flat_width_mm, cloth.flat_height_mm, flat_cells(cloth)),
                     cloth.flat_placement);
    if (cloth.surface) {
      surfaces.emplace_back(cloth.surface->model, std::move(mesh));
    } else {
      if (cloth.yarn_drift) mesh = with_yarn_drift(std::move(mesh), *cloth.yarn_drift);
      const bool is_smooth = cloth.mesh && cloth.mesh->is_smooth();
      pieces.push_back({tilings[pieces.size()],
                        std::move(mesh),
                        cloth.underlay,
                        cloth.yarn_tint,
                        {.thickness = cloth.thickness, .thin_tight_folds = is_smooth}});
    }
  }
  std::vector<TriangleMesh> black;
  for (const MeshConfig& mesh : config.meshes) {
    if (mesh.paint) {
      surfaces.emplace_back(mesh.paint, read_solid_mesh(mesh, cameras), true);
    } else {
      black.push_back(read_black_mesh(mesh, cameras));
    }
  }
  return {std::move(pieces), std::move(black), std::move(surfaces)};
}

}  // namespace heddle
