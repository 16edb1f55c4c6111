#ifndef HEDDLE_RENDER_SURFACE_WOVEN_MODEL_H_
#define HEDDLE_RENDER_SURFACE_WOVEN_MODEL_H_
// What the two woven models (woven_cotton.h, woven_yarns.h) share: sampling by a point of the unit
// cube, whatever the place on the cloth, and the energy scale of their highlights. Tested in
// tests/render/surface/woven_cotton_test.cpp and woven_yarns_test.cpp.

#include <functional>
#include <optional>

#include "render/surface/energy_scale.h"
#include "render/surface/surface_model.h"

namespace heddle {

class WovenModel : public SurfaceModel {
 public:
  std::optional<SurfaceSample> sample(const SurfacePoint& point, const Vec3& wo,
                                      RandomStream& random) const final;
  float pdf(const SurfacePoint& point, const Vec3& wi, const Vec3& wo) const final;

 protected:
  /// The direction that three numbers in [0, 1) stand for; nothing where there is none.
  virtual std::optional<Vec3d> draw(double choice, double a, double b, const Vec3d& wo) const = 0;
  /// Density of draw(), 1/sr.
  virtual double density(const Vec3d& wi, const Vec3d& wo) const = 0;

  /// Of the mean `highlights(wi, wo)` over the cloth, (n . wi) included, for which the diffuse
  /// light leaves `room`; by that many draws for each direction.
  EnergyScale energy_scale_of(
      const std::function<Rgbd(const Vec3d& wi, const Vec3d& wo)>& highlights, const Rgbd& room,
      int draws) const;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_WOVEN_MODEL_H_
