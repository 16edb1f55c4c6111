#ifndef HEDDLE_RENDER_TRIANGLE_SCENE_H_
#define HEDDLE_RENDER_TRIANGLE_SCENE_H_
// Ray queries on triangle meshes in world space (millimetres): the meshes of a scene, and the outer
// faces of its cloth shells. The only place that includes Embree for triangles. Float positions:
// good to about 1e-7 of their distance from the origin. Tested in
// tests/render/triangle_scene_test.cpp.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

struct TriangleMesh {
  std::vector<Vec3> positions;                          // [vertex] mm
  std::vector<std::array<std::uint32_t, 3>> triangles;  // [triangle] vertex indices
};

class TriangleScene {
 public:
  explicit TriangleScene(const std::vector<TriangleMesh>& meshes);
  ~TriangleScene();
  TriangleScene(const TriangleScene&) = delete;
  TriangleScene& operator=(const TriangleScene&) = delete;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  struct Hit {
    float t;
    std::uint32_t mesh;
    std::uint32_t triangle;
    float u, v;  // the point is (1 - u - v) a + u b + v c of the triangle a, b, c
  };
  /// The first triangle in (0, t_max]; direction of unit length.
  std::optional<Hit> intersect(const Vec3& origin, const Vec3& direction,
                               float t_max = kInfinity) const;
  bool occluded(const Vec3& origin, const Vec3& direction, float t_max = kInfinity) const;

  struct Crossing {
    float t;
    std::uint32_t mesh;
    std::uint32_t triangle;
  };
  /// Every triangle crossed in [0, t_max], ordered by (t, mesh, triangle). `result` is overwritten.
  void crossings(const Vec3& origin, const Vec3& direction, float t_max,
                 std::vector<Crossing>& result) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_TRIANGLE_SCENE_H_
