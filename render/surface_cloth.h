#ifndef HEDDLE_RENDER_SURFACE_CLOTH_H_
#define HEDDLE_RENDER_SURFACE_CLOTH_H_
// A piece of cloth without fibers: a mesh that a surface model draws, lit directly. Light that
// other cloth scatters onto it, and light that it scatters on, is left out. A mesh that is no cloth
// but has a colour (surface/paint.h) is drawn alike; traced paths go on from it.
//
// Patch frame of a point (surface_model.h): z = the interpolated normal of the side that is looked
// at, x = the direction in which u grows, made perpendicular to z, y = z x x. It is right-handed
// from both sides and for mirrored UVs too. position_mm runs along the frame: its y falls with v
// where y points against it. So the back shows what the face would show there: the model has one
// face.
//
// If an interpolated normal turns away from the eye but its triangle does not, it is bent back to
// the eye (kLeastCosine). Tested in tests/render/surface_cloth_test.cpp.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"
#include "render/lights.h"
#include "render/shell.h"
#include "render/surface/surface_model.h"

namespace heddle {

/// A point of a surface cloth, seen from one side.
struct SurfaceHit {
  const SurfaceModel* model;
  Vec3d position;          // world, mm
  Vec3d normal;            // of the triangle, on the side that is looked at
  Mat3d world_from_patch;  // columns: x, y, z of the patch frame
  SurfacePoint point;
  ClothSide side;                         // kFace: the one out of which the mesh's normals point
  std::array<std::uint32_t, 3> vertices;  // of the triangle
  std::array<double, 3> vertex_weights;   // position = sum of weights times positions
};

class SurfaceCloth {
 public:
  /// is_solid: a coloured mesh, no cloth.
  SurfaceCloth(std::shared_ptr<const SurfaceModel> model, ClothMesh mesh, bool is_solid = false);

  bool is_solid() const { return is_solid_; }

  TriangleMesh triangle_mesh() const;

  std::size_t triangle_count() const { return mesh_.triangles.size(); }
  std::size_t vertex_count() const { return mesh_.positions.size(); }
  const Vec3d& vertex_position(std::uint32_t vertex) const { return mesh_.positions[vertex]; }
  /// The patch frame at a vertex, seen from one side: hits in between interpolate what it is made
  /// of.
  Mat3d vertex_frame(std::uint32_t vertex, ClothSide side) const;

  /// Fabric coordinates of a hit on this cloth, mm.
  Eigen::Vector2d fabric_at(const SurfaceHit& hit) const;

  /// The point (1 - u - v) a + u b + v c of a triangle a, b, c, seen by a ray with that direction.
  SurfaceHit hit(std::uint32_t triangle, double u, double v, const Vec3& ray_direction,
                 double footprint_mm) const;

 private:
  std::shared_ptr<const SurfaceModel> model_;
  ClothMesh mesh_;
  bool is_solid_;
  // [vertex] world direction in which u grows, mean over its triangles
  std::vector<Vec3d> tangents_;
  std::vector<Vec3d> bitangents_;  // [vertex] the same of v
};

/// Is the hit point open towards a world direction for so many mm?
using OpenTowards = std::function<bool(const Vec3& direction, double distance)>;

/// The part of that below which shadow rays find, one per light; all of it with kShadowRays.
Rgb light_by_shadow_rays(const SurfaceHit& hit, const Vec3& wo, std::span<const Light> lights,
                         LightEstimator estimator, RandomStream& random, const OpenTowards& open);

/// Radiance towards `wo` (world) of light that arrives straight from the lights. It takes one
/// shadow ray per light. One more, for a direction drawn from the model, stands for all Gaussian
/// lights and environments, and one for every near light that the direction meets.
Rgb surface_direct_light(const SurfaceHit& hit, const Vec3& wo, std::span<const Light> lights,
                         LightEstimator estimator, RandomStream& random, const OpenTowards& open);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_CLOTH_H_
