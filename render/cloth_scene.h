#ifndef HEDDLE_RENDER_CLOTH_SCENE_H_
#define HEDDLE_RENDER_CLOTH_SCENE_H_
// All cloth and all meshes of a scene in world space (millimetres). It traces rays through the
// shell maps against the explicit fibers, or against whatever a query finds in fabric space. It
// also answers macroscopic visibility against shells and meshes. Meshes are surface cloths,
// coloured meshes and black ones. Fibers see them as black, except that traced paths go on from
// coloured ones.
//
// Shells may overlap in space, and a ray visits all of them. Only a ray that starts inside one
// shell does not see what another shell holds around its very origin. Fabric coordinates are folded
// into a tile or block in double before they become floats.
//
// A cloth may be made of blocks of several exemplars (cloth_tiling.h). What one exemplar covers of
// a cloth is a part of the scene. Parts are numbered through all cloths of fibers; where every
// cloth has one exemplar, parts are cloths. Tested in tests/render/cloth_scene_test.cpp.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/tracing/cloth_tiling.h"
#include "fibers/tracing/tile_scene.h"
#include "render/scene_config.h"
#include "render/shell.h"
#include "render/surface_cloth.h"
#include "render/triangle_scene.h"
#include "render/yarn_tints.h"

namespace heddle {

/// One piece of cloth. Pieces of the same fabric share their tile.
struct ClothPiece {
  ClothTiling tiling;
  ClothMesh mesh;
  bool underlay = false;  // a black copy of the underside lies below
  std::optional<YarnTintConfig> yarn_tint = {};
  Shell::Options shell = {};
};

/// A point on a fiber, seen through a shell.
struct ShellHit {
  std::uint32_t cloth = 0;
  std::uint32_t part = 0;
  std::uint32_t tet = 0;
  std::uint32_t segment = 0;
  double t = 0;    // mm along the ray
  Vec3d position;  // world
  Vec3d fabric;    // fabric space, not folded into the tile
};

/// A fiber that a ray ignores; none by default.
struct OwnFiber {
  std::uint32_t part = 0;
  std::uint32_t fiber = kNoFiber;
  std::uint32_t within(std::uint32_t some_part) const {
    return some_part == part ? fiber : kNoFiber;
  }
};

/// A point on a mesh.
struct MeshHit {
  double t;                     // mm along the ray
  const SurfaceCloth* surface;  // null: a black mesh
  std::uint32_t mesh;           // with a surface, its index
  std::uint32_t triangle;
  float u, v;  // as in TriangleScene::Hit
};

/// A ray through the scene; direction of unit length. It may start at a hit, whose fiber it then
/// ignores until it has left that shell.
struct SceneRay {
  Vec3d origin;
  Vec3 direction;
  const ShellHit* from = nullptr;
  double t_max = std::numeric_limits<double>::infinity();
};

/// How far a ray is followed.
enum class RayReach : std::uint8_t {
  kEverything,  // through every shell that it meets
  kOwnShell,    // until it leaves the shell that it starts in
};

class ClothScene {
 public:
  ClothScene(std::vector<ClothPiece> pieces, std::vector<TriangleMesh> black_meshes,
             std::vector<SurfaceCloth> surfaces = {});

  /// Surface cloths, then coloured meshes.
  std::span<const SurfaceCloth> surfaces() const { return surfaces_; }
  /// Meshes that are nothing but black, undersides among them.
  std::size_t black_mesh_count() const { return black_mesh_count_; }
  bool has_solids() const { return !surfaces_.empty() && surfaces_.back().is_solid(); }
  /// Pieces of fibers; all that `cloth` counts below.
  std::size_t cloth_count() const { return cloths_.size(); }
  const Shell& shell(std::uint32_t cloth) const { return cloths_[cloth].shell; }
  const ClothTiling& tiling(std::uint32_t cloth) const { return cloths_[cloth].tiling; }
  std::size_t part_count() const { return parts_.size(); }
  std::uint32_t cloth_of_part(std::uint32_t part) const { return parts_[part].cloth; }
  /// The part of a cloth that covers a point of its fabric space.
  std::uint32_t part_at(std::uint32_t cloth, const Vec3d& fabric) const {
    const ClothTiling& tiling = cloths_[cloth].tiling;
    return cloths_[cloth].first_part + tiling.block_at(tiling.place_of(fabric)).exemplar;
  }
  const TileScene& tile(std::uint32_t part) const { return *parts_[part].tile; }
  const Exemplar& exemplar(std::uint32_t part) const { return parts_[part].tile->exemplar(); }
  /// Materials of all fabrics in one list, each fabric once: a fiber's index is
  /// material_offset(part) + its own.
  std::uint16_t material_offset(std::uint32_t part) const { return parts_[part].material_offset; }
  std::vector<FiberScattering> materials() const { return materials_; }
  /// Does a black copy of the underside lie below the cloth? Then no light comes from there.
  bool has_underlay(std::uint32_t cloth) const { return cloths_[cloth].has_underlay; }
  bool has_tints(std::uint32_t part) const { return cloths_[parts_[part].cloth].tints.has_value(); }
  /// Factor of the scattering of the yarn at a hit; 1 where the cloth has no tints.
  Rgb tint(const ShellHit& hit) const {
    const Cloth& cloth = cloths_[hit.cloth];
    if (!cloth.tints) return Rgb::Ones();
    return cloth.tints->tint_at(cloth.tiling, hit.part - cloth.first_part, hit.segment, hit.fabric);
  }

  /// The first hit of `query` along the ray. query(part, ray, own_fiber) ->
  /// std::optional<FiberHit> looks along a ray in the tile of the part's exemplar, from its origin
  /// to t_max. own_fiber is kNoFiber or the fiber to ignore.
  template <class Query>
  std::optional<ShellHit> first_hit(const SceneRay& ray, RayReach reach, Query&& query) const {
    return first_hit(ray, reach, query,
                     [](std::uint32_t, const ShellInterval&) { return Passing::kLook; });
  }
  /// What a ray does with one interval of a shell: looks for fibers, passes it, or ends there.
  enum class Passing : std::uint8_t { kLook, kSkip, kStop };
  /// The same; pass(cloth, interval) -> Passing is asked first.
  template <class Query, class Pass>
  std::optional<ShellHit> first_hit(const SceneRay& ray, RayReach reach, Query&& query,
                                    Pass&& pass) const;

  /// First fiber along the ray.
  std::optional<ShellHit> first_fiber(const SceneRay& ray,
                                      RayReach reach = RayReach::kEverything) const {
    return first_hit(ray, reach,
                     [this](std::uint32_t part, const Ray& local, std::uint32_t own_fiber) {
                       return parts_[part].tile->intersect(local, own_fiber);
                     });
  }
  /// Does the ray meet a fiber or a mesh up to t_max?
  bool occluded(const SceneRay& ray) const;

  /// Does the ray meet a mesh in (0, t_max]?
  bool meets_mesh(const Vec3d& origin, const Vec3& direction, double t_max) const {
    return meshes_.occluded(origin.cast<float>(), direction, static_cast<float>(t_max));
  }
  /// The first mesh in (0, t_max].
  std::optional<MeshHit> first_mesh(const Vec3d& origin, const Vec3& direction,
                                    double t_max = std::numeric_limits<double>::infinity()) const;

  /// Is a point of a shell's surface, or of a mesh, open towards `direction` for `distance` mm,
  /// past all shells (as solids) and meshes?
  bool globally_visible(const Shell::SurfacePoint& point, const Vec3& direction,
                        double distance = std::numeric_limits<double>::infinity()) const;
  /// A ray that starts just above a point of a mesh.
  static SceneRay ray_from(const Shell::SurfacePoint& point, const Vec3& direction,
                           double distance = std::numeric_limits<double>::infinity());
  /// The same past all fibers and meshes.
  bool visible(const Shell::SurfacePoint& point, const Vec3& direction,
               double distance = std::numeric_limits<double>::infinity()) const;

  /// Distance (mm) of the nearest point of a shell's outside or a surface cloth. Looks at every
  /// triangle.
  double distance_to_cloth(const Vec3d& point) const;

  /// Surface point of the shell straight over (kFace) or under (kBack) a hit.
  Shell::SurfacePoint surface_point(const ShellHit& hit, ClothSide side) const {
    return shell(hit.cloth).surface_point(hit.tet / 3, hit.fabric.head<2>(), side);
  }
  /// The same over another fabric position near the hit; nothing beyond a rim.
  std::optional<Shell::SurfacePoint> surface_point(const ShellHit& hit,
                                                   const Eigen::Vector2d& fabric_xy,
                                                   ClothSide side) const {
    const std::optional<std::uint32_t> triangle =
        shell(hit.cloth).find_triangle(hit.tet / 3, fabric_xy);
    if (!triangle) return {};
    return shell(hit.cloth).surface_point(*triangle, fabric_xy, side);
  }

  /// A world direction in the fabric space of the hit, unit length.
  Vec3 fabric_direction(const ShellHit& hit, const Vec3& direction) const {
    return (shell(hit.cloth).fabric_from_world(hit.tet) * direction).normalized();
  }
  /// The same without the steps between tetrahedra: the frame is turned to the cloth's normal
  /// there, which is interpolated between vertices.
  Vec3 smooth_fabric_direction(const ShellHit& hit, const Vec3& direction) const {
    const Vec3d normal = surface_point(hit, ClothSide::kFace).normal;
    const Vec3d own = shell(hit.cloth).fabric_from_world(hit.tet).row(2).transpose().cast<double>();
    const Vec3d turned = Eigen::Quaterniond::FromTwoVectors(normal, own) * direction.cast<double>();
    return fabric_direction(hit, turned.cast<float>());
  }
  /// Unit tangent of the hit fiber in world space.
  Vec3 world_tangent(const ShellHit& hit) const {
    return (shell(hit.cloth).world_from_fabric(hit.tet) *
            exemplar(hit.part).segment_tangent(hit.segment))
        .normalized();
  }

  /// Walks through a shell that rounding brought to an end early; what lay beyond was not seen.
  std::uint64_t failed_walks() const { return failed_walks_.load(std::memory_order_relaxed); }
  std::uint32_t flipped_tets() const;
  std::uint32_t degenerate_tets() const;
  std::uint32_t thinned_vertices() const;

 private:
  struct Cloth {
    ClothTiling tiling;
    Shell shell;
    std::uint32_t first_part;
    std::optional<YarnTints> tints;
    bool has_underlay;
  };
  struct Part {
    std::uint32_t cloth;
    std::shared_ptr<const TileScene> tile;
    std::uint16_t material_offset;
  };

  // The ray in fabric space over one interval, from a place's corner: s = t - margin runs from 0
  // (t0) to 1 (t1). It is a little longer at the ends that are not the start of the ray, so that
  // nothing falls between two tetrahedra.
  struct LocalRay {
    BlockPlace place;
    Ray ray;
    double margin;
  };
  static LocalRay local_ray(const ShellInterval& interval, const ClothTiling& tiling,
                            bool at_start);

  // Shorter intervals are left to the margins of their neighbours.
  static constexpr double kShortestMm = 1e-7;
  static constexpr double kMarginMm = 1e-6;

  // Calls visit(cloth, interval, own) -> bool for the shells in order of where the ray enters
  // them; true stops the walk through this shell. `limit` may shrink meanwhile, and nothing that
  // starts beyond it is visited.
  template <class Visit>
  void walk(const SceneRay& ray, RayReach reach, const double& limit, Visit&& visit) const;

  static std::vector<TriangleMesh> boundaries(const std::vector<Cloth>& cloths);

  std::vector<FiberScattering> materials_;
  std::vector<Part> parts_;
  std::vector<Cloth> cloths_;
  TriangleScene boundary_;  // mesh index = cloth
  std::vector<SurfaceCloth> surfaces_;
  std::size_t black_mesh_count_;
  TriangleScene meshes_;  // the surfaces, then the black meshes
  mutable std::atomic<std::uint64_t> failed_walks_ = 0;
};

/// The scene of a config. tilings: [cloth that has a fabric].
ClothScene make_cloth_scene(const SceneConfig& config, std::span<const ClothTiling> tilings);

template <class Visit>
void ClothScene::walk(const SceneRay& ray, RayReach reach, const double& limit,
                      Visit&& visit) const {
  const Vec3d direction = ray.direction.cast<double>().normalized();
  const auto note = [this](Shell::WalkEnd end) {
    if (end == Shell::WalkEnd::kFailed) failed_walks_.fetch_add(1, std::memory_order_relaxed);
  };
  if (ray.from != nullptr) {
    const std::uint32_t cloth = ray.from->cloth;
    const OwnFiber own{ray.from->part, exemplar(ray.from->part).segment_fiber[ray.from->segment]};
    note(shell(cloth).walk_from_inside(
        ray.origin, direction, ray.from->tet, ray.from->fabric, [&](const ShellInterval& interval) {
          return interval.t0 > limit ||
                 (interval.t1 - interval.t0 > kShortestMm && visit(cloth, interval, own));
        }));
    if (reach == RayReach::kOwnShell) return;
  }
  static thread_local std::vector<TriangleScene::Crossing> crossings;
  boundary_.crossings(ray.origin.cast<float>(), ray.direction, static_cast<float>(limit),
                      crossings);
  for (const TriangleScene::Crossing& crossing : crossings) {
    if (static_cast<double>(crossing.t) > limit) break;
    note(shell(crossing.mesh)
             .walk_from_face(
                 ray.origin, direction, crossing.triangle, [&](const ShellInterval& interval) {
                   return interval.t0 > limit || (interval.t1 - interval.t0 > kShortestMm &&
                                                  visit(crossing.mesh, interval, OwnFiber{}));
                 }));
  }
}

template <class Query, class Pass>
std::optional<ShellHit> ClothScene::first_hit(const SceneRay& ray, RayReach reach, Query&& query,
                                              Pass&& pass) const {
  std::optional<ShellHit> best;
  double limit = ray.t_max;
  walk(ray, reach, limit,
       [&](std::uint32_t cloth, const ShellInterval& interval, const OwnFiber& own) {
         const Passing passing = pass(cloth, interval);
         if (passing == Passing::kSkip) return false;
         if (passing == Passing::kStop) {
           limit = interval.t1;
           return true;
         }
         const Cloth& here = cloths_[cloth];
         const LocalRay local =
             local_ray(interval, here.tiling, ray.from != nullptr && interval.t0 == 0.0);
         const std::optional<TilingHit> found = here.tiling.first_hit(
             local.place, local.ray, [&](std::uint32_t exemplar, const Ray& in_tile) {
               const std::uint32_t part = here.first_part + exemplar;
               return query(part, in_tile, own.within(part));
             });
         if (!found) return false;
         const double s = std::clamp(static_cast<double>(found->hit.t) - local.margin, 0.0, 1.0);
         const double t = interval.t0 + s * (interval.t1 - interval.t0);
         if (t > limit || t < 0) return false;
         limit = t;
         best = ShellHit{cloth,
                         here.first_part + found->exemplar,
                         interval.tet,
                         found->hit.segment,
                         t,
                         ray.origin + t * ray.direction.cast<double>().normalized(),
                         interval.fabric0 + s * (interval.fabric1 - interval.fabric0)};
         return true;
       });
  return best;
}

}  // namespace heddle

#endif  // HEDDLE_RENDER_CLOTH_SCENE_H_
