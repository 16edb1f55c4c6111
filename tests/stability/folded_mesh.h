#ifndef HEDDLE_TESTS_STABILITY_FOLDED_MESH_H_
#define HEDDLE_TESTS_STABILITY_FOLDED_MESH_H_
// Cloth in folds z = a cos(x), one unit of length a millimetre, as a mesh with exact normals and as
// an OBJ file. The least radius of curvature, 1 / a, is at the crests and in the troughs.

#include <cmath>
#include <fstream>
#include <string>

#include "render/shell.h"

namespace heddle::stability {

class FoldedMesh {
 public:
  explicit FoldedMesh(double least_radius_mm) : height_(1 / least_radius_mm) {}

  /// One fold, 2 pi wide, 4 mm long.
  ClothMesh mesh() const {
    ClothMesh mesh;
    double length = 0;
    for (std::uint32_t i = 0; i <= kAcross; ++i) {
      const double x = 2 * kPi * i / kAcross;
      if (i > 0) length += (point(x) - point(x - 2 * kPi / kAcross)).norm();
      for (std::uint32_t j = 0; j <= kAlong; ++j) {
        mesh.positions.push_back(point(x) + Vec3d(0, 4.0 * j / kAlong, 0));
        mesh.normals.push_back(Vec3d(height_ * std::sin(x), 0, 1).normalized());
        mesh.fabric.emplace_back(length, 4.0 * j / kAlong);
      }
    }
    for (std::uint32_t i = 0; i < kAcross; ++i) {
      for (std::uint32_t j = 0; j < kAlong; ++j) {
        const std::uint32_t a = i * (kAlong + 1) + j;
        const std::uint32_t b = a + kAlong + 1;
        mesh.triangles.push_back({a, b, b + 1});
        mesh.triangles.push_back({a, b + 1, a + 1});
      }
    }
    return mesh;
  }

  /// The same in an OBJ file whose UVs are millimetres of fabric.
  void write(const std::string& path) const {
    const ClothMesh mesh = this->mesh();
    std::ofstream file(path);
    file.precision(12);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      file << "v " << mesh.positions[v].transpose() << "\nvt " << mesh.fabric[v].transpose()
           << "\nvn " << mesh.normals[v].transpose() << '\n';
    }
    for (const auto& triangle : mesh.triangles) {
      file << 'f';
      for (const std::uint32_t v : triangle) file << ' ' << v + 1 << '/' << v + 1 << '/' << v + 1;
      file << '\n';
    }
  }

  /// Share of the fold whose radius of curvature, (1 + z'^2)^(3/2) / |z''|, is less, along x.
  double share_tighter_than(double radius_mm) const {
    constexpr int kSteps = 20000;
    int tight = 0;
    for (int k = 0; k < kSteps; ++k) {
      const double x = 2 * kPi * (k + 0.5) / kSteps;
      const double slope = height_ * std::sin(x);
      tight +=
          std::pow(1 + slope * slope, 1.5) < radius_mm * height_ * std::abs(std::cos(x)) ? 1 : 0;
    }
    return static_cast<double>(tight) / kSteps;
  }

 private:
  static constexpr std::uint32_t kAcross = 512;
  static constexpr std::uint32_t kAlong = 2;
  Vec3d point(double x) const { return {x, 0, height_ * std::cos(x)}; }
  double height_;
};

}  // namespace heddle::stability

#endif  // HEDDLE_TESTS_STABILITY_FOLDED_MESH_H_
