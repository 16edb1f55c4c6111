#include "render/near_lights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "fibers/math/quadrature.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "render/radiance_picture.h"
#include "tests/support/near_lights.h"
#include "tests/support/statistics.h"

namespace heddle {
namespace {

const Rgb kRadiance(3, 2, 1);

/// Integral of radiance times f(direction) over the directions of a rectangle, from its area.
double integral_over_area(const Light& light, const Vec3d& point,
                          const std::function<double(const Vec3d&)>& f) {
  const QuadratureRule rule = gauss_legendre_panels(24, -1, 1, {-1, -0.5, 0, 0.5, 1});
  const double quarter = light.half_right_mm.norm() * light.half_up_mm.norm();
  double sum = 0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
      const Vec3d way = light.position_mm + rule.nodes[i] * light.half_right_mm +
                        rule.nodes[j] * light.half_up_mm - point;
      const double distance = way.norm();
      const double falls = -way.dot(light.axis.cast<double>()) / distance;
      if (falls <= 0) continue;
      const Rgb radiance =
          light.texture ? Rgb(light.irradiance * light.texture->at(0.5 + 0.5 * rule.nodes[i],
                                                                   0.5 + 0.5 * rule.nodes[j]))
                        : light.irradiance;
      sum += rule.weights[i] * rule.weights[j] * quarter * falls / (distance * distance) *
             static_cast<double>(radiance[0]) * f(way / distance);
    }
  }
  return sum;
}

/// Mean over drawn directions of the first colour's weight times f.
RunningMean sampled(const Light& light, const Vec3d& point, int count,
                    const std::function<double(const Vec3d&)>& f) {
  RunningMean mean;
  for (int k = 0; k < count; ++k) {
    RandomStream random(3, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
    const LightSample sample = sample_light(light, point, random);
    mean.add(static_cast<double>(sample.weight[0]) * f(sample.direction.cast<double>()));
  }
  return mean;
}

double plane_cosine(const Vec3d& direction) {
  return std::max(0.0, direction.z());
}

/// Form factor between a plane element and a rectangle parallel to it, one corner straight above
/// at height 1 (Howell, factor B-3).
double corner_form_factor(double a, double b) {
  const double ra = std::sqrt(1 + a * a);
  const double rb = std::sqrt(1 + b * b);
  return (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / (2 * kPi);
}

/// Of a rectangle [x0, x1] x [y0, y1] at height 1, from corners above the element.
double form_factor(double x0, double x1, double y0, double y1) {
  const auto corner = [](double x, double y) {
    return std::copysign(1.0, x) * std::copysign(1.0, y) *
           corner_form_factor(std::abs(x), std::abs(y));
  };
  return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
}

TEST(NearLightsLaw, IrradianceBelowAPointFallsWithTheSquare) {
  const Light light = test::point_light({0, 0, 500}, kRadiance);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  const LightSample below = sample_light(light, {0, 0, 0}, random);
  EXPECT_NEAR(below.weight[0], 3 * 4, 1e-5);  // half a metre
  EXPECT_EQ(below.pdf, 0);
  EXPECT_EQ(below.distance, 500);
  // (cos)^3 beside it
  const LightSample beside = sample_light(light, {500, 0, 0}, random);
  EXPECT_NEAR(beside.weight[0] * beside.direction.z(), 12 * std::pow(0.5, 1.5), 1e-5);
  EXPECT_FALSE(meet_light(light, {0, 0, 0}, {0, 0, 1}));
}

TEST(NearLightsLaw, IrradianceBelowASphereIsPiTimesSineSquared) {
  for (const double radius : {1.0, 40.0, 99.0}) {
    const Light light = test::sphere_light({0, 0, 100}, radius, kRadiance);
    const RunningMean mean = sampled(light, {0, 0, 0}, 20000, plane_cosine);
    const double sine = radius / 100;
    EXPECT_TRUE(
        means_agree("sphere", mean.mean(), mean.standard_error(), 3 * kPi * sine * sine, 0, 3));
  }
}

TEST(NearLightsLaw, IrradianceBelowARectangleIsItsFormFactor) {
  struct Case {
    double width, height;
    Vec3d middle;
  };
  // Near and wide, above and beside the element, and far and small: sampled by area.
  const Case cases[] = {{100, 60, {0, 0, 20}}, {30, 80, {45, -30, 25}}, {2, 3, {40, 10, 100}}};
  for (const Case& c : cases) {
    const Light light =
        test::rectangle_light(c.middle, {0, 0, -1}, {0, 1, 0}, c.width, c.height, kRadiance);
    const RunningMean mean = sampled(light, {0, 0, 0}, 20000, plane_cosine);
    const double z = c.middle.z();
    const double expected =
        3 * kPi *
        form_factor((c.middle.x() - c.width / 2) / z, (c.middle.x() + c.width / 2) / z,
                    (c.middle.y() - c.height / 2) / z, (c.middle.y() + c.height / 2) / z);
    EXPECT_TRUE(means_agree("rectangle", mean.mean(), mean.standard_error(), expected, 0, 3));
  }
}

TEST(NearLightsLaw, ARectangleShinesToOneSide) {
  const Light light = test::rectangle_light({0, 0, 10}, {0, 0, 1}, {0, 1, 0}, 5, 5, kRadiance);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  EXPECT_EQ(sample_light(light, {0, 0, 0}, random).weight[0], 0);
  EXPECT_EQ(seen_from(light, {0, 0, 0}).irradiance[0], 0);
  EXPECT_FALSE(meet_light(light, {0, 0, 0}, {0, 0, 1}));
  EXPECT_TRUE(meet_light(light, {0, 0, 20}, {0, 0, -1}));
}

std::shared_ptr<const RadiancePicture> uneven_texture() {
  auto texture = std::make_shared<RadiancePicture>();
  *texture = {4, 2, {}};
  for (int k = 0; k < 8; ++k)
    texture->pixels.push_back(Rgb::Constant(0.25F * static_cast<float>(k)));
  return texture;
}

/// Lights and a point that sees them from aside.
std::vector<Light> area_lights() {
  Light textured = test::rectangle_light({4, -2, 9}, {-1, 1, -3}, {0, 0, 1}, 6, 9, kRadiance);
  textured.texture = uneven_texture();
  return {test::sphere_light({3, 2, 8}, 5, kRadiance),
          test::sphere_light({30, 20, 80}, 1, kRadiance),
          test::rectangle_light({4, -2, 9}, {-1, 1, -3}, {0, 0, 1}, 6, 9, kRadiance),
          test::rectangle_light({40, -20, 90}, {-1, 1, -3}, {0, 0, 1}, 2, 1, kRadiance), textured};
}

TEST(NearLightsLaw, ADrawnDirectionMeetsTheLightWithItsDensity) {
  const Vec3d point(0.5, -0.25, 1);
  for (const Light& light : area_lights()) {
    int missed = 0;
    for (int k = 0; k < 300; ++k) {
      RandomStream random(1, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const LightSample sample = sample_light(light, point, random);
      const std::optional<MetLight> met = meet_light(light, point, sample.direction);
      if (!met) {
        ++missed;  // the direction is rounded to float, so the outline may be missed
        continue;
      }
      EXPECT_NEAR(met->pdf, sample.pdf, 1e-4F * sample.pdf);
      // Rays that touch a sphere have distances that change fast.
      EXPECT_NEAR(met->distance, sample.distance, 3e-3 * sample.distance);
      if (!light.texture) {
        EXPECT_NEAR(met->radiance[1], sample.weight[1] * sample.pdf, 1e-4);
      }
    }
    EXPECT_LE(missed, 1);
  }
}

// Directions drawn without regard to the light find the same as those drawn from it.
TEST(NearLightsStatistical, MeetingAndSamplingAgree) {
  const Vec3d point(0.5, -0.25, 1);
  for (const Light& light : area_lights()) {
    const Vec3 axis = (light.position_mm - point).normalized().cast<float>();
    RunningMean met;
    for (int k = 0; k < 40000; ++k) {
      RandomStream random(2, RandomStage::kTest, static_cast<std::uint64_t>(k), 0);
      const Vec3 direction = sample_spherical_gaussian(axis, 4, random);
      const std::optional<MetLight> found = meet_light(light, point, direction);
      met.add(found ? static_cast<double>(found->radiance[0] * direction.z() /
                                          spherical_gaussian_pdf(axis, 4, direction))
                    : 0.0);
    }
    const RunningMean drawn = sampled(light, point, 40000, [](const Vec3d& d) { return d.z(); });
    EXPECT_TRUE(means_agree("met, drawn", met.mean(), met.standard_error(), drawn.mean(),
                            drawn.standard_error(), 5));
  }
}

TEST(NearLightsStatistical, DirectionsOfARectangleHaveItsMoments) {
  const Vec3d point(0.5, -0.25, 1);
  const std::vector<Light> lights = area_lights();
  for (const std::size_t which : {2U, 3U, 4U}) {
    const Light& light = lights[which];
    const auto check = [&](const char* name, const std::function<double(const Vec3d&)>& f) {
      const RunningMean mean = sampled(light, point, 20000, f);
      EXPECT_TRUE(means_agree(name, mean.mean(), mean.standard_error(),
                              integral_over_area(light, point, f), 0, 9));
    };
    check("x", [](const Vec3d& d) { return d.x(); });
    check("y^2", [](const Vec3d& d) { return d.y() * d.y(); });
    check("x z^3", [](const Vec3d& d) { return d.x() * std::pow(d.z(), 3); });
  }
}

// What stands for a light: its irradiance, its mean direction, and its mean cosine to that.
TEST(NearLightsLaw, TheGaussianInItsPlaceHasItsMoments) {
  const Vec3d point(0.5, -0.25, 1);
  for (const Light& light :
       {test::rectangle_light({4, -2, 9}, {-1, 1, -3}, {0, 0, 1}, 6, 9, kRadiance),
        test::rectangle_light({1, 0, 2}, {0, 0, -1}, {0, 1, 0}, 30, 10, kRadiance),
        // on both sides of the angle where the series takes over
        test::rectangle_light({40, -20, 90}, {-1, 1, -3}, {0, 0, 1}, 1.5, 1.2, kRadiance),
        test::rectangle_light({40, -20, 90}, {-1, 1, -3}, {0, 0, 1}, 1.7, 1.3, kRadiance)}) {
    const SeenLight seen = seen_from(light, point);
    const auto mean = [&](const std::function<double(const Vec3d&)>& f) {
      return integral_over_area(light, point, f);
    };
    const double irradiance = mean([](const Vec3d&) { return 1.0; });
    const Vec3d moment(mean([](const Vec3d& d) { return d.x(); }),
                       mean([](const Vec3d& d) { return d.y(); }),
                       mean([](const Vec3d& d) { return d.z(); }));
    const double scale = light.half_up_mm.norm() > 4 ? 1e-3 : 1e-4;  // quadrature; series
    EXPECT_NEAR(seen.irradiance[0] / irradiance, 1, scale);
    EXPECT_LT((seen.axis.cast<double>() - moment.normalized()).norm(), scale);
    const double depth =
        mean([&](const Vec3d& d) { return 0.5 * (d - moment.normalized()).squaredNorm(); }) /
        irradiance;
    EXPECT_NEAR(static_cast<double>(seen.sharpness) / sg_sharpness_of_mean_depth(depth), 1,
                std::max(scale, 1e-3));
  }
}

TEST(NearLightsLaw, ASphereInItsPlace) {
  const Light light = test::sphere_light({0, 0, 10}, 6, kRadiance);
  const SeenLight seen = seen_from(light, {0, 0, 0});
  const double cosine = 0.8;  // of the cone's half angle
  EXPECT_NEAR(seen.irradiance[0], 3 * 2 * kPi * (1 - cosine), 1e-5);
  EXPECT_FLOAT_EQ(seen.axis.z(), 1);
  EXPECT_NEAR(static_cast<double>(seen.sharpness), sg_sharpness_of_mean_depth(0.5 * (1 - cosine)),
              1e-3);
  EXPECT_EQ(seen_from(light, {0, 0, 9}).irradiance[0], 0) << "within";
}

TEST(NearLightsLaw, PartsOfARectangleAddUpToIt) {
  Light light = test::rectangle_light({4, -2, 9}, {-1, 1, -3}, {0, 0, 1}, 60, 90, kRadiance);
  light.gaussians = 16;
  const Vec3d point(0.5, -0.25, -20);
  const auto nearest = [](const Vec3d& place) { return place.z() + 90; };
  for (const bool is_textured : {false, true}) {
    if (is_textured) light.texture = uneven_texture();
    const std::vector<Light> parts = split_rectangle(light, nearest);
    EXPECT_EQ(is_textured, parts.size() == 16) << parts.size();
    EXPECT_GT(parts.size(), 2U);
    double sum = 0;
    double area = 0;
    for (const Light& part : parts) {
      sum += static_cast<double>(seen_from(part, point).irradiance[0]);
      area += part.half_right_mm.norm() * part.half_up_mm.norm();
      EXPECT_FALSE(part.texture);
    }
    EXPECT_NEAR(area, 30 * 45, 1e-6);
    const double expected = integral_over_area(light, point, [](const Vec3d&) { return 1.0; });
    // Parts of the texture are means over area, not over solid angle.
    EXPECT_NEAR(sum / expected, 1, is_textured ? 0.02 : 1e-4);
  }
}

TEST(NearLightsLaw, PartsAreNarrowWhereTheLimitAllows) {
  Light light = test::rectangle_light({0, 0, 100}, {0, 0, -1}, {0, 1, 0}, 300, 40, kRadiance);
  light.gaussians = 128;
  const auto nearest = [](const Vec3d& place) { return place.z(); };
  for (const Light& part : split_rectangle(light, nearest)) {
    const Vec3d below(part.position_mm.x(), part.position_mm.y(), 0);
    EXPECT_GE(seen_from(part, below).sharpness, 0.9F * static_cast<float>(kPartSharpness));
  }
  light.gaussians = 1;
  ASSERT_EQ(split_rectangle(light, nearest).size(), 1U);
  light.position_mm.z() = 5000;
  light.gaussians = 128;
  EXPECT_EQ(split_rectangle(light, nearest).size(), 1U) << "far away";
}

TEST(NearLights, TexturesAreUprightFromTheSideThatShines) {
  // Someone below who looks up at it, y up, has +x at the left.
  Light light = test::rectangle_light({0, 0, 10}, {0, 0, -1}, {0, 1, 0}, 4, 2, Rgb(1, 1, 1));
  light.texture = uneven_texture();
  EXPECT_LT(light.half_right_mm.x(), 0);
  const auto radiance = [&](double x, double y) {
    const Vec3d way = Vec3d(x, y, 10).normalized();
    return meet_light(light, {0, 0, 0}, way.cast<float>())->radiance[0];
  };
  EXPECT_EQ(radiance(1.9, 0.9), 0);        // upper left: pixel 0
  EXPECT_EQ(radiance(-1.9, 0.9), 0.75F);   // upper right: pixel 3
  EXPECT_EQ(radiance(-1.9, -0.9), 1.75F);  // lower right: pixel 7
}

TEST(RadiancePictureLaw, MeansAreExactOverCutPixels) {
  const RadiancePicture picture = *uneven_texture();
  EXPECT_FLOAT_EQ(picture.mean(0, 1, 0, 1)[0], 0.875F);
  EXPECT_FLOAT_EQ(picture.mean(0.125, 0.375, 0.75, 1)[0], 0.125F);  // halves of pixels 0 and 1
  EXPECT_FLOAT_EQ(picture.mean(0, 0.25, 0.25, 0.75)[0], 0.5F);      // of pixels 0 and 4
}

TEST(NearLights, DistanceIsThatOfTheNearestPoint) {
  EXPECT_EQ(distance_to_light(test::point_light({0, 0, 5}, kRadiance), {0, 3, 1}), 5);
  EXPECT_EQ(distance_to_light(test::sphere_light({0, 0, 5}, 2, kRadiance), {0, 3, 1}), 3);
  EXPECT_EQ(distance_to_light(test::sphere_light({0, 0, 5}, 2, kRadiance), {0, 0, 4}), 0);
  const Light rectangle = test::rectangle_light({0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 4, 2, kRadiance);
  EXPECT_NEAR(distance_to_light(rectangle, {1, 0.5, 1}), 4, 1e-12);
  EXPECT_NEAR(distance_to_light(rectangle, {5, 1, 1}), 5, 1e-12);
}

TEST(SphericalGaussianLaw, SharpnessOfAMeanDepthInvertsIt) {
  for (const double sharpness : {0.01, 0.5, 3.0, 40.0, 1e5}) {
    const double depth = 1 / sharpness - 2 / std::expm1(2 * std::min(sharpness, 300.0));
    EXPECT_NEAR(sg_sharpness_of_mean_depth(depth) / sharpness, 1, 1e-6);
  }
  EXPECT_EQ(sg_sharpness_of_mean_depth(1), 0);
}

}  // namespace
}  // namespace heddle
