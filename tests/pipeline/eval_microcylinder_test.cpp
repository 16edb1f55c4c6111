#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "tests/pipeline/eval_answer.h"

namespace heddle {
namespace {

using Json = nlohmann::json;

Json thread_request() {
  return {{"quantity", "thread"},
          {"thread",
           {{"ior", 1.345},
            {"albedo", {.12, .114, .006}},
            {"kd", .2},
            {"gamma_s_deg", 5},
            {"gamma_v_deg", 10}}},
          {"theta_i_deg", 85},
          {"phi_i_deg", 0},
          {"theta_o_deg", -85},
          {"phi_o_deg", 0}};
}

// Mirror direction: theta_h = phi_d = 0, so that both Gaussians are at their peaks and theta_d =
// theta_i.
TEST(EvalThread, MirrorDirectionByHand) {
  const double theta = radians(85);
  const double inside = std::asin(std::sin(theta) / 1.345);
  const double s = std::pow(std::sin(theta - inside) / std::sin(theta + inside), 2);
  const double p = std::pow(std::tan(theta - inside) / std::tan(theta + inside), 2);
  const double reflected = .5 * (s + p);
  const double height = 1 / std::sqrt(2 * kPi);
  const double surface = reflected * height / radians(5);
  const double volume =
      std::pow(1 - reflected, 2) * (.8 * height / radians(10) + .2) / (2 * std::cos(theta));
  const std::vector<double> value = eval_value<std::vector<double>>(thread_request());
  const double albedo[] = {.12, .114, .006};
  for (std::size_t k = 0; k < 3; ++k) {
    const double expected = (surface + albedo[k] * volume) / std::pow(std::cos(theta), 2);
    EXPECT_NEAR(value[k], expected, 1e-11 * expected);
  }
  EXPECT_NEAR(value[0], 384, .5);
}

TEST(EvalThreadLaw, IsReciprocal) {
  Json forth = thread_request();
  forth["theta_i_deg"] = 20, forth["phi_i_deg"] = 170, forth["theta_o_deg"] = -43,
  forth["phi_o_deg"] = -160;
  Json back = forth;
  back["theta_i_deg"] = -43, back["phi_i_deg"] = -160, back["theta_o_deg"] = 20,
  back["phi_o_deg"] = 170;
  EXPECT_EQ(eval_value<std::vector<double>>(forth), eval_value<std::vector<double>>(back));
}

Json linen() {
  const Json thread = {
      {"direction", 1}, {"share", .33},      {"ior", 1.46},       {"albedo", {.06, .24, .3}},
      {"kd", .3},       {"gamma_s_deg", 12}, {"gamma_v_deg", 24}, {"offsets_deg", {-25, 25}},
      {"lengths", {1}}};
  Json other = thread;
  other["direction"] = 2;
  return {{"model", "microcylinder"}, {"thread", {thread, other}}};
}

Json request_for(const Json& fabric) {
  return {{"quantity", "microcylinder"},
          {"fabric", fabric},
          {"wi", {.48, .36, .8}},
          {"wo", {-.6, 0, .8}}};
}

TEST(EvalMicrocylinder, AnObjectSaysTheSameAsItsConfig) {
  EXPECT_EQ(eval_value<std::vector<double>>(request_for(linen())),
            eval_value<std::vector<double>>(request_for("linen-plain")));
  Json without = linen();
  without.erase("model");
  EXPECT_EQ(eval_value<std::vector<double>>(request_for(without)),
            eval_value<std::vector<double>>(request_for("linen-plain")));
  for (const auto& [key, value] : {std::pair<const char*, Json>{"gaussian_width", "iw"},
                                   {"fresnel_angle", "normal"},
                                   {"blend_width_deg", 15.5}}) {
    Json other = linen();
    other[key] = value;
    EXPECT_NE(eval_value<std::vector<double>>(request_for(other)),
              eval_value<std::vector<double>>(request_for("linen-plain")))
        << key;
  }
}

// A thread that lies flat and straight: one tangent, every factor by hand.
TEST(EvalMicrocylinder, OneFlatThreadByHand) {
  Json fabric = linen();
  fabric["thread"].erase(1);
  fabric["thread"][0]["share"] = .5;
  fabric["thread"][0]["offsets_deg"] = {0, 0};
  Json request = request_for(fabric);
  // Light and eye in the plane of the thread and the normal: phi = 0, M = 1, theta = psi.
  request["wi"] = {.6, 0, .8};
  const double theta = std::asin(.6);
  const double u = std::exp(-.5 * std::pow(2 * theta / radians(20), 2));
  const double p = (1 - u) * .8 * .8 + u * .8;
  const double q = .5 * p + .5 * .8;
  Json thread = {{"quantity", "thread"},
                 {"theta_i_deg", degrees(theta)},
                 {"phi_i_deg", 0},
                 {"theta_o_deg", degrees(-theta)},
                 {"phi_o_deg", 0}};
  for (const char* key : {"ior", "albedo", "kd", "gamma_s_deg", "gamma_v_deg"}) {
    thread["thread"][key] = fabric["thread"][0][key];
  }
  const std::vector<double> scattering = eval_value<std::vector<double>>(thread);
  const std::vector<double> value = eval_value<std::vector<double>>(request);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(value[k], .5 * scattering[k] * p * .8 / q, 1e-12);
}

TEST(EvalMicrocylinder, BelowTheHorizonIsBlack) {
  Json request = request_for("velvet");
  request["wi"] = {.6, 0, -.8};
  EXPECT_EQ(eval_value<std::vector<double>>(request), std::vector<double>(3, 0.0));
}

TEST(EvalMicrocylinderFormat, ErrorsNameTheField) {
  const std::string unknown = eval_error(request_for("denim"));
  for (const char* known :
       {"denim", "linen-plain", "polyester-charmeuse-back", "polyester-charmeuse-front",
        "silk-crepe-de-chine", "silk-shot", "velvet"}) {
    EXPECT_NE(unknown.find(known), std::string::npos) << unknown;
  }
  Json fabric = linen();
  fabric["thread"][1]["kd"] = 2;
  EXPECT_NE(eval_error(request_for(fabric)).find("kd"), std::string::npos)
      << eval_error(request_for(fabric));
  fabric = linen();
  fabric["thread"][0]["colour"] = "red";
  EXPECT_NE(eval_error(request_for(fabric)).find("colour"), std::string::npos)
      << eval_error(request_for(fabric));
  fabric = linen();
  fabric["model"] = "velour";
  EXPECT_NE(eval_error(request_for(fabric)).find("model"), std::string::npos);
  fabric = linen();
  fabric["energy_safe"] = nullptr;
  EXPECT_NE(eval_error(request_for(fabric)).find("null"), std::string::npos);
  for (const Json& wrong : {Json(3), Json::array(), Json::object(), Json()}) {
    EXPECT_NE(eval_error(request_for(wrong)).find("fabric"), std::string::npos) << wrong;
  }
  for (const char* field : {"wi", "wo", "fabric"}) {
    Json request = request_for("velvet");
    request.erase(field);
    EXPECT_NE(eval_error(request).find(field), std::string::npos);
  }
  for (const char* field : {"ior", "albedo", "kd", "gamma_s_deg", "gamma_v_deg"}) {
    Json request = thread_request();
    request["thread"][field] = -1;
    EXPECT_NE(eval_error(request).find(std::string("thread.") + field), std::string::npos);
  }
  Json request = thread_request();
  request["theta_i_deg"] = 91;
  EXPECT_NE(eval_error(request).find("theta_i_deg"), std::string::npos);
}

}  // namespace
}  // namespace heddle
