#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "fibers/math/vector.h"
#include "tests/pipeline/eval_answer.h"

namespace heddle {
namespace {

using Json = nlohmann::json;

// A disc of radius 1/2 in a square window of side 2; half = (1, 0) takes its centre to the right
// edge, (1, 1) to the corner.
const Json kDisc = {
    {"size", {2, 2}}, {"alpha", 0.5}, {"eccentricity", 0}, {"phi_deg", 30}, {"k", {1, 1}}};

Json area_request(double hx, double hy) {
  return {{"quantity", "woven_area"}, {"segment", kDisc}, {"half", {hx, hy}}};
}

TEST(EvalWoven, AreaOfADisc) {
  const double whole = kPi * 0.25 / 4.0;
  EXPECT_NEAR(eval_value(area_request(0, 0)), whole, 1e-15);
  EXPECT_NEAR(eval_value(area_request(1, 0)), whole / 2, 1e-15);
  EXPECT_NEAR(eval_value(area_request(-1, 1)), whole / 4, 1e-15);
  EXPECT_EQ(eval_value(area_request(2, 0)), 0.0);
}

Json pair_request(const char* quantity) {
  return {{"quantity", quantity}, {"wi", {0, 0, 1}}, {"wo", {0, 0, 1}},
          {"diffuse", 0.1},       {"specular", 2},   {"ior", 1.5}};
}

TEST(EvalWoven, BtfInAndBesideTheHighlight) {
  Json request = pair_request("woven_btf");
  request["segment"] = kDisc;
  request["point"] = {1.49, 1};
  // Normal incidence: F = 0.04, G = 1, both cosines 1.
  EXPECT_NEAR(eval_value(request), 0.1 + 2 * 0.04, 1e-15);
  request["point"] = {1.51, 1};
  EXPECT_NEAR(eval_value(request), 0.1, 1e-15);
  // Mirror pair at 60 degrees: h = n, cos(theta_d) = 1/2, G = min(1, 2 * 1/2 / 1/2) = 1, cosines
  // 1/2 each.
  request["point"] = {1, 1};
  request["wi"] = {std::sqrt(0.75), 0, 0.5};
  request["wo"] = {-std::sqrt(0.75), 0, 0.5};
  const double t = std::sqrt(1.0 - 0.75 / 2.25);
  const double s = std::pow((0.5 - 1.5 * t) / (0.5 + 1.5 * t), 2);
  const double p = std::pow((t - 0.75) / (t + 0.75), 2);
  EXPECT_NEAR(eval_value(request), 0.1 + 2 * 0.5 * (s + p) / 0.25, 1e-12);
  request["wi"] = {0, 0.6, -0.8};
  EXPECT_EQ(eval_value(request), 0.0);
}

TEST(EvalWoven, BrdfWeighsSegmentsByArea) {
  Json request = pair_request("woven_brdf");
  Json empty = kDisc;
  empty["alpha"] = 0;
  request["segments"] = {{{"segment", kDisc}, {"area", 3}}, {{"segment", empty}, {"area", 1}}};
  EXPECT_NEAR(eval_value(request), 0.1 + 2 * 0.04 * 0.75 * kPi * 0.25 / 4.0, 1e-15);
}

TEST(EvalWoven, YarnsFarIsTheMeanOfNear) {
  Json request = {{"quantity", "woven_yarns"},
                  {"fabric", "irawan-polyester"},
                  {"wi", {0, 0.6, 0.8}},
                  {"wo", {0, -0.48, 0.8773}}};
  const Json far = answer(request)["value"];
  double sum = 0;
  constexpr int kGrid = 60;
  for (int i = 0; i < kGrid; ++i) {
    for (int j = 0; j < kGrid; ++j) {
      request["position_mm"] = {0.4 * (i + 0.5) / kGrid, 0.4 * (j + 0.5) / kGrid};
      sum += answer(request)["value"][0].get<double>();
    }
  }
  // The band's edges: one row of the grid's 60.
  EXPECT_NEAR(sum / (kGrid * kGrid) / far[0].get<double>(), 1.0, 1.0 / kGrid);
}

TEST(EvalWoven, ErrorsNameTheField) {
  EXPECT_NE(eval_error({{"quantity", "woven_area"}, {"segment", kDisc}}).find("\"half\""),
            std::string::npos);
  Json request = area_request(0, 0);
  request["segment"]["size"] = {0, 1};
  EXPECT_NE(eval_error(request).find("\"segment.size\""), std::string::npos);
  request = area_request(0, 0);
  request["segment"]["eccentricity"] = 1.5;
  EXPECT_NE(eval_error(request).find("\"segment.eccentricity\""), std::string::npos);
  request["segment"]["eccentricity"] = 0.5;
  request["segment"]["tilt"] = 1;
  EXPECT_NE(eval_error(request).find("\"segment.tilt\""), std::string::npos);
  request = pair_request("woven_brdf");
  request["segments"] = Json::array();
  EXPECT_NE(eval_error(request).find("\"segments\""), std::string::npos);
  request["segments"] = {{{"segment", kDisc}, {"area", -1}}};
  EXPECT_NE(eval_error(request).find("\"segments[0].area\""), std::string::npos);
  request["segments"] = {{{"segment", kDisc}, {"area", 0}}};
  EXPECT_NE(eval_error(request).find("\"segments\""), std::string::npos);
  request = pair_request("woven_btf");
  request["segment"] = kDisc;
  request["point"] = {0, 0};
  request["ior"] = 0.5;
  EXPECT_NE(eval_error(request).find("\"ior\""), std::string::npos);
  EXPECT_NE(
      eval_error(
          {{"quantity", "woven_yarns"}, {"fabric", "tweed"}, {"wi", {0, 0, 1}}, {"wo", {0, 0, 1}}})
          .find("irawan-denim"),
      std::string::npos);
}

}  // namespace
}  // namespace heddle
