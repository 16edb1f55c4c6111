#include "render/methods.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>
#include <vector>

#include "render/single_scattering.h"

namespace heddle {
namespace {

Light gaussian(float sharpness) {
  Light light;
  light.type = LightType::kSphericalGaussian;
  light.sharpness = sharpness;
  return light;
}

TEST(Methods, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const std::string_view name : render_method_names()) {
    const std::optional<RenderMethod> method = render_method_of(name);
    ASSERT_TRUE(method) << name;
    EXPECT_EQ(render_method_name(*method), name);
    names.insert(name);
  }
  EXPECT_EQ(names.size(), kRenderMethodCount);
  EXPECT_FALSE(render_method_of("fast"));
  EXPECT_FALSE(render_method_of(""));
}

TEST(Needs, FollowTheLights) {
  const auto needs = [](std::vector<Light> lights) {
    return needs_of(RenderMethod::kExact, lights, {});
  };
  EXPECT_TRUE(needs({Light{}}).ssdf);
  EXPECT_FALSE(needs({Light{}}).sgs);
  EXPECT_FALSE(needs({gaussian(0)}).ssdf);
  EXPECT_TRUE(needs({gaussian(0)}).sgs);
  EXPECT_FALSE(needs({gaussian(10)}).ssdf);  // the blend starts above 10 ...
  EXPECT_TRUE(needs({gaussian(11)}).ssdf);
  EXPECT_TRUE(needs({gaussian(19)}).sgs);
  EXPECT_FALSE(needs({gaussian(20)}).sgs);  // ... and is over at 20
  EXPECT_TRUE(needs({gaussian(300), gaussian(10)}).sgs);
  EXPECT_TRUE(needs({gaussian(300), gaussian(10)}).ssdf);
  Light environment;
  environment.type = LightType::kEnvironment;
  EXPECT_TRUE(needs({environment}).ssdf && needs({environment}).sgs);
  Light near;
  near.type = LightType::kPoint;
  EXPECT_TRUE(needs({near}).ssdf && !needs({near}).sgs);
  for (const LightType type : {LightType::kSphere, LightType::kRectangle}) {
    near.type = type;
    EXPECT_TRUE(needs({near}).ssdf && needs({near}).sgs);  // near or far: soft or sharp
  }
}

TEST(Needs, FollowTheBlend) {
  const std::vector<Light> lights = {gaussian(10), gaussian(300)};
  const Needs lobes = needs_of(RenderMethod::kExact, lights, kLobesOnly);
  EXPECT_TRUE(lobes.sgs && !lobes.ssdf);
  const Needs distance = needs_of(RenderMethod::kExact, lights, kSignedDistanceOnly);
  EXPECT_TRUE(distance.ssdf && !distance.sgs);
}

TEST(Needs, FollowTheMethod) {
  const std::vector<Light> lights = {Light{}, gaussian(10)};
  const Needs path = needs_of(RenderMethod::kPath, lights, {});
  EXPECT_FALSE(path.ssdf || path.sgs || path.transfer || path.volume);
  const Needs exact = needs_of(RenderMethod::kExact, lights, {});
  EXPECT_TRUE(exact.transfer);
  EXPECT_FALSE(exact.volume);
  EXPECT_TRUE(needs_of(RenderMethod::kVolume, lights, {}).volume);
  for (const RenderMethod none : {RenderMethod::kPath6, RenderMethod::kDualScattering}) {
    const Needs needs = needs_of(none, lights, {});
    EXPECT_FALSE(needs.ssdf || needs.sgs || needs.transfer || needs.volume);
  }
  const std::vector<Light> soft = {gaussian(10)};
  for (const RenderMethod rival :
       {RenderMethod::kPrt, RenderMethod::kTsaiShih16, RenderMethod::kTsaiShihFull}) {
    const Needs needs = needs_of(rival, soft, {});
    EXPECT_TRUE(needs.ssdf && needs.transfer);
    EXPECT_FALSE(needs.sgs);
  }
  EXPECT_TRUE(needs_of(RenderMethod::kPrinted, soft, {}).sgs);
}

}  // namespace
}  // namespace heddle
