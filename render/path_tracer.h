#ifndef HEDDLE_RENDER_PATH_TRACER_H_
#define HEDDLE_RENDER_PATH_TRACER_H_
// The reference: eye paths among the shell-mapped explicit fibers, by the same walk and the same
// BCSDF as the transfer stage. Light is found by shadow rays at every vertex and by paths that
// escape. The power heuristic combines them (Veach 1997). `single` is light scattered once,
// `multiple` the rest.
//
// In local pictures, paths end where they leave the shell, but the shadows of all cloth and meshes
// stay. That is what the precomputed methods claim to match. Surface cloths are lit directly, past
// the fibers (surface_cloth.h). Paths go on from coloured meshes, which local pictures show lit
// directly. Random numbers are addressed by (seed, pixel of the full frame,
// sample) and sums run in sample order. So a picture depends neither on threads nor on the crop.
// Tested in tests/render/path_tracer_test.cpp.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/path_walk.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/cloth_trace.h"
#include "render/lights.h"
#include "render/pixel_filter.h"
#include "render/pixel_sums.h"
#include "render/render_output.h"
#include "render/walked_light.h"

namespace heddle {

struct PathTracerSettings {
  std::uint64_t seed = 1;
  bool local = false;
  LightEstimator estimator = LightEstimator::kCombined;
  WalkLimits limits;
  PixelFilter filter = {};
  std::size_t light_groups = 1;  // more: light is kept apart by Light::group
};

class PathTracer {
 public:
  /// materials: [ClothScene::materials()], see scene_materials(). reflecting: the same without TT,
  /// where its share is asked for. All references must outlive the tracer.
  PathTracer(const ClothScene& scene, std::span<const BcsdfTable> materials,
             std::span<const Light> lights, const Rgb& background,
             const PathTracerSettings& settings, std::span<const BcsdfTable> reflecting = {});

  using Sample = EyeSample;
  std::size_t light_groups() const { return settings_.light_groups; }
  const PixelFilter& filter() const { return settings_.filter; }
  bool tells_transmitted() const { return !reflecting_.empty(); }
  /// Radiance that comes back along one eye ray.
  Sample trace(const EyeRay& ray, RandomStream& random) const;
  /// The same by groups of lights: [light_groups()], background and alpha in the first.
  void trace(const EyeRay& ray, RandomStream& random, std::span<Sample> by_group) const;
  /// The same for light leaving a known vertex towards `wo`.
  Sample radiance(const ClothTrace::Vertex& vertex, const Vec3& wo, RandomStream& random) const;

 private:
  WalkedFrom walked_from() const {
    return {materials_, reflecting_, lights_, settings_.estimator, settings_.limits};
  }

  const ClothScene* scene_;
  std::span<const BcsdfTable> materials_;
  std::span<const BcsdfTable> reflecting_;
  std::span<const Light> lights_;
  std::vector<std::vector<Light>> lights_of_groups_;  // where there are several
  Rgb background_;
  PathTracerSettings settings_;
  ClothTrace trace_;
};

/// BCSDF tables of all materials of a scene.
std::vector<BcsdfTable> scene_materials(const ClothScene& scene);

/// The same fibers without their lobe TT.
std::vector<BcsdfTable> without_transmission(std::span<const BcsdfTable> materials);

/// Either a number of samples per pixel (even, at least 2) or a time. A timed picture is made of
/// whole passes of two samples per pixel, at least one. `more` may lengthen it.
struct SampleBudget {
  int spp = 2;
  std::optional<double> seconds;
  MoreSamples more = {};
};

/// Called between passes with the share done of the samples asked for so far, 0 .. 1; may throw to
/// stop.
using RenderProgress = std::function<void(double)>;

/// Beauty, single, multiple, alpha, half0 (even samples), half1 (odd samples), variance of the
/// pixel's mean; spp done. Light groups and `transmitted` where the tracer tells them; background
/// with either.
FrameBuffers trace_picture(const PathTracer& tracer, const Camera& camera, const PixelRect& crop,
                           std::uint64_t seed, const SampleBudget& budget,
                           const RenderProgress& progress);

}  // namespace heddle

#endif  // HEDDLE_RENDER_PATH_TRACER_H_
