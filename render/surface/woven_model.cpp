#include "render/surface/woven_model.h"

#include "render/surface/woven_segment.h"

namespace heddle {

std::optional<SurfaceSample> WovenModel::sample(const SurfacePoint& point, const Vec3& wo,
                                                RandomStream& random) const {
  const Vec3d out = wo.cast<double>();
  const double choice = random.uniform_double();
  const double a = random.uniform_double();
  const double b = random.uniform_double();
  const std::optional<Vec3d> wi = draw(choice, a, b, out);
  if (!wi) return std::nullopt;
  const double probability = density(*wi, out);
  if (!(probability > 0.0)) return std::nullopt;
  const Rgbd value = reflected(point, *wi, out);
  return SurfaceSample{wi->cast<float>(), (value / probability).cast<float>(),
                       static_cast<float>(probability)};
}

float WovenModel::pdf(const SurfacePoint& /*point*/, const Vec3& wi, const Vec3& wo) const {
  return static_cast<float>(density(wi.cast<double>(), wo.cast<double>()));
}

EnergyScale WovenModel::energy_scale_of(
    const std::function<Rgbd(const Vec3d& wi, const Vec3d& wo)>& highlights, const Rgbd& room,
    int draws) const {
  return EnergyScale([&](const Vec3d& wo) {
    Rgbd sum = Rgbd::Zero();
    for (int n = 0; n < draws; ++n) {
      const Vec3d place = lattice_point(n);
      const std::optional<Vec3d> wi = draw(place.x(), place.y(), place.z(), wo);
      if (!wi || !(wi->z() > 0) || !((*wi + wo).norm() > kShortestSum)) continue;
      sum += highlights(*wi, wo) / density(*wi, wo);
    }
    return (sum / draws / room).maxCoeff();
  });
}

}  // namespace heddle
