#include "render/yarn_drift.h"

#include <fmt/format.h>

#include <cmath>
#include <unordered_map>
#include <utility>

#include "fibers/math/random.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"

namespace heddle {
namespace {

constexpr int kWaves = 48;  // of each direction: their sum is close to normal
constexpr double kOctaves = 2;
// Edges of a mesh in the shortest wave: linear pieces then leave 8 % of its amplitude at most.
constexpr double kEdgesPerWave = 8;
// Of a shell per triangle, while it is built.
constexpr std::uint64_t kShellBytesPerTriangle = 1200;

constexpr std::uint32_t kUncut = 0xffffffffU;

/// The middles of cut edges.
class EdgeMiddles {
 public:
  EdgeMiddles(ClothMesh& mesh, double longest_mm) : mesh_(&mesh), longest_mm_(longest_mm) {}

  /// The vertex in the middle of a long edge, or kUncut.
  std::uint32_t of(std::uint32_t a, std::uint32_t b) {
    if (!((mesh_->fabric[a] - mesh_->fabric[b]).norm() > longest_mm_)) return kUncut;
    const auto [low, high] = std::minmax(a, b);
    const auto [place, is_new] =
        vertex_.try_emplace(static_cast<std::uint64_t>(low) << 32U | high,
                            static_cast<std::uint32_t>(mesh_->positions.size()));
    if (is_new) {
      mesh_->positions.emplace_back(0.5 * (mesh_->positions[low] + mesh_->positions[high]));
      mesh_->fabric.emplace_back(0.5 * (mesh_->fabric[low] + mesh_->fabric[high]));
      const Vec3d normal = mesh_->normals[low] + mesh_->normals[high];
      mesh_->normals.push_back(normal.norm() > 0 ? Vec3d(normal.normalized()) : Vec3d(0, 0, 1));
    }
    return place->second;
  }

 private:
  ClothMesh* mesh_;
  double longest_mm_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_;
};

/// Cuts a triangle at the middles of its edges; middle[k] lies between corners k and k + 1.
void cut(const ClothMesh& mesh, std::array<std::uint32_t, 3> corner,
         std::array<std::uint32_t, 3> middle,
         std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const auto is_cut = [&](std::size_t k) { return middle[k] != kUncut; };
  const int cuts = (is_cut(0) ? 1 : 0) + (is_cut(1) ? 1 : 0) + (is_cut(2) ? 1 : 0);
  if (cuts == 0) {
    triangles.push_back(corner);
    return;
  }
  if (cuts == 3) {
    for (std::size_t k = 0; k < 3; ++k)
      triangles.push_back({corner[k], middle[k], middle[(k + 2) % 3]});
    triangles.push_back(middle);
    return;
  }
  // Turned so that edge 0 is the cut one, or edge 2 the uncut one.
  std::size_t first = 0;
  while (cuts == 1 ? !is_cut(first) : is_cut((first + 2) % 3)) ++first;
  std::rotate(corner.begin(), corner.begin() + static_cast<std::ptrdiff_t>(first), corner.end());
  std::rotate(middle.begin(), middle.begin() + static_cast<std::ptrdiff_t>(first), middle.end());
  if (cuts == 1) {
    triangles.push_back({corner[0], middle[0], corner[2]});
    triangles.push_back({middle[0], corner[1], corner[2]});
    return;
  }
  triangles.push_back({middle[0], corner[1], middle[1]});
  // The rest has four corners: it is cut along its shorter diagonal.
  const auto length = [&](std::uint32_t a, std::uint32_t b) {
    return (mesh.fabric[a] - mesh.fabric[b]).squaredNorm();
  };
  if (length(corner[0], middle[1]) <= length(middle[0], corner[2])) {
    triangles.push_back({corner[0], middle[0], middle[1]});
    triangles.push_back({corner[0], middle[1], corner[2]});
  } else {
    triangles.push_back({corner[0], middle[0], corner[2]});
    triangles.push_back({middle[0], middle[1], corner[2]});
  }
}

}  // namespace

YarnDrift::YarnDrift(const YarnDriftConfig& config) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    RandomStream random(config.seed, RandomStage::kYarnDrift, axis, 0);
    for (int n = 0; n < kWaves; ++n) {
      // Strata keep the lengths evenly spread.
      const double longer = std::exp2(kOctaves * (n + random.uniform_double()) / kWaves);
      const double across = 2 * kPi / (config.across_mm * longer);
      const double along = (random.uniform_double() < 0.5 ? -2 : 2) * kPi /
                           (config.along_mm * std::exp2(kOctaves * random.uniform_double()));
      Wave wave;
      wave.k = axis == 0 ? Eigen::Vector2d(across, along) : Eigen::Vector2d(along, across);
      wave.phase = 2 * kPi * random.uniform_double();
      wave.amplitude = config.spacing_rms * std::sqrt(2.0 / kWaves) / across;
      waves_[axis].push_back(wave);
    }
  }
}

Eigen::Vector2d YarnDrift::shift(const Eigen::Vector2d& fabric) const {
  Eigen::Vector2d sum(0, 0);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (const Wave& wave : waves_[axis]) {
      sum[static_cast<Eigen::Index>(axis)] +=
          wave.amplitude * std::cos(wave.k.dot(fabric) + wave.phase);
    }
  }
  return sum;
}

ClothMesh refined(ClothMesh mesh, double longest_mm) {
  for (bool is_done = false; !is_done;) {
    const std::size_t before = mesh.triangles.size();
    std::vector<std::array<std::uint32_t, 3>> triangles;
    EdgeMiddles middles(mesh, longest_mm);
    for (const std::array<std::uint32_t, 3>& t : mesh.triangles) {
      cut(mesh, t, {middles.of(t[0], t[1]), middles.of(t[1], t[2]), middles.of(t[2], t[0])},
          triangles);
      if (triangles.size() > kMaxDriftTriangles) {
        throw ConfigError(fmt::format(
            "yarn_drift: expected waves that {} triangles of the cloth resolve; edges of {:.3g} mm "
            "take more. A longer across_mm, or a smaller cloth, takes fewer",
            kMaxDriftTriangles, longest_mm));
      }
    }
    mesh.triangles = std::move(triangles);
    is_done = mesh.triangles.size() == before;
  }
  return mesh;
}

ClothMesh with_yarn_drift(ClothMesh mesh, const YarnDriftConfig& config) {
  mesh = refined(std::move(mesh), config.across_mm / kEdgesPerWave);
  require_memory(
      kShellBytesPerTriangle * mesh.triangles.size(),
      fmt::format("cloth of {} triangles that resolve yarn_drift", mesh.triangles.size()));
  const YarnDrift drift(config);
  for (Eigen::Vector2d& fabric : mesh.fabric) fabric += drift.shift(fabric);
  return mesh;
}

}  // namespace heddle
