#include "render/surface/sg_light_quadrature.h"

#include <cmath>
#include <cstdint>

#include "fibers/math/spherical_gaussian.h"

namespace heddle {

Rgbd integrate_sg_light(const Vec3d& axis, double sharpness,
                        const std::function<Rgbd(const Vec3d&)>& reflected,
                        const SgLightQuadrature& settings) {
  const Vec3d side = axis.unitOrthogonal();
  const Vec3d other = axis.cross(side);
  // Points (i + 1/2, i * generator) / count, with two successive Fibonacci numbers.
  const auto mean_over_lattice = [&](int count, int generator) {
    Rgbd sum = Rgbd::Zero();
    for (int i = 0; i < count; ++i) {
      const double d = sg_depth_of_share((i + 0.5) / count, sharpness);
      const auto step = static_cast<std::int64_t>(i) * generator % count;
      const double azimuth = 2.0 * kPi * static_cast<double>(step) / count;
      const double sine = std::sqrt(d * (2.0 - d));
      const Vec3d wi =
          (1.0 - d) * axis + sine * (std::cos(azimuth) * side + std::sin(azimuth) * other);
      if (wi.z() > 0.0) sum += reflected(wi);
    }
    return Rgbd(sum / count);
  };
  int generator = 377;
  int count = 610;
  Rgbd mean = mean_over_lattice(count, generator);
  while (true) {
    // Two Fibonacci numbers on.
    generator += count;
    count += generator;
    if (count > settings.max_points) return mean;
    const Rgbd finer = mean_over_lattice(count, generator);
    const double change = (finer - mean).abs().maxCoeff();
    mean = finer;
    if (change <= settings.tolerance * mean.maxCoeff()) return mean;
  }
}

}  // namespace heddle
