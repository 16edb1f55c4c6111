#ifndef HEDDLE_RENDER_SURFACE_PAINT_H_
#define HEDDLE_RENDER_SURFACE_PAINT_H_
// What a coloured mesh is painted with: an even, diffuse colour under a gloss.
//
// The gloss is a microfacet lobe: isotropic GGX, alpha = roughness^2, with the height-correlated
// masking of Smith (Walter et al. 2007; Heitz 2014) and Schlick's Fresnel term from the reflectance
// at normal incidence. It scatters once between facets; a rough gloss of high reflectance therefore
// loses some light. The colour below takes what the gloss leaves, in the symmetric form of Kelemen
// and Szirmay-Kalos 2001:
//
//   f = D F G / (4 cos_i cos_o) + color / pi (1 - E(cos_i)) (1 - E(cos_o)) / (1 - E_mean)
//
// E(cos) is the share of light that the gloss reflects, E_mean its cosine-weighted mean. So a white
// colour under any gloss reflects all light, no paint reflects more, and f is reciprocal. E is
// linear in the reflectance and tabulated over cos. Tested in tests/render/surface/paint_test.cpp.

#include <array>
#include <optional>

#include "render/surface/surface_model.h"

namespace heddle {

struct PaintConfig {
  Rgbd color = Rgbd::Zero();  // diffuse reflectance where nothing is lost to the gloss, 0 .. 1
  std::optional<double> roughness;          // of the gloss, kLeastRoughness .. 1; none: matte
  Rgbd reflectance = Rgbd::Constant(0.04);  // of the gloss at normal incidence, 0 .. 1

  static constexpr double kLeastRoughness = 0.05;
};

class Paint final : public SurfaceModel {
 public:
  explicit Paint(const PaintConfig& config);

  Rgbd reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const override;
  Rgbd reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                    const Vec3d& wo) const override;
  std::optional<SurfaceSample> sample(const SurfacePoint& point, const Vec3& wo,
                                      RandomStream& random) const override;
  float pdf(const SurfacePoint& point, const Vec3& wi, const Vec3& wo) const override;

  /// Share of the light from an inclination that the gloss reflects.
  Rgbd gloss_albedo(double cosine) const;

 private:
  static constexpr int kCells = 128;  // of cos in [0, 1]

  void fill_table();
  Rgbd gloss(const Vec3d& wi, const Vec3d& wo) const;  // without cos_i
  double gloss_pdf(const Vec3d& wi, const Vec3d& wo) const;
  Vec3d draw_gloss(const Vec3d& wo, double u0, double u1) const;
  /// Share of the draws that go to the gloss.
  double gloss_share(double cos_out) const;

  PaintConfig config_;
  double alpha_ = 1;
  // [k] at cos = k / kCells: E = reflectance * plain + grazing
  std::array<double, kCells + 1> plain_ = {};
  std::array<double, kCells + 1> grazing_ = {};
  Rgbd below_ = Rgbd::Zero();  // color / (1 - E_mean)
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_PAINT_H_
