#ifndef HEDDLE_RENDER_SURFACE_SURFACE_MODEL_H_
#define HEDDLE_RENDER_SURFACE_SURFACE_MODEL_H_
// A cloth seen as a surface: what one point of it reflects, without any fibers. The models are in
// the files beside this one. A fabric config names its model by the key `model`.
//
// Patch frame: x = thread 1 (weft), y = thread 2 (warp), z = the normal of the side that is looked
// at. Directions are unit vectors that point away from the surface. Light reaches and leaves the
// upper side only: all functions are 0 unless wi.z > 0 and wo.z > 0. Evaluation is thread-safe.
// Tested in tests/render/surface/.

#include <memory>
#include <optional>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"
#include "formats/toml_table.h"

namespace heddle {

/// Where on the flat cloth, and how much of it one sample of a picture stands for.
struct SurfacePoint {
  Vec2 position_mm = Vec2::Zero();  // along thread 1 and thread 2
  float footprint_mm = 0;           // diameter of the pixel on the cloth; 0: a point
};

/// A direction to light with its density.
struct SurfaceSample {
  Vec3 wi;
  Rgb weight;  // reflected(wi, wo) / pdf
  float pdf;   // 1/sr
};

class SurfaceModel {
 public:
  virtual ~SurfaceModel() = default;

  /// BRDF (or BTF) * (n . wi), rgb, 1/sr: radiance towards wo under a directional light of
  /// perpendicular irradiance 1 from wi.
  virtual Rgbd reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const = 0;

  /// Radiance towards wo under an unshadowed spherical Gaussian light of irradiance 1: the integral
  /// over the upper hemisphere of reflected() * G(wi; axis, sharpness) / M(sharpness). Closed form
  /// or quadrature that converges.
  virtual Rgbd reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                            const Vec3d& wo) const = 0;

  /// Draws wi for a given wo with wo.z > 0; nothing where the draw falls below the surface or the
  /// density is 0.
  virtual std::optional<SurfaceSample> sample(const SurfacePoint& point, const Vec3& wo,
                                              RandomStream& random) const = 0;

  /// Density (1/sr) with which sample() draws wi.
  virtual float pdf(const SurfacePoint& point, const Vec3& wi, const Vec3& wo) const = 0;
};

/// The model that a surface fabric's config describes, finish() included. Keys: configs/README.md.
/// Errors: ConfigError with its place.
std::unique_ptr<const SurfaceModel> read_surface_model(const TomlTable& document);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_SURFACE_MODEL_H_
