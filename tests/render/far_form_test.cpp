#include "render/far_form.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

/// A table of `value`, a function of the light alone.
FarTable table_of(bool both_sides, const std::function<float(const Vec3&)>& value) {
  FarTable table;
  table.resolution = 32;
  table.both_sides = both_sides;
  table.order = 0;
  table.repeat_mm = 1;
  const DirectionGrid grid = table.grid();
  table.coverage.assign(grid.count(), 1.0F);
  table.height.assign(grid.count(), 0.0F);
  table.multiple.assign(grid.count() * std::size_t{3}, 0.0F);
  for (std::uint32_t view = 0; view < grid.count(); ++view) {
    for (std::uint32_t l = 0; l < table.light_count(); ++l) {
      for (int c = 0; c < 3; ++c) table.single.push_back(half_from_float(value(grid.direction(l))));
    }
  }
  return table;
}

TEST(FarFormLaw, ConstantRadianceStaysUnderAnyLight) {
  const FarTable table = table_of(true, [](const Vec3&) { return 0.5F; });
  const FarForm form(table);
  const FarForm::View view = form.view(Vec3(0.3F, 0.1F, 1).normalized());
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (const float sharpness : {0.0F, 0.01F, 0.3F, 2.0F, 11.0F, 60.0F, 150.0F, 400.0F, 1e5F}) {
    for (int draw = 0; draw < 20; ++draw)
      EXPECT_NEAR(form.single(view, sample_sphere(random), sharpness)[1], 0.5, 2e-3) << sharpness;
  }
}

TEST(FarFormLaw, WideLightsSeeTheMeanOfTheTable) {
  // Of a light about the axis, the mean of a smooth function is by quadrature; from the face, what
  // lies below the horizon is missing.
  const auto value = [](const Vec3& w) { return 1 + 0.8F * w.x() - 0.5F * w.y() * w.z(); };
  const DirectionGrid fine(96);
  for (const bool both_sides : {true, false}) {
    const FarTable table = table_of(both_sides, value);
    const FarForm form(table);
    const FarForm::View view = form.view(Vec3(-0.5F, 0.2F, 1).normalized());
    for (const Vec3& towards :
         {Vec3(0.2F, 0.1F, 1), Vec3(1, -0.4F, 0.25F), Vec3(0.3F, 0.8F, -0.3F)}) {
      const Vec3 axis = towards.normalized();
      for (const float sharpness : {0.0F, 0.5F, 1.7F, 6.0F, 25.0F, 90.0F, 150.0F}) {
        double expected = 0;
        double all = 0;
        for (std::uint32_t l = 0; l < fine.count(); ++l) {
          const Vec3 w = fine.direction(l);
          const double weight =
              sg_value({axis.cast<double>(), static_cast<double>(sharpness)}, w.cast<double>());
          all += weight;
          if (both_sides || w.z() > 0) expected += weight * static_cast<double>(value(w));
        }
        expected /= all;
        EXPECT_NEAR(form.single(view, axis, sharpness)[0], expected, 0.04)
            << "axis " << axis.transpose() << " sharpness " << sharpness << " both " << both_sides;
      }
    }
  }
}

TEST(FarFormLaw, LightFromBelowIsMissingWhereDataAreOfTheFace) {
  const FarTable table = table_of(false, [](const Vec3&) { return 1.0F; });
  const FarForm form(table);
  const FarForm::View view = form.view(Vec3(0, 0, 1));
  EXPECT_EQ(form.single(view, Vec3(0.2F, 0, -1).normalized(), {})[0], 0);
  EXPECT_LT(form.single(view, Vec3(0, 0, -1), 100.0F)[0], 1e-3);
  EXPECT_NEAR(form.single(view, Vec3(0, 0, 1), 100.0F)[0], 1, 2e-3);
}

}  // namespace
}  // namespace heddle
