#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/spherical_map.h"
#include "tests/pipeline/eval_answer.h"

namespace heddle {
namespace {

using Json = nlohmann::json;

Json request_of(const std::vector<std::string>& map) {
  return {{"quantity", "visibility"},
          {"map", map},
          {"directions", {{0, 0, 1}, {0, 0.6, 0.8}, {1, 0, 0}, {0, -0.8, -0.6}}}};
}

std::vector<std::string> upper_half(std::size_t n) {
  std::vector<std::string> map(n / 2, std::string(n, '1'));
  map.resize(n, std::string(n, '0'));
  return map;
}

const std::vector<double> kSphereHeights = {1, 0.8, 0, -0.6};

TEST(EvalVisibility, HalfSpace) {
  Json request = request_of(upper_half(16));
  const double sharpness = 30;
  request["sharpness"] = sharpness;
  const Json value = eval_value<Json>(request);
  for (std::size_t i = 0; i < kSphereHeights.size(); ++i) {
    const double distance = std::asin(kSphereHeights[i]);
    // (1, 0, 0) lies on the edge itself: distance 0 on either side.
    EXPECT_NEAR(value["ssdf"][i].get<double>(), distance, 1e-12);
    EXPECT_NEAR(value["ssdf_integral"][i].get<double>(),
                0.5 * (1 + std::erf(std::sqrt(sharpness / 2) * distance)), 1e-12);
  }
  // Integral over z > 0 of the normalised Gaussian about +z: (1 - e^-s) / (1 - e^-2s); about the
  // horizon: one half.
  EXPECT_NEAR(value["quadrature"][0].get<double>(),
              std::expm1(-sharpness) / std::expm1(-2 * sharpness), 1e-9);
  EXPECT_NEAR(value["quadrature"][2].get<double>(), 0.5, 1e-9);
}

TEST(EvalVisibility, NoEdgeIsPlusOrMinusPi) {
  for (const std::size_t n : {1, 2, 8}) {
    for (const bool open : {false, true}) {
      Json request = request_of(std::vector<std::string>(n, std::string(n, open ? '1' : '0')));
      request["sharpness"] = 3;
      const Json value = eval_value<Json>(request);
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(value["ssdf"][i].get<double>(), open ? kPi : -kPi);
        EXPECT_NEAR(value["quadrature"][i].get<double>(), open ? 1 : 0, 1e-9);
        if (!open) {
          EXPECT_EQ(value["sg_sum"][i].get<double>(), 0);
        }
      }
    }
  }
}

// A light that is constant over the sphere sees the open solid angle, which Voronoi weights keep.
TEST(EvalVisibilityLaw, ConstantLightSeesTheSolidAngle) {
  const std::size_t n = 10;
  std::vector<std::string> map(n, std::string(n, '0'));
  map[2][3] = map[2][4] = map[9][0] = '1';
  const LatLongGrid grid(static_cast<int>(n));
  const double share = (2 * grid.solid_angle(2) + grid.solid_angle(9)) / (4 * kPi);
  Json request = request_of(map);
  request["sharpness"] = 0;
  request["weights"] = "voronoi";
  const Json value = eval_value<Json>(request);
  EXPECT_NEAR(value["quadrature"][1].get<double>(), share, 1e-12);
  EXPECT_NEAR(value["sg_sum_integral"][1].get<double>(), share, 1e-12);
  EXPECT_EQ(value["ssdf_integral"][1].get<double>(), 0.5);
}

TEST(EvalVisibility, ASharpLightSeesTheCell) {
  std::vector<std::string> map(12, std::string(12, '1'));
  map[1][3] = '0';  // around polar angle 22.5 degrees, azimuth 105 degrees
  const Vec3d hidden = LatLongGrid(12).centre(1, 3);
  for (const double sharpness : {1e5, 1e12, 1e300}) {
    Json request = request_of(map);
    request["directions"] = {{hidden.x(), hidden.y(), hidden.z()}, {0, 0, -1}};
    request["sharpness"] = sharpness;
    const Json value = eval_value<Json>(request);
    EXPECT_NEAR(value["quadrature"][0].get<double>(), 0, 1e-9);
    EXPECT_NEAR(value["quadrature"][1].get<double>(), 1, 1e-6);
    EXPECT_EQ(value["ssdf_integral"][0].get<double>(), 0);
  }
}

// One open cell and Voronoi weights: a single Gaussian about the axis nearest to the cell.
TEST(EvalVisibility, AxesCountAndSharpnessAreWhatIsAskedFor) {
  const std::size_t n = 64;
  std::vector<std::string> map(n, std::string(n, '0'));
  map[0][0] = '1';
  Json request = request_of(map);
  request["axes"] = "printed";
  request["count"] = 20;
  request["sharpness_svf"] = 128;
  request["weights"] = "voronoi";
  const Json value = eval_value<Json>(request);
  const double weight = LatLongGrid(static_cast<int>(n)).solid_angle(0);
  for (std::size_t i = 0; i < kSphereHeights.size(); ++i) {
    EXPECT_NEAR(value["sg_sum"][i].get<double>(),
                weight * std::exp(128 * (kSphereHeights[i] - 1)) / sg_mass(128.0), 1e-15);
  }
}

// Axes of the upper hemisphere take the map to be closed below it.
TEST(EvalVisibility, UpperAxesIgnoreWhatIsBelow) {
  std::vector<std::string> whole(8, std::string(8, '1'));
  for (const char* axes : {"printed", "hemisphere"}) {
    for (const char* weights : {"voronoi", "nnls"}) {
      Json request = request_of(whole);
      Json upper = request_of(upper_half(8));
      for (Json* r : {&request, &upper}) {
        (*r)["axes"] = axes;
        (*r)["weights"] = weights;
      }
      EXPECT_EQ(eval_value<Json>(request)["sg_sum"], eval_value<Json>(upper)["sg_sum"]);
    }
  }
  Json sphere = request_of(whole);
  sphere["axes"] = "sphere";
  EXPECT_EQ(eval_value<Json>(request_of(whole)), eval_value<Json>(sphere))
      << "the default where cells below are open";
}

TEST(EvalVisibilityFormat, ErrorsNameTheField) {
  auto with = [](const char* field, const Json& value) {
    Json request = request_of(upper_half(4));
    request[field] = value;
    return request;
  };
  const std::vector<std::pair<const char*, Json>> bad = {
      {"map", "1010"},
      {"map", Json::array()},
      {"map", {"10", "1"}},
      {"map", {"10", "1x"}},
      {"map", {"10", 5}},
      {"directions", 3},
      {"directions", {{1, 0, 0}, {1, 1, 0}}},
      {"directions", {{1, 0}}},
      {"directions", {{1, 0, "0"}}},
      {"axes", "cube"},
      {"count", 0},
      {"count", 2.5},
      {"sharpness_svf", -1},
      {"weights", "least squares"},
      {"sharpness", -0.1},
      {"extra", 1},
  };
  for (const auto& [field, value] : bad) {
    EXPECT_NE(eval_error(with(field, value)).find(field), std::string::npos)
        << field << " " << value;
  }
  for (const char* field : {"map", "directions"}) {
    Json request = request_of(upper_half(4));
    request.erase(field);
    EXPECT_NE(eval_error(request).find(field), std::string::npos);
  }
}

// Work and memory grow with cells times Gaussians and cells times directions.
TEST(EvalVisibility, RequestsThatCostTooMuchAreRefused) {
  EXPECT_EQ(eval_error(request_of(upper_half(257))), "field \"map\": expected 1 to 256 strings");
  Json request = request_of(upper_half(128));
  request["count"] = 1025;
  EXPECT_EQ(eval_error(request), "field \"count\": must be an integer from 1 to 1024");
  request = request_of(upper_half(256));
  request["count"] = 257;
  EXPECT_EQ(eval_error(request), "field \"count\": must be an integer from 1 to 256");
  request = request_of(upper_half(256));
  request["directions"] = std::vector<std::vector<int>>(65, {0, 0, 1});
  EXPECT_EQ(eval_error(request),
            "field \"directions\": expected at most 64 with a map of this size");
}

}  // namespace
}  // namespace heddle
