#include "fibers/cloth/curve_exemplar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/cloth/fabric_config.h"
#include "fibers/cloth/synthesize.h"
#include "formats/input_error.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

// Curves in a file of polylines, in centimetres.
class CurveExemplar : public testing::Test {
 protected:
  void add(const std::vector<CurvePoint>& points, bool is_closed = false) {
    curves_.add(points, is_closed);
  }
  // The rectangle from (0, 0) to (10, 10) mm.
  CurvesConfig config() {
    CurvesConfig config;
    config.file = folder_.path() / "curves.bcc";
    curves_.kind = CurveKind::kPolyline;
    write_curves(config.file, curves_);
    config.unit_mm = 10;
    config.size_mm = {10, 10};
    return config;
  }
  Exemplar synthesized(const std::string& more) {
    const CurvesConfig curves = config();
    const std::string text =
        "name = \"found\"\nsegment_um = 200\n[fiber.thread]\nradius_um = 10\nscattering = "
        "\"white-isotropic\"\n[curves]\nfile = \"curves.bcc\"\nunit_mm = 10\nnormal = "
        "\"z\"\nfrom_mm = [0, 0]\nsize_mm = [10, 10]\nfiber = \"thread\"\n" +
        more;
    const TomlTable document = TomlTable::parse(text, (folder_.path() / "fabric.toml").string());
    const FabricConfig fabric = read_fabric_config(document);
    document.finish();
    Exemplar exemplar = synthesize(fabric);
    EXPECT_NO_THROW(validate_exemplar(exemplar, "found"));
    EXPECT_NEAR(static_cast<double>(exemplar.segment_count()) / forecast_exemplar(fabric).segments,
                1, 0.05);
    return exemplar;
  }

  TemporaryFolder folder_;
  CurveSet curves_;
};

TEST_F(CurveExemplar, CutsCurvesAtTheRectangle) {
  add({{-0.5F, 0.5F, 0.1F}, {0.5F, 0.5F, 0.2F}, {1.5F, 0.5F, 0.1F}});  // through, along x
  add({{0.2F, 0.2F, 0}, {0.4F, 0.2F, 0}, {0.4F, 0.4F, 0}});            // inside
  add({{3, 3, 0}, {4, 4, 0}});                                         // far away
  add({{-0.5F, 0.8F, 0},
       {0.5F, 0.8F, 0},
       {0.5F, 1.8F, 0},
       {0.7F, 1.8F, 0},
       {0.7F, 0.8F, 0},
       {0.7F, 0.3F, 0}});  // in, out and in again
  CurveCut cut;
  const std::vector<TileCurve> tile = curves_on_tile(config(), 0.5, &cut);
  ASSERT_EQ(tile.size(), 4U);
  EXPECT_EQ(cut.ends, 2U + 0U + 3U);
  const double slanted = std::hypot(1, 0.1);
  EXPECT_NEAR(cut.whole_mm, 10 * (2 * slanted + 0.4 + 3.7), 1e-4);
  EXPECT_NEAR(cut.kept_mm, 10 * (slanted + 0.4 + 0.5 + 0.2 + 0.7), 1e-4);
  EXPECT_NEAR(tile[0].points.front().x(), 0, 1e-6);
  EXPECT_NEAR(tile[0].points.back().x(), 10, 1e-5);
  // The middle of what is inside lies in z = 0: it was at 0 .. 2 mm.
  EXPECT_NEAR(tile[0].points[1].z(), 1, 1e-6);
  for (const TileCurve& curve : tile) EXPECT_TRUE(curve.is_open);
}

TEST_F(CurveExemplar, ClosedCurvesInsideStayWhole) {
  std::vector<CurvePoint> circle;
  for (int k = 0; k < 40; ++k) {
    const double angle = 2 * kPi * k / 40;
    circle.push_back({static_cast<float>(0.5 + 0.3 * std::cos(angle)),
                      static_cast<float>(0.5 + 0.3 * std::sin(angle)), 0});
  }
  add(circle, true);
  for (CurvePoint& point : circle) point[0] -= 0.5F;  // half of it hangs out of the rectangle
  add(circle, true);
  CurveCut cut;
  const std::vector<TileCurve> tile = curves_on_tile(config(), 0.1, &cut);
  ASSERT_EQ(tile.size(), 2U);
  EXPECT_NEAR((tile[0].points.front() - tile[0].points.back()).norm(), 0, 1e-6);
  EXPECT_EQ(cut.ends, 2U);  // the half is one piece, though it holds the first point
  EXPECT_NEAR(tile[1].points.front().x(), 0, 1e-5);
  EXPECT_NEAR(tile[1].points.back().x(), 0, 1e-5);
  EXPECT_NEAR(cut.kept_mm / cut.whole_mm, 0.75, 1e-3);
}

TEST_F(CurveExemplar, PeriodicCurvesGoOn) {
  std::vector<CurvePoint> wave;
  for (int k = 0; k <= 50; ++k) {
    wave.push_back({static_cast<float>(k) / 50,
                    0.5F + 0.1F * static_cast<float>(std::sin(2 * kPi * k / 50)), 0});
  }
  add(wave);
  CurvesConfig periodic = config();
  periodic.periodic = true;
  CurveCut cut;
  const std::vector<TileCurve> tile = curves_on_tile(periodic, 0.1, &cut);
  ASSERT_EQ(tile.size(), 1U);
  EXPECT_FALSE(tile[0].is_open);
  EXPECT_EQ(cut.ends, 0U);
  EXPECT_EQ(cut.kept_mm, cut.whole_mm);
  periodic.size_mm[0] = 9;
  EXPECT_THROW(curves_on_tile(periodic, 0.1, nullptr), FileError);
}

// The axis after the normal, in the order x, y, z, becomes x.
TEST_F(CurveExemplar, TheNormalBecomesZ) {
  add({{0.1F, 0.2F, 0.3F}, {0.4F, 0.5F, 0.7F}, {0.5F, 0.6F, 0.8F}});
  CurvesConfig along_y = config();
  along_y.normal = UpAxis::kY;
  const Vec3d first = curves_on_tile(along_y, 0.1, nullptr)[0].points.front();
  EXPECT_NEAR(first.x(), 3, 1e-5);
  EXPECT_NEAR(first.y(), 1, 1e-5);
  EXPECT_NEAR(first.z(), -2, 1e-5);  // 2 .. 6, centred
}

TEST_F(CurveExemplar, ARectangleWithoutCurvesIsRefused) {
  add({{3, 3, 0}, {4, 4, 0}});
  try {
    curves_on_tile(config(), 0.1, nullptr);
    ADD_FAILURE();
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("x 30 .. 40 mm"), std::string::npos) << error.what();
  }
}

TEST_F(CurveExemplar, BecomeFibersOrYarns) {
  add({{-0.5F, 0.5F, 0}, {0.5F, 0.52F, 0}, {1.5F, 0.5F, 0}});
  add({{0.2F, -0.5F, 0.05F}, {0.2F, 0.5F, 0.06F}, {0.22F, 1.5F, 0.05F}});
  const Exemplar fibers = synthesized("as = \"fibers\"\n");
  EXPECT_EQ(fibers.fiber_count(), 2U);
  EXPECT_EQ(fibers.is_open, (std::vector<std::uint8_t>{1, 1}));
  EXPECT_FLOAT_EQ(fibers.radius_mm[0], 0.01F);
  const Exemplar yarns = synthesized(
      "as = \"yarns\"\nwidth_mm = 0.4\nheight_mm = 0.2\nplies = 2\nfibers_per_ply = "
      "8\nyarn_twist_per_m = 300\nply_twist_per_m = -600\nmigration = 0.1\nwander_rms_deg = 2\n");
  EXPECT_EQ(yarns.fiber_count(), 32U);
  EXPECT_EQ(yarns.yarn.front(), 0U);
  EXPECT_EQ(yarns.yarn.back(), 1U);
}

TEST_F(CurveExemplar, ThicknessesThatTheFileLacksAreRefused) {
  add({{0.1F, 0.5F, 0}, {0.5F, 0.52F, 0}, {0.7F, 0.5F, 0}});
  EXPECT_THROW(synthesized("as = \"fibers\"\nthickness = \"diameter\"\n"), FileError);
}

}  // namespace
}  // namespace heddle
