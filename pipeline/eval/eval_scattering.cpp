#include "fibers/scattering/fiber_bcsdf.h"
#include "fibers/scattering/sg_scatter.h"
#include "pipeline/eval/eval_quantities.h"
#include "pipeline/json_file.h"

namespace heddle {
namespace {

Rgbd read_color(EvalObject& object, const std::string& field) {
  const std::vector<double> v = object.numbers(field, 3);
  Rgbd color(v[0], v[1], v[2]);
  if (color.minCoeff() < 0.0 || color.maxCoeff() > 1.0)
    object.fail(field, "must lie between 0 and 1");
  return color;
}

FiberScattering read_fiber(EvalObject& request) {
  EvalObject object = request.object("fiber");
  FiberScattering fiber;
  fiber.color_r = read_color(object, "color_r");
  fiber.color_tt = read_color(object, "color_tt");
  fiber.beta_r = radians(object.number("beta_r_deg", 0.01, 90.0));
  fiber.beta_tt = radians(object.number("beta_tt_deg", 0.01, 90.0));
  fiber.gamma_tt = radians(object.number("gamma_tt_deg", 0.01, 360.0));
  object.finish();
  return fiber;
}

Lobe read_lobe(EvalObject& request) {
  const std::string lobe = request.choice("lobe", {"r", "tt", "all"}, "all");
  return lobe == "r" ? Lobe::kR : lobe == "tt" ? Lobe::kTt : Lobe::kAll;
}

}  // namespace

nlohmann::json eval_bcsdf(EvalObject& request) {
  const FiberScattering fiber = read_fiber(request);
  const Vec3d wi = request.direction("wi");
  const Vec3d wo = request.direction("wo");
  const Lobe lobe = read_lobe(request);
  request.finish();
  return numbers_of(evaluate_bcsdf(fiber, wi, wo, lobe));
}

nlohmann::json eval_bcsdf_albedo(EvalObject& request) {
  const FiberScattering fiber = read_fiber(request);
  const double theta_i = request.inclination("theta_i_deg");
  request.finish();
  return numbers_of(bcsdf_albedo(fiber, theta_i));
}

nlohmann::json eval_bcsdf_sh(EvalObject& request) {
  const FiberScattering fiber = read_fiber(request);
  const double theta_o = request.inclination("theta_o_deg");
  const int order = request.order("order");
  request.finish();
  nlohmann::json rows = nlohmann::json::array();
  for (const Rgbd& coefficient : bcsdf_sh(fiber, theta_o, order))
    rows.push_back(numbers_of(coefficient));
  return rows;
}

nlohmann::json eval_sg_scatter(EvalObject& request) {
  const FiberScattering fiber = read_fiber(request);
  const SphericalGaussian light{request.direction("axis"), request.sharpness("sharpness")};
  const Vec3d wo = request.direction("wo");
  const std::string method = request.choice("method", {"printed", "default", "quadrature"});
  const Lobe lobe = read_lobe(request);
  request.finish();
  return numbers_of(sg_scatter(fiber, light, wo,
                               method == "printed"   ? SgMethod::kPrinted
                               : method == "default" ? SgMethod::kDefault
                                                     : SgMethod::kQuadrature,
                               lobe));
}

}  // namespace heddle
