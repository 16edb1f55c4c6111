#include "precompute/visibility_maps.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <vector>

#include "fibers/cloth/synthesize.h"
#include "formats/input_error.h"
#include "formats/tensor_file.h"
#include "tests/support/fabrics.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

constexpr int kN = VisibilityMaps::kResolution;

VisibilityMaps bake_all(const TileScene& scene, bool both_sides) {
  const SegmentOrigins origins =
      find_segment_origins(scene, both_sides, OriginChoice::kMidpoint, 1);
  return bake_visibility_maps(scene, origins, both_sides, 0,
                              static_cast<std::uint32_t>(scene.exemplar().segment_count()));
}

int open_cells(const SphericalMap& map) {
  int count = 0;
  for (const std::uint64_t word : map.words()) count += std::popcount(word);
  return count;
}

TEST(VisibilityMaps, AFiberDoesNotSeeItselfInAnyCopyOfTheTile) {
  const TileScene scene(test::straight_fibers(1, 1, {Vec2(0.5F, 0)}, 0.05F, 4, {}));
  const VisibilityMaps both = bake_all(scene, true);
  const VisibilityMaps face = bake_all(scene, false);
  ASSERT_EQ(both.count(), 4U);
  for (std::size_t s = 0; s < 4; ++s) {
    EXPECT_EQ(open_cells(both.map(s)), kN * kN);
    EXPECT_EQ(open_cells(face.map(s)), kN * kN / 2);
    EXPECT_TRUE(face.map(s).open(kN / 2 - 1, 5));
    EXPECT_FALSE(face.map(s).open(kN / 2, 5));
    EXPECT_EQ(face.sees_nothing[s], 0);
  }
}

// Two parallel fibers without end and their copies: in the plane across them, the sky is the circle
// less the angle 2 asin(radius / distance) about the direction of each copy of the other fiber.
TEST(VisibilityMapsLaw, ParallelFibersHideTheAngleTheySubtend) {
  const float height = 0.7F;
  const std::vector<Vec2> places = {Vec2(0.2F, 0), Vec2(0.32F, 0.09F)};
  const float radius = 0.04F;
  const TileScene scene(test::straight_fibers(0.9F, height, places, radius, 5, {}));
  const VisibilityMaps maps = bake_all(scene, true);
  const LatLongGrid grid(kN);
  int closed = 0;
  for (const std::uint32_t s : {2U, 8U}) {  // one of either fiber
    const std::uint32_t fiber = scene.exemplar().segment_fiber[s];
    ASSERT_EQ(fiber, s == 2 ? 0U : 1U);
    const Vec2 to_other = places[1 - fiber] - places[fiber];
    const SphericalMap map = maps.map(s);
    for (int row = 0; row < kN; ++row) {
      for (int column = 0; column < kN; ++column) {
        const Vec3d w = grid.centre(row, column);
        // angle between the direction and the limit of a shadow, in the plane
        double nearest_limit = kPi;
        bool hidden = false;
        // Copies farther off lie lower than the row next to the horizon, half a cell = 0.012 above
        // it.
        for (int copy = -20; copy <= 20; ++copy) {
          const double y = to_other.x() + copy * static_cast<double>(height);
          const double between = std::abs(
              std::remainder(std::atan2(w.z(), w.y()) - std::atan2(to_other.y(), y), 2 * kPi));
          const double half_angle = std::asin(radius / std::hypot(y, to_other.y()));
          nearest_limit = std::min(nearest_limit, std::abs(between - half_angle));
          hidden |= between < half_angle;
        }
        if (nearest_limit < 1e-5) continue;
        ASSERT_EQ(map.open(row, column), !hidden)
            << "segment " << s << " row " << row << " column " << column;
        closed += hidden ? 1 : 0;
      }
    }
  }
  EXPECT_GT(closed, 1000);
}

TEST(VisibilityMaps, ASegmentInsideAnotherFiberSeesNothing) {
  const TileScene scene(
      test::straight_fibers(1, 1, {Vec2(0.5F, 0), Vec2(0.51F, 0.01F)}, 0.05F, 3, {}));
  const VisibilityMaps maps = bake_all(scene, true);
  for (std::size_t s = 0; s < maps.count(); ++s) {
    EXPECT_EQ(maps.sees_nothing[s], 1);
    EXPECT_TRUE(maps.map(s).all_closed());
  }
}

// What the projection of hit fibers closes, a ray of its own would have closed too. Rays that graze
// a fiber within rounding may differ: none did in 5 million cells of three fabrics, 1 in 100,000 is
// allowed.
TEST(VisibilityMapsAgreement, OneOcclusionRayPerCell) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    for (const bool both_sides : {false, true}) {
      const TileScene scene(synthesize(config));
      const Exemplar& exemplar = scene.exemplar();
      const SegmentOrigins origins =
          find_segment_origins(scene, both_sides, OriginChoice::kExposed, 1);
      const LatLongGrid grid(kN);
      int cells = 0;
      int different = 0;
      int open = 0;
      for (std::uint32_t s = 0; s < exemplar.segment_count(); s += 61) {
        const SphericalMap map = bake_visibility_maps(scene, origins, both_sides, s, s + 1).map(0);
        for (int row = 0; row < (both_sides ? kN : kN / 2); ++row) {
          for (int column = 0; column < kN; ++column) {
            const Ray ray{origins.position[s], grid.centre(row, column).cast<float>()};
            const bool expected = !scene.occluded(ray, exemplar.segment_fiber[s]);
            ++cells;
            open += expected ? 1 : 0;
            different += map.open(row, column) != expected ? 1 : 0;
          }
        }
      }
      EXPECT_GT(open, cells / 50);
      EXPECT_LT(open, cells - cells / 50);
      EXPECT_LE(different, cells / 100000);
    }
  }
}

TEST(VisibilityMapsEndToEnd, SameForAnyNumberOfThreadsAndChunks) {
  const TileScene scene(synthesize(test::small_fabric()));
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const std::uint32_t count = 120;
  VisibilityMaps one_thread;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one_thread = bake_visibility_maps(scene, origins, false, 0, count);
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  VisibilityMaps chunks = bake_visibility_maps(scene, origins, false, 0, 50);
  chunks.append(bake_visibility_maps(scene, origins, false, 50, count));
  EXPECT_EQ(chunks.words, one_thread.words);
  EXPECT_EQ(chunks.sees_nothing, one_thread.sees_nothing);
}

class VisibilityMapsFormat : public testing::Test {
 protected:
  TemporaryFolder temporary_;
  std::filesystem::path path_ = temporary_.path() / "maps.safetensors";
};

TEST_F(VisibilityMapsFormat, RoundTrip) {
  VisibilityMaps maps;
  maps.first_segment = 40;
  maps.words.assign(3 * maps.words_per_map(), 0);
  maps.words[5] = 0x123456789abcdef0U;
  maps.words[2 * maps.words_per_map()] = 1;
  maps.sees_nothing = {0, 1, 0};
  write_visibility_maps(path_, maps, {{"key", "abc"}});
  const VisibilityMaps read = read_visibility_maps(path_);
  EXPECT_EQ(read.first_segment, 40U);
  EXPECT_FALSE(read.both_sides);
  EXPECT_EQ(read.words, maps.words);
  EXPECT_EQ(read.sees_nothing, maps.sees_nothing);
  EXPECT_TRUE(read.map(2).open(0, 0));
  EXPECT_EQ(TensorFile::read(path_).metadata_value("key"), "abc");
}

TEST_F(VisibilityMapsFormat, RefusesOtherShapes) {
  const std::vector<std::uint64_t> words(200, 0);
  const std::vector<std::uint32_t> first = {0};
  for (const char* light_from : {"face", "both", "below"}) {
    TensorFileWriter file;
    file.set_metadata("light_from", light_from);
    file.add<std::uint32_t>("first_segment", {1}, first);
    file.add<std::uint64_t>("maps", {1, 200}, words);
    file.write(path_);
    EXPECT_THROW(read_visibility_maps(path_), FileError) << light_from;
  }
}

}  // namespace
}  // namespace heddle
