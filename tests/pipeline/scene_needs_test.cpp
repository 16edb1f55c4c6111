#include "pipeline/scene_needs.h"

#include <gtest/gtest.h>

#include <vector>

namespace heddle {
namespace {

Light gaussian(float sharpness) {
  Light light;
  light.type = LightType::kSphericalGaussian;
  light.sharpness = sharpness;
  return light;
}

TEST(SceneNeeds, FollowTheLights) {
  const auto needs = [](std::vector<Light> lights) {
    return needs_of(RenderMethod::kExact, lights);
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
}

TEST(SceneNeeds, FollowTheMethod) {
  const std::vector<Light> lights = {Light{}, gaussian(10)};
  const Needs path = needs_of(RenderMethod::kPath, lights);
  EXPECT_FALSE(path.ssdf || path.sgs || path.transfer || path.volume);
  const Needs exact = needs_of(RenderMethod::kExact, lights);
  EXPECT_TRUE(exact.transfer);
  EXPECT_FALSE(exact.volume);
  EXPECT_TRUE(needs_of(RenderMethod::kVolume, lights).volume);
  for (const RenderMethod none : {RenderMethod::kPath6, RenderMethod::kDualScattering}) {
    const Needs needs = needs_of(none, lights);
    EXPECT_FALSE(needs.ssdf || needs.sgs || needs.transfer || needs.volume);
  }
  const std::vector<Light> soft = {gaussian(10)};
  for (const RenderMethod rival :
       {RenderMethod::kPrt, RenderMethod::kTsaiShih16, RenderMethod::kTsaiShihFull}) {
    const Needs needs = needs_of(rival, soft);
    EXPECT_TRUE(needs.ssdf && needs.transfer);
    EXPECT_FALSE(needs.sgs);
  }
  EXPECT_TRUE(needs_of(RenderMethod::kPrinted, soft).sgs);
}

}  // namespace
}  // namespace heddle
