#include "render/scene_layers.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <bit>
#include <cmath>
#include <memory>

#include "fibers/scattering/bcsdf_table.h"
#include "tests/support/fibers.h"
#include "tests/support/pictures.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

/// Two warp yarns of one fiber each on a tile of 1 mm: 0.2 mm wide about x = 0.25 and x = 0.75. A
/// weft yarn below them, 0.5 mm wide about y = 0.5.
Exemplar two_over_one() {
  Exemplar exemplar;
  exemplar.width_mm = exemplar.height_mm = 1;
  exemplar.scattering = {test_cotton()};
  add_straight_fiber(exemplar, {0.25F, 0, 0.5F}, false, 0.1F);
  add_straight_fiber(exemplar, {0.75F, 0, 0.5F}, false, 0.1F);
  add_straight_fiber(exemplar, {0, 0.5F, 0}, true, 0.25F);
  exemplar.yarn = {0, 1, 2};
  index_segments(exemplar);
  return exemplar;
}

struct LayerWorld {
  FabricPack pack;
  std::unique_ptr<ClothScene> scene;
  LayerPieces pieces;
};

std::unique_ptr<LayerWorld> make_layer_world(std::vector<TriangleMesh> meshes = {}) {
  auto world = std::make_unique<LayerWorld>();
  world->pack.exemplar = two_over_one();
  world->pack.materials.emplace_back(test_cotton());
  std::vector<ClothPiece> pieces;
  pieces.push_back({std::make_shared<TileScene>(world->pack.exemplar), flat_cloth(4, 3)});
  world->scene = std::make_unique<ClothScene>(std::move(pieces), std::move(meshes));
  SceneConfig config;
  config.cloths.resize(1);
  config.cloths[0].name = "shirt";
  config.cloths[0].flat_width_mm = 4;
  config.cloths[0].flat_height_mm = 3;
  config.meshes.resize(1);
  world->pieces = layer_pieces_of(config);
  return world;
}

/// From so far that rays are parallel: `wide` mm about the origin.
Camera distant_camera(double wide, int pixels, const Vec3d& position = {0, 0, 4000}) {
  return test::camera_from(position, wide, pixels);
}

FrameBuffers layers_of(const LayerWorld& world, const Camera& camera, int spp,
                       const PixelFilter& filter, const PixelRect& crop,
                       const SceneLayerChoice& choice = {true, true}) {
  FrameBuffers frame(crop.width, crop.height);
  frame.spp = spp;
  const GBufferPass pass(*world.scene, {&world.pack}, {}, {}, 3, filter);
  add_scene_layers(
      *world.scene, world.pieces,
      [&](const PixelRect& block, int first, int last) {
        return pass.run(camera, block, first, last);
      },
      camera, crop, 3, choice, frame);
  return frame;
}

/// Share of pixel k that a name covers, as who reads the file would find it.
double coverage(const Cryptomatte& matte, const std::string& name, std::size_t k) {
  double sum = 0;
  for (const Cryptomatte::Rank& rank : matte.pixels[k]) {
    if (rank.id == cryptomatte_id(name)) sum += static_cast<double>(rank.coverage);
  }
  return sum;
}

/// Share of the filter's weight between two places, in pixels from the pixel's middle.
double filtered(FilterShape shape, double width, double from, double to) {
  constexpr int kSteps = 4000;
  double inside = 0;
  double all = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double x = ((k + 0.5) / kSteps - 0.5) * width;
    const double weight = filter_value(shape, x / (0.5 * width));
    all += weight;
    if (from <= x && x < to) inside += weight;
  }
  return inside / all;
}

TEST(SceneLayersLaw, MattesAreTheFilteredCoverage) {
  const auto world = make_layer_world();
  constexpr int kPixels = 16;
  constexpr double kWide = 2.4;
  constexpr int kSamples = 1024;
  const double mm = kWide / kPixels;  // of a pixel
  for (const FilterShape shape :
       {FilterShape::kBox, FilterShape::kGaussian, FilterShape::kBlackmanHarris}) {
    const double width = kFilterWidths[static_cast<std::size_t>(shape)];
    const PixelFilter filter(shape, width);
    SCOPED_TRACE(filter.text());
    // A row of pixels within the weft yarn at y = -0.5: warp yarns cross it.
    const PixelRect crop{0, 11, kPixels, 1};
    const FrameBuffers frame =
        layers_of(*world, distant_camera(kWide, kPixels), kSamples, filter, crop);
    ASSERT_EQ(frame.mattes.size(), 3U);
    double worst = 0;
    for (int x = 0; x < kPixels; ++x) {
      const auto k = static_cast<std::size_t>(x);
      const double middle = (x + 0.5) * mm - 0.5 * kWide;
      double warps = 0;
      // Yarns at -0.75, -0.25, 0.25, 0.75: the tile at the origin holds 0 and 1.
      for (int yarn = -3; yarn < 4; ++yarn) {
        const double centre = 0.25 + 0.5 * yarn;
        const double expected =
            filtered(shape, width, (centre - 0.1 - middle) / mm, (centre + 0.1 - middle) / mm);
        const double found = coverage(frame.mattes[1], "shirt/warp" + std::to_string(yarn), k);
        // Four deviations of samples that are independent; these are stratified.
        const double bound = 4 * std::sqrt(expected * (1 - expected) / kSamples) + 2e-3;
        EXPECT_NEAR(found, expected, bound) << yarn << " in pixel " << x;
        worst = std::max(worst, std::abs(found - expected));
        warps += found;
        const int of_tile = ((yarn % 2) + 2) % 2;
        EXPECT_EQ(
            coverage(frame.mattes[2],
                     "shirt/warp" + std::to_string(yarn) + "/fiber" + std::to_string(of_tile), k),
            found);
      }
      EXPECT_NEAR(coverage(frame.mattes[1], "shirt/weft-1", k), 1 - warps, 1e-6);
      EXPECT_NEAR(coverage(frame.mattes[0], "shirt", k), 1, 1e-6);
    }
    EXPECT_GT(worst, 0);
  }
}

TEST(SceneLayers, ManifestsNameWhatIsSeen) {
  const auto world = make_layer_world();
  const FrameBuffers frame = layers_of(*world, distant_camera(0.9, 16), 4, {}, {0, 0, 16, 16});
  using Names = std::map<std::string, std::uint32_t>;
  EXPECT_EQ(frame.mattes[0].manifest, (Names{{"shirt", cryptomatte_id("shirt")}}));
  const Names& yarns = *frame.mattes[1].manifest;
  for (const char* name : {"shirt/warp-1", "shirt/warp0", "shirt/weft0", "shirt/weft-1"})
    EXPECT_TRUE(yarns.contains(name)) << name;
  EXPECT_EQ(yarns.size(), 4U);
  EXPECT_TRUE(frame.mattes[2].manifest->contains("shirt/warp-1/fiber1"));
}

TEST(SceneLayers, MeshesAndEmptyPixels) {
  // A black mesh over the left half; the cloth is 4 mm wide in a picture of 8 mm.
  const TriangleMesh roof = {{Vec3(-6, -6, 2), Vec3(0, -6, 2), Vec3(0, 6, 2), Vec3(-6, 6, 2)},
                             {{0, 1, 2}, {0, 2, 3}}};
  const auto world = make_layer_world({roof});
  const FrameBuffers frame = layers_of(*world, distant_camera(8, 16), 16, {}, {0, 0, 16, 16});
  const std::size_t left = 8 * 16 + 2;
  const std::size_t right = 8 * 16 + 15;
  EXPECT_EQ(coverage(frame.mattes[0], "mesh1", left), 1);
  EXPECT_EQ(coverage(frame.mattes[2], "mesh1", left), 1);
  EXPECT_NEAR(static_cast<double>(frame.depth[left]), 3998, 1e-2);
  EXPECT_NEAR(static_cast<double>(frame.position[left].z()), 2, 1e-3);
  EXPECT_EQ(frame.mattes[0].pixels[right][0].id, 0U);
  EXPECT_EQ(frame.depth[right], 0);
  EXPECT_TRUE((frame.albedo[right] == 0).all());
}

TEST(SceneLayers, SurfacesOfFibers) {
  const auto world = make_layer_world();
  const Camera camera = distant_camera(2, 8, Vec3d(0, -2000, 3000));
  const FrameBuffers frame = layers_of(*world, camera, 8, {}, {0, 0, 8, 8});
  const Rgb own = fiber_albedo(test_cotton());
  EXPECT_NEAR(own[0], 0.5 + 0.5 * 0.9, 1e-6);
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    if (frame.segment[k] == kNoSegment) continue;
    const Vec3& p = frame.position[k];
    EXPECT_NEAR(frame.uv[k].x(), p.x() / 4 + 0.5, 1e-5);
    EXPECT_NEAR(frame.uv[k].y(), p.y() / 3 + 0.5, 1e-5);
    EXPECT_NEAR(frame.depth[k], camera.depth(p.cast<double>()), 1e-2);
    const double seen = coverage(frame.mattes[0], "shirt", k);
    EXPECT_NEAR(static_cast<double>(frame.normal[k].z()), seen, 1e-6);
    EXPECT_NEAR(static_cast<double>(frame.albedo[k][1]), seen * static_cast<double>(own[1]), 1e-6);
  }
  // From below, the normal is that of the other side.
  const FrameBuffers back =
      layers_of(*world, distant_camera(1, 4, Vec3d(0, 0, -4000)), 2, {}, {0, 0, 4, 4});
  double seen_from_below = 0;
  for (std::size_t k = 0; k < back.pixel_count(); ++k) {
    const double seen = coverage(back.mattes[0], "shirt", k);
    EXPECT_NEAR(static_cast<double>(back.normal[k].z()), -seen, 1e-6);
    seen_from_below += seen;
  }
  EXPECT_GT(seen_from_below, 8);
}

TEST(SceneLayers, NeitherThreadsNorCropsMatter) {
  const auto world = make_layer_world();
  const Camera camera = distant_camera(3, 40);
  const PixelFilter filter(FilterShape::kGaussian, 2);
  const auto made = [&](int threads, const PixelRect& crop) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
    return image_of(layers_of(*world, camera, 10, filter, crop), {});
  };
  const Image one = made(1, {0, 0, 40, 40});
  const Image two = made(2, {0, 0, 40, 40});
  EXPECT_EQ(one.metadata, two.metadata);
  for (const auto& [name, channel] : one.channels) {
    EXPECT_EQ(channel.values, two.channels.at(name).values) << name;
    EXPECT_EQ(channel.ids, two.channels.at(name).ids) << name;
  }
  const Image crop = made(2, {7, 9, 20, 21});
  for (const char* name : {"CryptoYarn00.R", "CryptoFiber02.A", "N.Z", "albedo.R", "P.X", "UV.V"}) {
    for (std::size_t y = 0; y < 21; ++y) {
      for (std::size_t x = 0; x < 20; ++x) {
        ASSERT_EQ(std::bit_cast<std::uint32_t>(crop.channels.at(name).values[y * 20 + x]),
                  std::bit_cast<std::uint32_t>(one.channels.at(name).values[(y + 9) * 40 + x + 7]))
            << name;
      }
    }
  }
}

}  // namespace
}  // namespace heddle
