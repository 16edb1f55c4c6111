#include "fibers/cloth/exemplar.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "fibers/cloth/bundle_tangents.h"
#include "fibers/cloth/synthesize.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/input_error.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"
#include "tests/support/mutations.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

TEST(ExemplarFormat, RoundTripKeepsEveryBit) {
  const Exemplar a = synthesize(test::small_fabric());
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "fibers.safetensors";
  write_exemplar(path, a, {{"key", "k"}});
  const Exemplar b = read_exemplar(path);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.first_point, b.first_point);
  EXPECT_EQ(a.radius_mm, b.radius_mm);
  EXPECT_EQ(a.material, b.material);
  EXPECT_EQ(a.segment_point, b.segment_point);
  EXPECT_EQ(a.z_max, b.z_max);
  EXPECT_EQ(a.scattering[0].beta_tt, b.scattering[0].beta_tt);
  EXPECT_TRUE((a.scattering[0].color_tt == b.scattering[0].color_tt).all());
}

TEST(ExemplarFormat, EachBrokenInvariantIsNamed) {
  Exemplar good =
      test::straight_fibers(1, 1, {{0.3F, 0}, {0.6F, 0.1F}}, 0.02F, 4, test::white_fiber());
  good.scattering.push_back(
      {Rgbd(0, 0.5, 1), Rgbd(0, 0.5, 1), radians(0.1), radians(60), radians(180)});
  EXPECT_NO_THROW(validate_exemplar(good, "good"));
  const std::vector<std::pair<int, std::function<void(Exemplar&)>>> breakages = {
      {1, [](Exemplar& e) { e.first_point[1] = 2; }},
      {1, [](Exemplar& e) { e.points.pop_back(); }},
      {1, [](Exemplar& e) { e.first_point[1] = 4000000000U; }},
      {2, [](Exemplar& e) { e.points[3].z() = std::numeric_limits<float>::quiet_NaN(); }},
      {2, [](Exemplar& e) { e.radius_mm[1] = 0; }},
      {2, [](Exemplar& e) { e.radius_mm[0] = 0.6F; }},
      {2, [](Exemplar& e) { e.radius_mm[1] = 1e-30F; }},
      {2, [](Exemplar& e) { e.width_mm = -1; }},
      {2, [](Exemplar& e) { e.height_mm = 1e30F; }},
      {2,
       [](Exemplar& e) {
         for (Vec3& p : e.points) p.x() += 2;
       }},
      {2,
       [](Exemplar& e) {
         for (Vec3& p : e.points) p.y() -= 2;
       }},
      {2, [](Exemplar& e) { e.points[2].x() = 1e30F; }},
      {2, [](Exemplar& e) { e.points[2].y() = -4e9F; }},
      {2, [](Exemplar& e) { e.points[2].z() = 1e4F; }},
      {3, [](Exemplar& e) { e.points[4].y() += 0.01F; }},
      {4, [](Exemplar& e) { e.points[2] = e.points[1]; }},
      {5, [](Exemplar& e) { e.material[1] = 2; }},
      {5, [](Exemplar& e) { e.scattering.resize(65, e.scattering[0]); }},
      {6, [](Exemplar& e) { e.scattering[1].color_tt[2] = 1.5; }},
      {6, [](Exemplar& e) { e.scattering[1].beta_r = 0; }},
      {6, [](Exemplar& e) { e.scattering[1].beta_tt = 1e300; }},
      {6, [](Exemplar& e) { e.scattering[1].gamma_tt = -1; }},
  };
  for (const auto& [invariant, breakage] : breakages) {
    Exemplar bad = good;
    breakage(bad);
    try {
      validate_exemplar(bad, "bad.safetensors");
      ADD_FAILURE() << "invariant " << invariant << " was not checked";
    } catch (const FileError& error) {
      EXPECT_NE(
          std::string(error.what()).find("bad.safetensors: invariant " + std::to_string(invariant)),
          std::string::npos)
          << error.what();
    }
  }
}

TEST(ExemplarFormat, DamagedFilesEndInAnErrorOrInFibersThatRaysCanMeet) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "fibers.safetensors";
  write_exemplar(
      path, test::straight_fibers(1, 1, {{0.3F, 0}, {0.6F, 0.1F}}, 0.02F, 4, test_cotton()), {});
  int refused = 0;
  int read = 0;
  for_each_mutation(bytes_of(path), 3, std::string_view("\0\x7f\xff", 3),
                    [&](const std::string& damaged) {
                      write_bytes(path, damaged);
                      try {
                        const Exemplar exemplar = read_exemplar(path);
                        if (++read % 8 != 0) return;
                        EXPECT_EQ(bundle_tangents(exemplar).size(), exemplar.segment_count());
                        const TileScene scene(exemplar);
                        EXPECT_LT(scene.memory_bytes(), 100'000U);
                      } catch (const FileError&) {
                        ++refused;
                      }
                    });
  EXPECT_GT(refused, 500);
  EXPECT_GT(read, 50);
}

}  // namespace
}  // namespace heddle
