#include <cmath>
#include <limits>

#include "fibers/math/circular_gaussian.h"
#include "pipeline/eval/eval_quantities.h"

namespace heddle {

nlohmann::json eval_clipped_gaussians(EvalObject& request) {
  const double smallest = std::numeric_limits<double>::min();
  CircularGaussian theta;
  theta.mean = request.number("theta_l", -2 * kPi, 2 * kPi);
  theta.width = request.number("sigma_l", smallest);
  CircularGaussian phi;
  phi.mean = request.number("phi_k", -2 * kPi, 2 * kPi);
  phi.width = request.number("sigma_k", smallest);
  const double distance = request.number("distance");
  const double gradient = radians(request.number("gradient_deg"));
  const std::string method = request.choice("method", {"printed", "default", "quadrature"});
  request.finish();
  const VisibilityLine line{distance, std::cos(gradient), std::sin(gradient)};
  if (method == "printed") return clipped_gaussians_printed(theta, phi, line);
  if (method == "default") return clipped_gaussians(theta, phi, line);
  return clipped_gaussians_quadrature(theta, phi, line);
}

}  // namespace heddle
