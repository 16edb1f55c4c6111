#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "fibers/math/circular_gaussian.h"
#include "fibers/math/vector.h"
#include "tests/pipeline/eval_answer.h"

namespace heddle {
namespace {

using Json = nlohmann::json;

Json request_of(const char* method) {
  return {{"quantity", "clipped_gaussians"},
          {"theta_l", 0.3},
          {"phi_k", -0.4},
          {"sigma_l", 0.1},
          {"sigma_k", 0.2},
          {"distance", 0.05},
          {"gradient_deg", 30},
          {"method", method}};
}

TEST(EvalClippedGaussians, MethodsAgreeWithinTheirErrors) {
  const double scale = kPi * 0.1 * 0.2;
  const double exact = eval_value(request_of("quadrature"));
  // Narrow Gaussians far from the border: pi s s' (1 + erf(d / S)) / 2, up to the difference of gc
  // and g.
  const double spread = std::hypot(0.1 * std::cos(kPi / 6), 0.2 * std::sin(kPi / 6));
  EXPECT_NEAR(exact, scale * 0.5 * (1 + std::erf(0.05 / spread)), 0.01 * scale);
  EXPECT_NEAR(eval_value(request_of("default")), exact, 1e-5 * scale);
  const double printed = eval_value(request_of("printed"));
  EXPECT_NEAR(printed, exact, 0.02 * scale);
  EXPECT_GT(std::abs(printed - exact), 1e-4 * scale);
}

TEST(EvalClippedGaussiansLaw, EveryLineOfTheSameSideIsTheWhole) {
  for (const char* method : {"quadrature", "default"}) {
    Json request = request_of(method);
    request["distance"] = 10;
    const double whole = circular_gaussian_mass({0.3, 0.1}, -kPi / 2, kPi / 2) *
                         circular_gaussian_mass({-0.4, 0.2}, -kPi / 2, kPi / 2);
    EXPECT_NEAR(eval_value(request), whole, 1e-5 * whole);
    request["distance"] = -10;
    EXPECT_EQ(eval_value(request), 0);
  }
}

TEST(EvalClippedGaussiansStability, ExtremesAreFinite) {
  for (const char* method : {"printed", "default", "quadrature"}) {
    for (const double width : {1e-6, 1.0, 1e6}) {
      for (const double mean : {-2 * kPi, -kPi / 2, 0.0, 3.0}) {
        Json request = request_of(method);
        request["sigma_l"] = width;
        request["phi_k"] = mean;
        const double value = eval_value(request);
        EXPECT_TRUE(std::isfinite(value) && value >= -1e-12) << request;
      }
    }
  }
}

TEST(EvalClippedGaussiansFormat, ErrorsNameTheField) {
  for (const char* field :
       {"theta_l", "phi_k", "sigma_l", "sigma_k", "distance", "gradient_deg", "method"}) {
    Json request = request_of("default");
    request.erase(field);
    EXPECT_NE(eval_error(request).find(field), std::string::npos);
    request[field] = "x";
    EXPECT_NE(eval_error(request).find(field), std::string::npos);
  }
  for (const char* field : {"sigma_l", "sigma_k"}) {
    Json request = request_of("default");
    request[field] = 0;
    EXPECT_NE(eval_error(request).find(field), std::string::npos);
  }
  Json request = request_of("default");
  request["theta_l"] = 7;
  EXPECT_NE(eval_error(request).find("theta_l"), std::string::npos);
}

}  // namespace
}  // namespace heddle
