#ifndef HEDDLE_PIPELINE_ACCURACY_SWATCH_H_
#define HEDDLE_PIPELINE_ACCURACY_SWATCH_H_
// The swatches that accuracy tables are measured on: one flat, one in folds over black, with their
// views and lights. Tested in tests/pipeline/accuracy_test.cpp.

#include <array>
#include <memory>
#include <span>

#include "fibers/tracing/tile_scene.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/lights.h"
#include "render/scene_config.h"

namespace heddle {

/// How much is measured; less is for tests.
struct AccuracyEffort {
  int pixels = 32;        // along an edge of a flat picture, a power of two of at least 32
  int bent_pixels = 12;   // of a folded one
  int path_samples = 32;  // per pixel, flat; `bent_factor` times as many in folds; even
  int method_samples = 8;
  int bent_factor = 16;
};

inline constexpr double kSharpnesses[] = {3, 20, 150, 1000, kDirectionalSharpness};

/// Angles from the cloth's normal and about it, degrees.
struct ViewAndLight {
  double view_theta, view_phi;
  double light_theta, light_phi;
};
// Errors depend on how low the light stands more than on the view: as many pairs of low light as of
// high.
inline constexpr std::size_t kHeights = 2;
inline constexpr std::size_t kPairsOfHeight = 4;
inline constexpr ViewAndLight kPairs[kHeights * kPairsOfHeight] = {
    {30, 290, 60, 300}, {20, 340, 58, 130}, {70, 260, 65, 80}, {45, 90, 62, 200},    // low light
    {10, 20, 35, 80},   {40, 200, 20, 330}, {65, 150, 30, 20}, {50, 110, 40, 250}};  // high

inline constexpr double kBentSeen = 48;  // mm across a picture of the folds
inline constexpr ViewAndLight kBentPairs[] = {
    {20, 60, 40, 190}, {45, 320, 55, 100}, {60, 130, 35, 20}, {40, 200, 65, 330}};

double mean_cosine(std::span<const ViewAndLight> pairs);
ViewAndLight from_behind(ViewAndLight pair);
Light light_of(double sharpness, const ViewAndLight& pair);

/// One fabric, or a surface model in its place.
class Swatch {
 public:
  Swatch(const Exemplar& exemplar, std::uint64_t seed, const AccuracyEffort& effort);

  double pixel_mm() const { return pixel_mm_; }  // the fibers' mean diameter
  std::uint64_t seed() const { return seed_; }
  const AccuracyEffort& effort() const { return effort_; }

  void use_fibers(const std::shared_ptr<const TileScene>& tile);
  void use_surface(const SurfaceFabric& surface);
  const ClothScene& scene(bool bent) const { return bent ? *bent_ : *flat_; }

  /// Each pair of kPairs looks at another part of the tile.
  Camera camera(std::size_t pair) const;
  static Camera bent_camera(std::size_t pair, int pixels);

 private:
  std::uint64_t seed_;
  AccuracyEffort effort_;
  SceneConfig config_;
  std::array<double, 2> tile_mm_{};
  double pixel_mm_ = 0;
  std::unique_ptr<ClothScene> flat_;
  std::unique_ptr<ClothScene> bent_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ACCURACY_SWATCH_H_
