#ifndef HEDDLE_RENDER_SURFACE_MICROCYLINDER_H_
#define HEDDLE_RENDER_SURFACE_MICROCYLINDER_H_
// Cloth as threads in two directions: Sadeghi et al. 2013, "A practical microcylinder appearance
// model for cloth rendering", section 5, for one directional light:
//   R(wi, wo) = BRDF * (n . wi) = 1/Q sum_j a_j <f_s M P cos theta_i>_j
//   Q = sum_j a_j <P>_j + (1 - sum_j a_j) (wo . n)
// < >_j is the mean over the tangent curve of thread j. M (eq. 7-9) is shadowing and masking, P
// (eq. 11-13) the projected lengths. Q depends on wi, so 1/Q stands inside the integral over light
// (eq. 14 prints it outside). R = 0 where Q = 0. Tangents with M P = 0 are left out before the
// division by cos^2 theta_d.
//
// Means over tangent curves are integrals over the tangent's angle (tangent_curve.h). Their panels
// end where M or P change form, and resolve the lobes. The relative error is below 1e-6 against 16
// times as many panels, 1e-5 beyond 89 degrees. A few equally spaced samples instead show
// highlights that are not there. Everything is double; eval asks the same functions.
//
// The published model is neither reciprocal nor energy conserving, and unbounded for opposite
// grazing directions: figures in docs/surface-models.md. Tested in
// tests/render/surface/microcylinder_test.cpp.

#include <memory>
#include <vector>

#include "render/surface/surface_model.h"
#include "render/surface/tangent_curve.h"
#include "render/surface/thread_scattering.h"

namespace heddle {

struct MicrocylinderThread {
  int direction = 1;  // 1: along x, 2: along y
  ThreadParameters scattering;
  double share = 0.5;  // a: of the patch's area
  // [n] tangent curve: angle from the cloth, radians, rising along the direction
  std::vector<double> offsets = {0, 0};
  std::vector<double> lengths = {1};  // [n - 1] arc lengths in between, any unit
};

struct MicrocylinderFabric {
  ThreadConventions conventions;
  // R scaled, by a factor for each wi, so that no more light leaves than arrives
  bool energy_safe = false;
  std::vector<MicrocylinderThread> threads;
};

/// Reads the keys of configs/README.md, "Microcylinder"; does not call finish(). Errors:
/// ConfigError with its place.
MicrocylinderFabric read_microcylinder_fabric(const TomlTable& document);

class Microcylinder final : public SurfaceModel {
 public:
  explicit Microcylinder(const MicrocylinderFabric& fabric);
  ~Microcylinder() override;

  Rgbd reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const override;

  /// Adaptive cubature over the light, to 2e-3 of the largest channel; 1 to 20 ms.
  Rgbd reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                    const Vec3d& wo) const override;

  /// A mixture of uniform directions over the hemisphere and of lobes about the mirror cones of
  /// tangents of the curves. Lobes are chosen by their contribution towards wo.
  std::optional<SurfaceSample> sample(const SurfacePoint& point, const Vec3& wo,
                                      RandomStream& random) const override;
  float pdf(const SurfacePoint& point, const Vec3& wi, const Vec3& wo) const override;

  /// R = published() * energy_scale(); reflected() without refinements. Every refinement halves all
  /// panels: two leave 1e-12.
  Rgbd published(const Vec3d& wi, const Vec3d& wo, int refinements = 0) const;
  /// 1 unless the fabric is energy safe.
  double energy_scale(const Vec3d& wi) const;

  /// Share of the light from wi that is reflected: the integral over wo of R(wi, wo) (n . wo),
  /// divided by n . wi. To 0.2 %.
  Rgbd directional_albedo(const Vec3d& wi) const;

 private:
  struct Thread;
  struct Lobes;
  class EnergyTable;

  /// Density of sample() in double.
  double density(const Vec3d& wi, const Vec3d& wo) const;

  std::vector<Thread> threads_;
  double gap_ = 0;                                   // share of the patch without thread
  std::unique_ptr<const EnergyTable> energy_table_;  // null: published form
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_MICROCYLINDER_H_
