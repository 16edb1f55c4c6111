#include "pipeline/accuracy/swatch.h"

#include <algorithm>
#include <cmath>

namespace heddle {
namespace {

// The camera is so far away that its rays are parallel, as far as fibers can tell.
constexpr double kCameraDistance = 500;  // mm
// Beyond what is seen: further than light travels in cloth.
constexpr double kMargin = 10;  // mm

// Folds: a sine wave along x, slopes up to 35 degrees, unrolled without stretch. Of the size that
// drapes have; steeper ones (55 degrees) are worse than drapes and cylinders are (silk under a
// lamp: 90 % where a cylinder errs by 16).
constexpr double kWaveLength = 40;   // mm
constexpr double kWaveHeight = 4.5;  // mm, of its crests over the middle
constexpr double kBentSize = 160;    // mm

Vec3d direction_of(double theta_deg, double phi_deg) {
  const double theta = radians(theta_deg);
  const double phi = radians(phi_deg);
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// A sheet in folds, in the middle of the tile's copies.
ClothMesh folded_cloth() {
  constexpr int kAlong = 192;
  constexpr int kAcross = 24;
  ClothMesh mesh;
  const double wave_number = 2 * kPi / kWaveLength;
  const auto slope = [&](double x) {
    return kWaveHeight * wave_number * std::cos(wave_number * x);
  };
  double length = 0;  // along the sheet
  for (int i = 0; i <= kAlong; ++i) {
    const double step = kBentSize / kAlong;
    const double x = (static_cast<double>(i) / kAlong - 0.5) * kBentSize;
    if (i > 0) length += step * std::hypot(1.0, slope(x - 0.5 * step));
    for (int j = 0; j <= kAcross; ++j) {
      const double y = (static_cast<double>(j) / kAcross - 0.5) * kBentSize;
      mesh.positions.emplace_back(x, y, kWaveHeight * std::sin(wave_number * x));
      mesh.normals.push_back(Vec3d(-slope(x), 0, 1).normalized());
      mesh.fabric.emplace_back(length, y);
    }
  }
  const auto vertex = [](int i, int j) {
    return static_cast<std::uint32_t>(i * (kAcross + 1) + j);
  };
  for (int i = 0; i < kAlong; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
      mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
    }
  }
  return mesh;
}

Camera square_camera(const ViewAndLight& pair, const Vec3d& place, double width_mm, int pixels) {
  CameraConfig camera;
  camera.look_at = place;
  camera.position = place + kCameraDistance * direction_of(pair.view_theta, pair.view_phi);
  camera.up = Vec3d(0.3, 1, 0);
  camera.fov = 2 * std::atan(0.5 * width_mm / kCameraDistance);
  camera.fov_axis = FovAxis::kHorizontal;
  camera.width = camera.height = pixels;
  return Camera(camera);
}

}  // namespace

double mean_cosine(std::span<const ViewAndLight> pairs) {
  double sum = 0;
  for (const ViewAndLight& pair : pairs) sum += std::cos(radians(pair.light_theta));
  return sum / static_cast<double>(pairs.size());
}

ViewAndLight from_behind(ViewAndLight pair) {
  pair.light_theta = 180 - pair.light_theta;
  return pair;
}

Light light_of(double sharpness, const ViewAndLight& pair) {
  Light light;
  light.type =
      sharpness >= kDirectionalSharpness ? LightType::kDirectional : LightType::kSphericalGaussian;
  light.sharpness = static_cast<float>(sharpness);
  light.axis = direction_of(pair.light_theta, pair.light_phi).cast<float>();
  return light;
}

Swatch::Swatch(const Exemplar& exemplar, std::uint64_t seed, const AccuracyEffort& effort)
    : seed_(seed), effort_(effort) {
  // As wide as the fibers, in the mean over segments.
  double diameter = 0;
  for (std::uint32_t segment = 0; segment < exemplar.segment_count(); ++segment) {
    diameter += 2.0 * static_cast<double>(exemplar.radius_mm[exemplar.segment_fiber[segment]]);
  }
  pixel_mm_ = diameter / static_cast<double>(exemplar.segment_count());
  const double size = 4 * (effort.pixels * pixel_mm_ + kMargin) +
                      2 * std::max(exemplar.width_mm, exemplar.height_mm);
  ClothConfig cloth;
  cloth.flat_width_mm = size;
  cloth.flat_height_mm = size;
  config_.cloths = {cloth};
  tile_mm_ = {exemplar.width_mm, exemplar.height_mm};
}

void Swatch::use_fibers(const std::shared_ptr<const TileScene>& tile) {
  config_.cloths[0].surface.reset();
  const ClothTiling tiling(tile);
  flat_.reset(new ClothScene(make_cloth_scene(config_, std::span(&tiling, 1))));
  bent_ = std::make_unique<ClothScene>(std::vector<ClothPiece>{{tile, folded_cloth(), true}},
                                       std::vector<TriangleMesh>{});
}

void Swatch::use_surface(const SurfaceFabric& surface) {
  config_.cloths[0].surface = surface;
  flat_.reset(new ClothScene(make_cloth_scene(config_, {})));
  std::vector<SurfaceCloth> surfaces;
  surfaces.emplace_back(surface.model, folded_cloth());
  bent_ = std::make_unique<ClothScene>(std::vector<ClothPiece>{}, std::vector<TriangleMesh>{},
                                       std::move(surfaces));
}

Camera Swatch::camera(std::size_t pair) const {
  const auto index = static_cast<double>(pair);
  return square_camera(kPairs[pair],
                       {index * 0.754877 * tile_mm_[0], index * 0.569840 * tile_mm_[1], 0},
                       effort_.pixels * pixel_mm_, effort_.pixels);
}

Camera Swatch::bent_camera(std::size_t pair, int pixels) {
  return square_camera(kBentPairs[pair], {0, 0, 0}, kBentSeen, pixels);
}

}  // namespace heddle
