#ifndef HEDDLE_RENDER_SURFACE_WOVEN_COTTON_H_
#define HEDDLE_RENDER_SURFACE_WOVEN_COTTON_H_
// Irawan and Marschner 2006: every visible thread segment carries an elliptical highlight that
// slides with the half vector. Near, that is a texture (BTF). Far, its mean over the weave is a
// BRDF in closed form.
//
// BTF = diffuse + specular I F G / ((n . wi)(n . wo)), without 1/pi or 1/4, as printed. In the BRDF
// the share of the window that the ellipse fills stands in place of I. Ellipse parameters are per
// system. A window is as long as its float.
//
// From near to far: the value is the mean of the BTF over the footprint of
// WovenPattern::visit_footprint, in closed form (the common area of ellipse, square and segment).
// Both ends are exact, and at every footprint the mean of the values over a repeat is the BRDF.
//
// Irregular cloth: each segment (or each yarn) draws one of kVariants perturbations of its ellipse,
// whose mean is 0 in every parameter. The BRDF is the mean over the variants, as an endless cloth
// shows it. Tested in tests/render/surface/woven_cotton_test.cpp.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "render/surface/woven_model.h"
#include "render/surface/woven_pattern.h"
#include "render/surface/woven_segment.h"

namespace heddle {

/// Of warp or weft.
struct CottonYarn {
  Rgbd diffuse = Rgbd::Zero();   // k_d
  Rgbd specular = Rgbd::Zero();  // k_s
  double semimajor = 0.0;
  double eccentricity = 0.0;
  double angle = 0.0;
  Vec2d k = Vec2d::Zero();
};

/// Standard deviations of the perturbations, which are evenly distributed.
struct WovenIrregularity {
  double angle = 0.0;     // of the ellipse, radians
  double shift = 0.0;     // of its centre, in sides of the window
  double size = 0.0;      // of its semimajor axis, relative
  bool per_yarn = false;  // one draw for all segments of a yarn instead of one for each
  std::uint64_t seed = 1;
};

struct WovenCottonParameters {
  double unit_mm = 1.0;  // what the lengths of pattern and ellipses count
  double ior = 1.5;
  WovenPattern pattern;
  std::array<CottonYarn, 2> yarns;  // [YarnSystem]
  std::optional<WovenIrregularity> irregularity;
  /// Less diffuse light where a yarn has more than 0.95, and highlights scaled by energy_scale.h
  /// for both directions. Then the mean over the cloth returns no more than arrives, and everything
  /// stays reciprocal; points may still flash.
  bool energy_safe = false;
};

class WovenCotton final : public WovenModel {
 public:
  static constexpr int kVariants = 16;

  explicit WovenCotton(WovenCottonParameters parameters);

  const WovenCottonParameters& parameters() const { return parameters_; }

  Rgbd reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const override;
  /// Adaptive quadrature (integrate_sg_light, its default settings).
  Rgbd reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                    const Vec3d& wo) const override;

 private:
  // A FootprintPart of one variant.
  struct Piece {
    const WovenSegment* segment;
    YarnSystem system;
    Rectangle part;
    bool is_point;
    double weight;
  };
  void visit_pieces(const SurfacePoint& point,
                    const std::function<void(const Piece&)>& visitor) const;
  /// Of a highlight, with reflectance and geometry; 1 inside it.
  double highlight(const Vec3d& wi, const Vec3d& wo) const;
  Rgbd reflected_by(const Piece& piece, const Vec2d& half, double cos_i, double reflectance) const;
  /// Half the draws by cosine, half by a half vector that is uniform (in x and y) where highlights
  /// can lie.
  std::optional<Vec3d> draw(double choice, double a, double b, const Vec3d& wo) const override;
  double density(const Vec3d& wi, const Vec3d& wo) const override;
  EnergyScale make_energy_scale() const;
  const WovenSegment& segment_of(const PlacedFloat& placed) const;

  WovenCottonParameters parameters_;
  int variants_;                        // 1 or kVariants
  std::vector<WovenSegment> segments_;  // [kind][variant]
  // [kind] the half vectors with a highlight: |x|, |y| at most
  std::vector<Vec2d> half_range_;
  std::optional<EnergyScale> energy_scale_;
};

WovenCottonParameters read_woven_cotton(const TomlTable& document);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_WOVEN_COTTON_H_
