#include "render/surface/thread_scattering.h"

namespace heddle {

ThreadScattering::ThreadScattering(const ThreadParameters& parameters,
                                   const ThreadConventions& conventions)
    : parameters_(parameters), fresnel_(conventions.fresnel) {
  const double deviations =
      conventions.width == ThreadConventions::Width::kIwasaki ? std::sqrt(0.5) : 1;
  surface_deviation_ = deviations * parameters.gamma_s;
  volume_deviation_ = deviations * parameters.gamma_v;
  surface_height_ = 1 / (std::sqrt(2 * kPi) * surface_deviation_);
  surface_exponent_ = -0.5 / (surface_deviation_ * surface_deviation_);
  volume_height_ = (1 - parameters.kd) / (std::sqrt(2 * kPi) * volume_deviation_);
  volume_exponent_ = -0.5 / (volume_deviation_ * volume_deviation_);
}

Rgbd ThreadScattering::value(double theta_i, double phi_i, double theta_r, double phi_r) const {
  const auto direction = [](double theta, double phi) {
    return ThreadDirection<1>{Lanes<1>(std::sin(theta)), Lanes<1>(std::cos(theta) * std::sin(phi)),
                              Lanes<1>(std::cos(theta) * std::cos(phi))};
  };
  const ThreadValue<1> f =
      value<1>(thread_angles<1>(direction(theta_i, phi_i), direction(theta_r, phi_r)));
  return f.surface[0] + parameters_.albedo * f.volume[0];
}

}  // namespace heddle
