#ifndef HEDDLE_RENDER_SURFACE_INTERACTIVE_MICROCYLINDER_H_
#define HEDDLE_RENDER_SURFACE_INTERACTIVE_MICROCYLINDER_H_
// The microcylinder model under spherical Gaussian lights with shadows, fast enough to turn a
// camera. Iwasaki, Mizutani, Dobashi and Nishita 2014, "Interactive cloth rendering of
// microcylinder appearance model under environment lighting".
//
// Radiance = sum over lights and tangents of (averaged weights) * (smooth factors) * (two circular
// Gaussians clipped by the border of what is visible). The light's Gaussian is one in theta and one
// in phi of the thread (eq. 11). A lobe of the thread is one in theta. Their product is integrated
// on the visible side of a line (clipped_gaussians). Weights come from a WeightingTable, the line
// from DistanceMaps. Neither depends on the threads' colours, indices and widths, so those can be
// edited at once.
//
// `printed` computes everything as in the paper: smooth factors at the means (theta_l, phi_k),
// weights averaged over the light (eq. 9), and eq. 13 times the logistic function of eq. 14.
// Otherwise smooth factors are averaged over the Gaussians, weights are those around the product of
// light and lobe, and the clipped integral is exact. A tangent that stands for a piece of a curve
// then has its lobes widened by that piece. Errors of both: docs/surface-models.md. Shading is
// thread-safe. Tested in tests/render/surface/interactive_microcylinder_test.cpp.

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "render/lights.h"
#include "render/surface/distance_maps.h"
#include "render/surface/microcylinder.h"
#include "render/surface/weighting_table.h"

namespace heddle {

struct InteractiveSettings {
  Weighting weighting = Weighting::kConsistent;
  bool printed = false;
  int most_tangents = 16;  // per thread
  WeightingTableSettings table;
};

/// What a point sees of the scene around it; without maps, everything above its horizon.
struct PointVisibility {
  const DistanceMaps* maps = nullptr;
  std::span<const float> coefficients = {};
};

class InteractiveMicrocylinder {
 public:
  InteractiveMicrocylinder(const MicrocylinderFabric& fabric, const InteractiveSettings& settings);
  /// With the table that was built for tangent_samples() of this fabric.
  InteractiveMicrocylinder(const MicrocylinderFabric& fabric, const InteractiveSettings& settings,
                           WeightingTable table);
  ~InteractiveMicrocylinder();

  /// Changes a thread's scattering. Tangents stay where they are.
  void set_scattering(std::size_t thread, const ThreadParameters& parameters);

  /// Radiance towards wo (world, unit) of a point whose frame is world = frame * patch; lights in
  /// world space. Directional lights are visible or not. Eight terms at a time in single precision,
  /// without those that hold 1e-3 of the light together; `printed` as shade_in_double().
  Rgbd shade(const Mat3d& frame, const Vec3d& wo, std::span<const Light> lights,
             const PointVisibility& visibility) const;
  /// The same, all terms one after another in double.
  Rgbd shade_in_double(const Mat3d& frame, const Vec3d& wo, std::span<const Light> lights,
                       const PointVisibility& visibility) const;

  /// What shade() approximates, for one direction: R of microcylinder.h for these tangents and
  /// weights, patch frame.
  Rgbd reflected(const Vec3d& wi, const Vec3d& wo) const;

  const std::vector<TangentSample>& tangents() const { return samples_; }
  const WeightingTable& table() const { return table_; }

 private:
  struct Tangent;
  struct Lobe;
  struct Around;
  struct Terms;
  struct LightLanes;

  void prepare();
  static std::array<Lobe, 3> lobes_of(const ThreadScattering& scattering);
  double clipped(const Around& around, const PointVisibility& visibility) const;
  Rgbd directional_light(const Mat3d& frame, const Vec3d& out, std::span<const Light> lights,
                         const PointVisibility& visibility) const;
  /// shade(): the products of all Gaussian lights with the lobes of tangent t, and an estimate of
  /// what each sends to `out` (patch frame), which is added to `total`.
  void find_terms(std::size_t t, const Vec3d& out, const LightLanes& lights, Terms& own,
                  float& total) const;
  /// shade(): adds what the terms of tangent t send to `out`.
  void add_terms(std::size_t t, const Vec3d& out, const WeightingTable::Outgoing& outgoing,
                 const LightLanes& lights, const PointVisibility& visibility, const Terms& own,
                 Rgbd& radiance) const;

  MicrocylinderFabric fabric_;
  InteractiveSettings settings_;
  std::vector<TangentSample> samples_;
  WeightingTable table_;
  std::vector<Tangent> tangents_;
  std::unique_ptr<const SigmoidGains> gains_;  // printed only
};

/// The truth for shade(): every Gaussian light integrated by strata * strata directions of equal
/// shares of it, each with its own ray. `reflected` in the patch frame, `visible` in world space.
Rgbd ray_traced_radiance(const std::function<Rgbd(const Vec3d& wi, const Vec3d& wo)>& reflected,
                         const Mat3d& frame, const Vec3d& wo, std::span<const Light> lights,
                         const std::function<bool(const Vec3& direction)>& visible, int strata);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_INTERACTIVE_MICROCYLINDER_H_
