#ifndef HEDDLE_RENDER_SURFACE_WOVEN_YARNS_H_
#define HEDDLE_RENDER_SURFACE_WOVEN_YARNS_H_
// Irawan and Marschner 2012: specular reflection from the fibers of bent yarn segments; the rival
// of the microcylinder model.
//
// A segment is a tube of radius w/2 about a spine that is an arc of a conic. u is the inclination
// of the spine, in [-u_max, u_max], and v the angle around the yarn, in [-pi/2, pi/2]. Segment
// frame: x across the yarn, y along it, z up, origin in the middle. On the cloth y = u l / (2
// u_max) and x = v w / pi. Fibers wind about the spine at the twist angle. Twist 0 is a filament
// yarn, anything else a staple yarn.
//
// For two directions, the fibers that mirror one into the other lie on a curve: u(v) = const for
// filaments, v(u) for staples. The highlight is a band of constant width along it. Lengths are in
// units of the config. The absolute scale of the highlights goes with the square of the unit, as
// the mean over a segment is not divided by its area. `specular` absorbs it, or the option
// specular_is_albedo replaces it.
//
// The paper is not at hand. This model is derived from the geometry above and agrees with the terms
// that public renderers document (Mitsuba 0.x plugin "irawan", LuxCore "cloth").
// docs/surface-models.md says what is left out. Tested in
// tests/render/surface/woven_yarns_test.cpp.

#include <array>
#include <vector>

#include "render/surface/woven_model.h"
#include "render/surface/woven_pattern.h"

namespace heddle {

/// What the segments of warp or weft are made of.
struct YarnMaterial {
  Rgbd diffuse = Rgbd::Zero();   // k_d, the albedo of a Lambertian part
  Rgbd specular = Rgbd::Zero();  // k_s
  double uniform = 0.0;          // alpha: share of scattering that goes everywhere
  double forward = 0.0;          // beta: concentration of the forward scattering
  double twist = 0.0;            // psi, radians; 0: filament
  double max_inclination = 0.0;  // u_max, radians, in (0, pi/2)
  // kappa > -1 of the spine: 0 a circle; above, the middle is flatter; below, the ends
  double curvature = 0.0;
  // ss in [0, 1), filaments only: share of u_max over which the highlight fades
  double smoothing = 0.0;
  double highlight_width = 0.5;  // of the band, in (0, 1], relative to the segment
};

struct YarnSegment {
  YarnMaterial material;
  double width;   // across the yarn
  double length;  // along it

  /// Is the segment longer than the arc that its own thickness takes, width * sin(max_inclination)?
  /// Those that are not have no highlight: the weft of the public twill preset is one.
  bool has_spine() const;
};

/// Radius of curvature of the spine where its inclination is u, |u| <= u_max < pi/2. The spine
/// spans length - width sin(u_max) along y: the integral of R cos(u) du.
double spine_radius(const YarnSegment& segment, double u, double u_max);

/// Specular value at a point (x, y) of the segment without k_s, 1/sr in squares of the unit. Both
/// directions are in the segment's frame, above the cloth. Reciprocal; a step at the edges of the
/// band.
double yarn_highlight(const YarnSegment& segment, const Vec2d& point, const Vec3d& wi,
                      const Vec3d& wo);

/// Integral of yarn_highlight over a part of the segment. Filaments: Gauss-Legendre on a smooth
/// integrand; staples: panels cut where the curve begins and ends. Error relative to the largest
/// value over directions: below 1e-3.
double yarn_highlight_integral(const YarnSegment& segment, const Rectangle& part, const Vec3d& wi,
                               const Vec3d& wo);

struct WovenYarnsParameters {
  double unit_mm = 1.0;
  WovenPattern pattern;
  std::array<YarnMaterial, 2> yarns;  // [YarnSystem]
  /// Scales the highlights so that with k_s = 1 everywhere they return all light that comes evenly
  /// from the whole upper side, as LuxCore does. k_s up to 1 - k_d then keeps energy on that
  /// average, but not for every single direction.
  bool specular_is_albedo = false;
  /// As in WovenCottonParameters: for every single direction.
  bool energy_safe = false;
};

/// Each system's highlight is divided by its coverage, so that the far value is the sum of the two
/// systems' means. Near and far meet as in woven_cotton.h, in WovenPattern::visit_footprint.
class WovenYarns final : public WovenModel {
 public:
  explicit WovenYarns(WovenYarnsParameters parameters);

  const WovenYarnsParameters& parameters() const { return parameters_; }

  Rgbd reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const override;
  /// Adaptive quadrature (integrate_sg_light) to 1 %.
  Rgbd reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                    const Vec3d& wo) const override;

 private:
  /// Half the draws by cosine, half by a half vector perpendicular to the spine at an even
  /// inclination.
  std::optional<Vec3d> draw(double choice, double a, double b, const Vec3d& wo) const override;
  double density(const Vec3d& wi, const Vec3d& wo) const override;
  double highlight_albedo() const;
  /// Mean highlight of all segments of a kind, scaled.
  double far_highlight(std::size_t kind, const Vec3d& wi, const Vec3d& wo) const;
  EnergyScale make_energy_scale() const;

  WovenYarnsParameters parameters_;
  std::vector<YarnSegment> segments_;        // [kind]
  std::array<double, 2> inclination_range_;  // [YarnSystem] of the half vectors that sample() draws
  std::array<double, 2> highlight_scale_;    // [YarnSystem]
  std::optional<EnergyScale> energy_scale_;
};

WovenYarnsParameters read_woven_yarns(const TomlTable& document);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_WOVEN_YARNS_H_
