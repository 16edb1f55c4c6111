#include "render/precomputed_renderer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <memory>
#include <utility>

#include "fibers/math/sampling.h"
#include "formats/input_error.h"
#include "precompute/far_bake.h"
#include "tests/support/fibers.h"
#include "tests/support/near_lights.h"
#include "tests/support/pictures.h"
#include "tests/support/small_exemplars.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

/// Data that hide nothing: every direction is open, and light reaches every fiber once more as it
/// came from the lamp.
FabricPack open_pack(const FiberScattering& scattering, bool both_sides = false) {
  FabricPack pack;
  pack.folder = "open.pack";
  pack.exemplar = crossed_layers(scattering);
  pack.light_from_both_sides = both_sides;
  pack.materials.emplace_back(scattering);
  const std::size_t segments = pack.exemplar.segment_count();

  pack.ssdf = open_distances(segments);

  SgVisibility lobes;
  lobes.sharpness = 48;
  lobes.axes = {Vec3(0, 0, 1)};
  lobes.weights.assign(segments, half_from_float(0));
  lobes.rotation.assign(segments, half_from_float(0));
  lobes.sees_nothing.assign(segments, 1);
  pack.sgs = std::move(lobes);

  Transfer transfer;
  transfer.order = 0;
  transfer.both_sides = both_sides;
  transfer.cell_of_segment.assign(segments, 0);
  transfer.matrices = {1, 1, 1};
  transfer.standard_error = {0, 0, 0};
  transfer.paths = {1};
  pack.transfer = std::move(transfer);

  // Straight fibers along the axes: voxels by the distance to a line.
  IdVolume volume;
  volume.size = {40, 50, 48};
  volume.voxel_mm = {pack.exemplar.width_mm / 40, pack.exemplar.height_mm / 50,
                     (pack.exemplar.z_max - pack.exemplar.z_min) / 48};
  volume.origin_mm = {0, 0, pack.exemplar.z_min};
  for (int z = 0; z < 48; ++z) {
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 40; ++x) {
        const Vec3 centre = Vec3d((x + 0.5) * volume.voxel_mm[0], (y + 0.5) * volume.voxel_mm[1],
                                  volume.origin_mm[2] + (z + 0.5) * volume.voxel_mm[2])
                                .cast<float>();
        std::int32_t id = -1;
        for (std::uint32_t s = 0; s < segments; ++s) {
          const Vec3 tangent = pack.exemplar.segment_tangent(s);
          Vec3 offset = centre - pack.exemplar.segment_midpoint(s);
          offset.x() -= pack.exemplar.width_mm * std::round(offset.x() / pack.exemplar.width_mm);
          offset.y() -= pack.exemplar.height_mm * std::round(offset.y() / pack.exemplar.height_mm);
          const float along = offset.dot(tangent);
          const float half = 0.125F * (std::abs(tangent.x()) > 0.5F ? pack.exemplar.width_mm
                                                                    : pack.exemplar.height_mm);
          if (std::abs(along) <= half && (offset - along * tangent).norm() <= 0.0175F)
            id = static_cast<std::int32_t>(s);
        }
        volume.ids.push_back(id);
      }
    }
  }
  pack.volume = std::move(volume);
  return pack;
}

Light directional(const Vec3& axis, float irradiance) {
  return {LightType::kDirectional, axis.normalized(), 0, Rgb::Constant(irradiance)};
}

Light gaussian(const Vec3& axis, float sharpness, float irradiance) {
  return {LightType::kSphericalGaussian, axis.normalized(), sharpness, Rgb::Constant(irradiance)};
}

/// Half of the plane z = 1 mm over the cloth: x > 0.
TriangleMesh half_roof() {
  return {{Vec3(0, -50, 1), Vec3(50, -50, 1), Vec3(50, 50, 1), Vec3(0, 50, 1)},
          {{0, 1, 2}, {0, 2, 3}}};
}

struct PackWorld {
  FabricPack pack;
  std::unique_ptr<ClothScene> scene;
  std::vector<const FabricPack*> packs;
  std::vector<Light> lights;

  PrecomputedRenderer renderer(const PrecomputedSettings& settings = {}) const {
    return {*scene, packs, lights, Rgb(0.25F, 0.5F, 0.75F), settings};
  }
};

std::unique_ptr<PackWorld> make_world(FabricPack pack, std::vector<Light> lights,
                                      std::vector<TriangleMesh> meshes = {},
                                      bool underlay = false) {
  auto world = std::make_unique<PackWorld>();
  world->pack = std::move(pack);
  std::vector<ClothPiece> pieces;
  pieces.push_back({std::make_shared<TileScene>(world->pack.exemplar), flat_cloth(6, 4), underlay});
  world->scene = std::make_unique<ClothScene>(std::move(pieces), std::move(meshes));
  world->packs = {&world->pack};
  world->lights = std::move(lights);
  return world;
}

/// Looks at the cloth from above, from under the roof; `wide` mm of it fill the width of the
/// picture.
Camera camera_above(double wide, int width, int height) {
  CameraConfig config;
  config.position = Vec3d(0.01, -0.3, 0.9);
  config.look_at = Vec3d(0.01, 0, 0);
  config.fov = 2 * std::atan(0.5 * wide / config.position.norm());
  config.width = width;
  config.height = height;
  return Camera(config);
}

TEST(PrecomputedRendererLaw, OpenFurnaceOfWhiteFibersIsOne) {
  // Light 1 from everywhere (irradiance 4 pi), handed on by an identity: the white isotropic fiber
  // shows 1, in every pixel on the cloth; nothing is seen by single scattering, whose lobes are all
  // dark.
  const auto world =
      make_world(open_pack(test::white_fiber(), true), {gaussian({0, 0, 1}, 0, 4 * kPif)});
  const FrameBuffers frame = shade_picture(world->renderer(), camera_above(1, 24, 16),
                                           {0, 0, 24, 16}, 2, test::no_progress);
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    EXPECT_EQ(frame.single[k].maxCoeff(), 0);
    if (frame.alpha[k] < 1) continue;
    // The table of the light's moments is good to 5e-4.
    EXPECT_LT((frame.multiple[k] - 1).abs().maxCoeff(), 1e-3);
    EXPECT_LT((frame.beauty[k] - 1).abs().maxCoeff(), 1e-3);
  }
}

// Local visibility knows already that the cloth hides what lies below it: an underlay does so once
// more. Light of which a part lies below must not be darkened by it again.
TEST(PrecomputedRendererLaw, AnUnderlayDoesNotDarkenLightFromBothSides) {
  const std::vector<Light> lights = {gaussian({0.7F, 0, 0.7F}, 2, 3)};
  const FabricPack pack = open_pack(test::white_fiber(), true);
  const auto bare = make_world(pack, lights);
  const auto lined = make_world(pack, lights, {}, true);
  const Camera camera = camera_above(1, 12, 8);
  const auto picture = [&](const PackWorld& world) {
    return shade_picture(world.renderer(), camera, {0, 0, 12, 8}, 4, test::no_progress);
  };
  const FrameBuffers expected = picture(*bare);
  const FrameBuffers got = picture(*lined);
  for (std::size_t k = 0; k < got.pixel_count(); ++k) {
    if (expected.alpha[k] < 1) continue;
    EXPECT_LT((got.beauty[k] - expected.beauty[k]).abs().maxCoeff(), 1e-6) << k;
  }
}

TEST(PrecomputedRendererLaw, RivalsShowTheOpenFurnaceAsOne) {
  // Nothing hides anything in this pack's signed distances, so single scattering of white fibers in
  // light 1 is 1.
  const auto world =
      make_world(open_pack(test::white_fiber(), true), {gaussian({0, 0, 1}, 0, 4 * kPif)});
  for (const RenderMethod method :
       {RenderMethod::kPrt, RenderMethod::kTsaiShih16, RenderMethod::kTsaiShihFull}) {
    PrecomputedSettings settings;
    settings.method = method;
    const FrameBuffers frame = shade_picture(world->renderer(settings), camera_above(1, 12, 8),
                                             {0, 0, 12, 8}, 1, test::no_progress);
    for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
      if (frame.alpha[k] < 1) continue;
      EXPECT_LT((frame.single[k] - 1).abs().maxCoeff(), 0.01);  // 1 %: weak lobes left out
    }
  }
}

TEST(PrecomputedRenderer, DualScatteringNeedsNothingBaked) {
  // A fiber that the light reaches shows its BCSDF as `single`; all show something in `multiple`.
  const FiberScattering cotton = test_cotton();
  FabricPack bare = open_pack(cotton);
  bare.ssdf.reset();
  bare.sgs.reset();
  bare.transfer.reset();
  const auto world = make_world(std::move(bare), {directional({0.4F, 0.1F, 1}, 2)});
  const auto shipped = make_world(open_pack(cotton), {directional({0.4F, 0.1F, 1}, 2)});
  const Camera camera = camera_above(0.4, 16, 16);
  PrecomputedSettings settings;
  settings.method = RenderMethod::kDualScattering;
  const FrameBuffers dual =
      shade_picture(world->renderer(settings), camera, {0, 0, 16, 16}, 1, test::no_progress);
  const FrameBuffers open =
      shade_picture(shipped->renderer(), camera, {0, 0, 16, 16}, 1, test::no_progress);
  int lit = 0;
  for (std::size_t k = 0; k < dual.pixel_count(); ++k) {
    if (dual.alpha[k] < 1) continue;
    EXPECT_GT(dual.multiple[k].maxCoeff(), 0);
    if (!(dual.single[k].maxCoeff() > 0)) continue;
    EXPECT_LT((dual.single[k] - open.single[k]).abs().maxCoeff(),
              1e-4F * open.single[k].maxCoeff());
    ++lit;
  }
  EXPECT_GT(lit, 50);
}

TEST(PrecomputedRenderer, SingleScatteringIsTheBcsdfAtTheFiberSeen) {
  const FiberScattering cotton = test_cotton();
  const Vec3 towards = Vec3(0.4F, 0.1F, 1).normalized();
  const auto world = make_world(open_pack(cotton), {directional(towards, 2)});
  const Camera camera = camera_above(0.02, 5, 5);  // 4 um per pixel
  const FrameBuffers frame =
      shade_picture(world->renderer(), camera, {0, 0, 5, 5}, 1, test::no_progress);
  int checked = 0;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) {
      const std::size_t k = static_cast<std::size_t>(5 * y + x);
      if (frame.segment[k] == 0xffffffffU) continue;
      const Vec3 tangent = world->pack.exemplar.segment_tangent(frame.segment[k]);
      EXPECT_LT((frame.tangent[k] - tangent).norm(), 1e-5);
      RandomStream eye =
          RandomStream::stratified(1, RandomStage::kEyeRay, static_cast<std::uint64_t>(k), 0);
      const double px = x + eye.uniform_double();
      const double py = y + eye.uniform_double();
      const Vec3 wo = -camera.ray(px, py).direction;
      const Mat3 to_fiber = frame_about(tangent).transpose();
      const Vec3 wi = to_fiber * towards;
      const Rgb expected =
          2 * std::sqrt(1 - wi.x() * wi.x()) * world->pack.materials[0].evaluate(wi, to_fiber * wo);
      EXPECT_LT(((frame.single[k] - expected) / expected).abs().maxCoeff(), 1e-3);
      ++checked;
    }
  }
  EXPECT_GT(checked, 15);
}

TEST(PrecomputedRendererLaw, ShadowOfARoofIsHardInSingleAndGaussianInMultipleScattering) {
  // The roof's edge is at x = 0 and the light straight above. Share of light at x: a step, and the
  // normal distribution function Phi(-x / sigma).
  const auto world =
      make_world(open_pack(test::white_fiber()), {directional({0, 0, 1}, 1)}, {half_roof()});
  PrecomputedSettings settings;
  settings.shadow_sigma_mm = 0.1;
  const FrameBuffers shaded = shade_picture(world->renderer(settings), camera_above(0.8, 32, 24),
                                            {0, 0, 32, 24}, 16, test::no_progress);
  const auto open = make_world(open_pack(test::white_fiber()), {directional({0, 0, 1}, 1)});
  const FrameBuffers lit = shade_picture(open->renderer(settings), camera_above(0.8, 32, 24),
                                         {0, 0, 32, 24}, 16, test::no_progress);
  double worst = 0;
  for (int x = 0; x < 32; ++x) {
    double multiple = 0;
    double multiple_lit = 0;
    double single = 0;
    double single_lit = 0;
    double position = 0;
    int pixels = 0;
    for (int y = 0; y < 24; ++y) {
      const std::size_t k = static_cast<std::size_t>(32 * y + x);
      multiple += shaded.multiple[k][0];
      multiple_lit += lit.multiple[k][0];
      single += shaded.single[k][0];
      single_lit += lit.single[k][0];
      if (lit.segment[k] == 0xffffffffU) continue;
      position += lit.fabric_position[k].x();
      ++pixels;
    }
    position /= pixels;
    const double expected = 0.5 * std::erfc(position / 0.1 / std::sqrt(2.0));
    // 24 x 16 draws of 0 or 1, and the column's 0.025 mm, over which Phi bends by less than 0.01.
    const double error = std::abs(multiple / multiple_lit - expected) - 0.01;
    worst = std::max(worst, error / std::sqrt(expected * (1 - expected) / (24 * 16) + 1e-6));
    if (std::abs(position) > 0.05) {
      EXPECT_NEAR(single / single_lit, position < 0 ? 1 : 0, 1e-6);
    }
  }
  std::printf("  worst column: %.2f standard errors\n", worst);
  EXPECT_LT(worst, 3.5);  // of 32 columns
}

/// The pack with its far form.
FabricPack with_far_form(FabricPack pack) {
  const TileScene tile(pack.exemplar);
  FarSettings settings;
  settings.resolution = 24;
  settings.rays = 512;
  pack.far = bake_far({&tile, &*pack.ssdf, &*pack.transfer, {}, pack.materials, 0.22}, settings,
                      [](double) {});
  return pack;
}

Rgbd mean_of_layer(const std::vector<Rgb>& layer) {
  Rgbd sum = Rgbd::Zero();
  for (const Rgb& value : layer) sum += value.cast<double>();
  return sum / static_cast<double>(layer.size());
}

TEST(PrecomputedRendererLaw, FarFormHasTheMeanOfTheFibers) {
  const Camera camera = camera_above(1.5, 16, 12);
  for (const Light& light : {gaussian({0.5F, 0.3F, 1}, 150, 1), gaussian({-0.9F, 0.1F, 1}, 40, 1),
                             directional({0.2F, 0.3F, 1}, 1)}) {
    const auto world = make_world(with_far_form(open_pack(test_cotton())), {light}, {half_roof()});
    PrecomputedSettings settings;
    settings.blend = kSignedDistanceOnly;
    settings.far_forms = {std::make_shared<const FarForm>(*world->pack.far)};
    const FrameBuffers exact =
        shade_picture(world->renderer(settings), camera, {0, 0, 16, 12}, 256, test::no_progress);
    settings.far_from = 0;
    const FrameBuffers far =
        shade_picture(world->renderer(settings), camera, {0, 0, 16, 12}, 16, test::no_progress);
    const auto error = [](const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
      return (mean_of_layer(a) / mean_of_layer(b) - 1).abs().maxCoeff();
    };
    EXPECT_LT(error(far.single, exact.single), 0.03);
    EXPECT_LT(error(far.multiple, exact.multiple), 0.03);
    // Gaps between the fibers show the background.
    double alpha = 0;
    for (std::size_t k = 0; k < far.pixel_count(); ++k)
      alpha += static_cast<double>(far.alpha[k] - exact.alpha[k]);
    EXPECT_NEAR(alpha / static_cast<double>(far.pixel_count()), 0, 0.02);
  }
}

TEST(PrecomputedRenderer, FarFormIsSeenWherePixelsCoverRepeats) {
  // Pixels are 0.1 mm, a repeat 0.22: below half of far_from all is as it was, to the bit; above
  // far_from nothing but the far form is seen, which holds no segments.
  const auto world =
      make_world(with_far_form(open_pack(test_cotton())), {directional({0, 0, 1}, 1)});
  const Camera camera = camera_above(1.6, 16, 12);
  const auto shown = [&](std::optional<float> far_from) {
    PrecomputedSettings settings;
    settings.far_from = far_from;
    settings.far_forms = {std::make_shared<const FarForm>(*world->pack.far)};
    return shade_picture(world->renderer(settings), camera, {0, 0, 16, 12}, 2, test::no_progress);
  };
  const FrameBuffers fibers = shown({});
  const FrameBuffers near = shown(1.5F);
  const FrameBuffers far = shown(0.1F);
  const FrameBuffers between = shown(0.6F);
  int mixed = 0;
  for (std::size_t k = 0; k < fibers.pixel_count(); ++k) {
    EXPECT_TRUE((near.beauty[k] == fibers.beauty[k]).all());
    EXPECT_EQ(far.segment[k], kNoSegment);
    mixed += between.segment[k] == kNoSegment;
  }
  EXPECT_GT(mixed, 10);
  EXPECT_LT(mixed, 180);
}

TEST(PrecomputedRenderer, KeptSamplesGiveTheSamePicture) {
  // Fibers, far forms, gaps, a black mesh and the empty background, in two light groups. The file
  // serves every way of relighting; samples of pixels end in the middle of a chunk.
  const auto world = make_world(with_far_form(open_pack(test_cotton())),
                                {gaussian({0.5F, 0.3F, 1}, 150, 1)}, {half_roof()});
  const Camera camera = camera_above(7, 40, 20);
  const PixelRect crop{3, 2, 36, 17};
  constexpr int kSpp = 11;
  const auto renderer = [&](const std::vector<Light>& lights, std::uint64_t seed) {
    PrecomputedSettings settings;
    settings.seed = seed;
    settings.far_from = 2.5F;
    settings.far_forms = {std::make_shared<const FarForm>(*world->pack.far)};
    return std::make_unique<PrecomputedRenderer>(*world->scene, world->packs, lights,
                                                 Rgb(0.25F, 0.5F, 0.75F), settings);
  };
  const std::vector<Light> dim = {directional({-0.3F, 0.2F, 1}, 1)};
  const std::vector<Light> bright = {directional({-0.3F, 0.2F, 1}, 3)};
  const std::vector<Light> moved = {gaussian({0.9F, 0.2F, 1}, 40, 3)};
  const auto first = renderer(world->lights, 1);
  const auto picture = [&](const PrecomputedRenderer& a, const PrecomputedRenderer& b,
                           const SampleStore& store) {
    const PrecomputedRenderer* groups[] = {&a, &b};
    return shade_picture(groups, camera, crop, kSpp, test::no_progress, {}, store);
  };
  const TemporaryFolder folder;
  ChunkFileWriter writer(folder.path() / "kept", kKeptMark, "");
  const FrameBuffers kept =
      picture(*first, *renderer(dim, 2), {.to = &writer, .keeps_light = true});
  writer.commit();
  const ChunkFile file(folder.path() / "kept", kKeptMark, kKeptKind);
  using enum SampleStore::Use;
  const auto dark = renderer({}, 1);
  for (const auto& [lights, use] :
       {std::pair{dim, kLight}, {bright, kVisibility}, {moved, kSights}}) {
    const FrameBuffers rendered = picture(*first, *renderer(lights, 2), {});
    const FrameBuffers relit =
        picture(*dark, *renderer(use == kLight ? std::vector<Light>{} : lights, 2),
                {.from = &file, .use = {kLight, use}, .kept_groups = 2});
    int differ = 0;
    int as_kept = 0;
    for (std::size_t k = 0; k < rendered.pixel_count(); ++k) {
      differ += (relit.beauty[k] != rendered.beauty[k]).any() ||
                (relit.single[k] != rendered.single[k]).any() ||
                (relit.variance[k] != rendered.variance[k]).any() ||
                (relit.light_groups[1].light[k] != rendered.light_groups[1].light[k]).any() ||
                relit.alpha[k] != rendered.alpha[k] || relit.depth[k] != rendered.depth[k] ||
                relit.segment[k] != rendered.segment[k] ||
                relit.fabric_position[k] != rendered.fabric_position[k];
      as_kept += (relit.beauty[k] == kept.beauty[k]).all();
    }
    EXPECT_EQ(differ, 0);
    EXPECT_EQ(as_kept == static_cast<int>(kept.pixel_count()), use == kLight);
  }
}

/// Solid angle of a rectangle from (0, 0) to (a, b) seen from `distance` straight before its
/// corner.
double corner_solid_angle(double a, double b, double distance) {
  return std::atan(a * b / (distance * std::sqrt(a * a + b * b + distance * distance)));
}

TEST(PrecomputedRendererLaw, FoldsLightEachOther) {
  // A floor and a wall that faces it. Light grazes the floor from below and shines on the wall
  // alone. Where fibers show no single scattering and hand on what arrives, radiance is k times the
  // light from all around, with k = 1 / 2 pi for light from the face. So the floor shows k^2 E
  // times the solid angle of the wall.
  FabricPack pack = open_pack(test::white_fiber());
  std::fill(pack.ssdf->sees_nothing.begin(), pack.ssdf->sees_nothing.end(), std::uint8_t{1});
  pack = with_far_form(std::move(pack));
  ClothMesh wall = flat_cloth(2, 4);
  for (Vec3d& p : wall.positions) p = Vec3d(-0.6 + p.z(), p.y(), 1.1 - p.x());
  for (Vec3d& n : wall.normals) n = Vec3d(1, 0, 0);
  const auto tile = std::make_shared<TileScene>(pack.exemplar);
  std::vector<ClothPiece> pieces;
  pieces.push_back({tile, flat_cloth(6, 4)});
  pieces.push_back({tile, wall});
  const ClothScene scene(std::move(pieces), {});
  const std::vector<const FabricPack*> packs = {&pack, &pack};
  const std::vector<Light> lights = {directional({1, 0, -0.02F}, 3)};
  const auto shown = [&](int bounces) {
    PrecomputedSettings settings;
    settings.bounces = bounces;
    settings.far_forms.assign(2, std::make_shared<const FarForm>(*pack.far));
    const PrecomputedRenderer renderer(scene, packs, lights, Rgb::Zero(), settings);
    return mean_of_layer(
        shade_picture(renderer, camera_above(0.05, 8, 8), {0, 0, 8, 8}, 256, test::no_progress)
            .multiple)[1];
  };
  EXPECT_EQ(shown(0), 0);
  const double once = shown(1);
  const double solid_angle =
      2 * (corner_solid_angle(2, 2.1, 0.6) - corner_solid_angle(2, 0.1, 0.6));
  EXPECT_NEAR(once / (3 * solid_angle / (4 * kPi * kPi)), 1, 0.08);
  // The next way that reaches the floor has three bounces: wall, floor, wall.
  EXPECT_NEAR(shown(2) / once, 1, 0.02);
  EXPECT_GT(shown(3) / once, 1.02);
}

TEST(PrecomputedRenderer, APackWithoutFarFormIsRefused) {
  const auto world = make_world(open_pack(test_cotton()), {directional({0, 0, 1}, 1)});
  PrecomputedSettings settings;
  settings.far_from = 1;
  EXPECT_THROW(world->renderer(settings), FileError);
}

TEST(PrecomputedRenderer, LightFromBelowLeavesClothLitFromTheFaceDark) {
  for (const bool both_sides : {false, true}) {
    for (const Light& light : {directional({0.1F, 0, -1}, 1), gaussian({0.1F, 0, -1}, 500, 1)}) {
      const auto world = make_world(open_pack(test_cotton(), both_sides), {light});
      const FrameBuffers frame = shade_picture(world->renderer(), camera_above(1, 8, 8),
                                               {0, 0, 8, 8}, 2, test::no_progress);
      float brightest = 0;
      for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
        brightest = std::max(brightest, (frame.single[k] + frame.multiple[k]).maxCoeff());
      }
      EXPECT_EQ(brightest > 0, both_sides);
    }
  }
}

TEST(PrecomputedRenderer, BackgroundAndAlphaFillWhatTheClothLeaves) {
  const auto world = make_world(open_pack(test_cotton()), {directional({0, 0, 1}, 1)});
  const FrameBuffers frame = shade_picture(world->renderer(), camera_above(20, 20, 20),
                                           {0, 0, 20, 20}, 4, test::no_progress);
  int covered = 0;
  int empty = 0;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    const Rgb background = (1 - frame.alpha[k]) * Rgb(0.25F, 0.5F, 0.75F);
    EXPECT_LT((frame.beauty[k] - frame.single[k] - frame.multiple[k] - background).abs().maxCoeff(),
              1e-5);
    EXPECT_LT((frame.beauty[k] - 0.5F * (frame.half0[k] + frame.half1[k])).abs().maxCoeff(), 1e-5);
    covered += frame.alpha[k] == 1;
    empty += frame.alpha[k] == 0;
    EXPECT_EQ(frame.depth[k] > 0, frame.segment[k] != 0xffffffffU);
  }
  EXPECT_GT(covered, 10);
  EXPECT_GT(empty, 10);
}

TEST(PrecomputedRendererLaw, LightGroupsAreThePartsOfTheWhole) {
  const std::vector<Light> all = {directional({0.3F, 0.2F, 1}, 1), gaussian({-1, 0, 1}, 30, 2),
                                  gaussian({0, 1, 1}, 4, 3)};
  const FabricPack pack = open_pack(test_cotton(), true);
  const auto whole = make_world(pack, all, {half_roof()});
  const auto first = make_world(pack, {all[0], all[2]}, {half_roof()});
  const auto second = make_world(pack, {all[1]}, {half_roof()});
  PrecomputedSettings settings;
  const PixelRect crop = {0, 0, 20, 18};
  const Camera camera = camera_above(5, 20, 18);
  const auto shown = [&](const PackWorld& world) {
    return shade_picture(world.renderer(settings), camera, crop, 6, test::no_progress);
  };
  const FrameBuffers alone[2] = {shown(*first), shown(*second)};
  const FrameBuffers together = shown(*whole);
  EXPECT_TRUE(together.light_groups.empty() && together.background.empty());
  const PrecomputedRenderer one = first->renderer(settings);
  const PrecomputedRenderer two(*second->scene, second->packs, second->lights, Rgb(0, 0, 0),
                                settings);
  const PrecomputedRenderer* groups[] = {&one, &two};
  const FrameBuffers frame = shade_picture(groups, camera, crop, 6, test::no_progress);
  ASSERT_EQ(frame.light_groups.size(), 2U);
  double difference = 0;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    Rgb sum = frame.background[k];
    for (std::size_t g = 0; g < 2; ++g) {
      const Rgb expected = alone[g].single[k] + alone[g].multiple[k];
      EXPECT_LE((frame.light_groups[g].light[k] - expected).abs().maxCoeff(), 1e-6F);
      sum += frame.light_groups[g].light[k];
    }
    EXPECT_LE((frame.beauty[k] - sum).abs().maxCoeff(), 1e-6F * sum.maxCoeff());
    EXPECT_EQ(frame.alpha[k], together.alpha[k]);
    EXPECT_EQ(frame.segment[k], together.segment[k]);
    EXPECT_LE(
        (frame.background[k] - (1 - frame.alpha[k]) * Rgb(0.25F, 0.5F, 0.75F)).abs().maxCoeff(),
        1e-6F);
    difference += static_cast<double>((frame.light_groups[1].light[k]).maxCoeff());
  }
  EXPECT_GT(difference, 1);
}

TEST(PrecomputedRendererLaw, TransmittedIsWhatFibersWithoutTtDoNotShow) {
  const std::vector<Light> lights = {directional({0.3F, 0.2F, 1}, 1), gaussian({-1, 0, 1}, 30, 2),
                                     gaussian({0, 1, 1}, 15, 3)};
  FabricPack pack = open_pack(test_cotton(), true);
  pack.sgs->sees_nothing.assign(pack.exemplar.segment_count(), 0);
  pack.sgs->weights.assign(pack.exemplar.segment_count(), half_from_float(1));
  const std::vector<BcsdfTable> reflecting = without_transmission(pack.materials);
  const auto world = make_world(pack, lights);
  pack.materials = reflecting;
  const auto only_r = make_world(pack, lights);
  const Camera camera = camera_above(1, 12, 12);
  for (const RenderMethod method :
       {RenderMethod::kExact, RenderMethod::kPrinted, RenderMethod::kPrt}) {
    SCOPED_TRACE(render_method_name(method));
    PrecomputedSettings settings;
    settings.method = method;
    const FrameBuffers expected =
        shade_picture(only_r->renderer(settings), camera, {0, 0, 12, 12}, 2, test::no_progress);
    settings.reflecting = {reflecting};
    const FrameBuffers frame =
        shade_picture(world->renderer(settings), camera, {0, 0, 12, 12}, 2, test::no_progress);
    ASSERT_EQ(frame.transmitted.size(), frame.pixel_count());
    double transmitted = 0;
    for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
      const Rgb left = frame.single[k] - frame.transmitted[k];
      EXPECT_LE((left - expected.single[k]).abs().maxCoeff(), 1e-5F * frame.single[k].maxCoeff());
      transmitted += static_cast<double>(frame.transmitted[k].sum());
    }
    EXPECT_GT(transmitted, 0.1);
  }
}

TEST(PrecomputedRenderer, ALowerOrderIsThatOfDataCutToIt) {
  FabricPack pack = open_pack(test_cotton());
  Transfer& transfer = *pack.transfer;
  transfer.order = 2;
  RandomStream random(1, RandomStage::kTest, 0, 0);
  transfer.matrices.resize(std::size_t{9} * 9 * 3);
  for (float& value : transfer.matrices) value = random.uniform();
  transfer.standard_error.assign(std::size_t{3} * 3, 0);
  const std::vector<Light> lights = {directional({0.3F, 0.2F, 1}, 1)};
  const auto shown = [](const PackWorld& world, std::optional<int> order) {
    PrecomputedSettings settings;
    settings.transfer_order = order;
    return shade_picture(world.renderer(settings), camera_above(1, 8, 8), {0, 0, 8, 8}, 2,
                         test::no_progress)
        .multiple;
  };
  const auto whole = make_world(pack, lights);
  pack.transfer = cut_to_order(*pack.transfer, 1);
  const auto cut = make_world(pack, lights);
  const std::vector<Rgb> expected = shown(*cut, {});
  const std::vector<Rgb> by_setting = shown(*whole, 1);
  const std::vector<Rgb> uncut = shown(*whole, {});
  double difference = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_TRUE((by_setting[k] == expected[k]).all()) << k;
    difference += static_cast<double>((uncut[k] - expected[k]).abs().maxCoeff());
  }
  EXPECT_GT(difference, 0.1);
}

TEST(PrecomputedRendererAgreement, VolumeSeesWhatFibersShow) {
  const auto world = make_world(open_pack(test_cotton()), {directional({0.3F, 0.2F, 1}, 1)});
  PrecomputedSettings settings;
  settings.method = RenderMethod::kVolume;
  const Camera camera = camera_above(0.5, 144, 144);
  const FrameBuffers fibers =
      shade_picture(world->renderer(), camera, {0, 0, 144, 144}, 1, test::no_progress);
  const FrameBuffers volume =
      shade_picture(world->renderer(settings), camera, {0, 0, 144, 144}, 1, test::no_progress);
  int both = 0;
  int same_fiber = 0;
  int near = 0;
  for (std::size_t k = 0; k < fibers.pixel_count(); ++k) {
    if (fibers.segment[k] == 0xffffffffU || volume.segment[k] == 0xffffffffU) continue;
    ++both;
    if (world->pack.exemplar.segment_fiber[fibers.segment[k]] !=
        world->pack.exemplar.segment_fiber[volume.segment[k]])
      continue;
    ++same_fiber;
    // Two edges of a voxel (5 um); near the silhouette a ray may pass the last voxel centre and
    // meet the fiber's next copy.
    near += std::abs(fibers.depth[k] - volume.depth[k]) < 0.01;
  }
  EXPECT_GT(both, 144 * 144 / 2);
  EXPECT_GT(same_fiber, 0.85 * both);
  EXPECT_GT(near, 0.97 * same_fiber);
}

TEST(PrecomputedRendererLaw, AKeptGBufferIsRelit) {
  // By the second and the third pass of a renderer with other lights: what that renderer shows
  // itself. Where only brightness differs, the visibility serves too.
  const Light sun = directional({0.3F, 0.2F, 1}, 1);
  const Light lamp = gaussian({-0.5F, 0, 1}, 150, 2);
  const auto lit_by = [](std::vector<Light> lights) {
    return make_world(open_pack(test_cotton()), std::move(lights), {half_roof()});
  };
  const auto kept_world = lit_by({sun});
  const auto world = lit_by({lamp, sun});
  const auto dim_world =
      lit_by({gaussian({-0.5F, 0, 1}, 150, 0.25F), directional({0.3F, 0.2F, 1}, 3)});
  for (const RenderMethod method :
       {RenderMethod::kExact, RenderMethod::kVolume, RenderMethod::kDualScattering}) {
    PrecomputedSettings settings;
    settings.method = method;
    const Camera camera = camera_above(2, 20, 20);
    const PixelRect block{3, 5, 12, 9};
    const PrecomputedRenderer first = kept_world->renderer(settings);
    const PrecomputedRenderer second = world->renderer(settings);
    const PrecomputedRenderer third = dim_world->renderer(settings);
    const GBuffer kept = first.g_buffer(camera, block, 2, 7);
    const LightVisibility visibility = second.light_visibility(kept);
    const auto expect_same = [&](const PrecomputedRenderer& renderer,
                                 const LightVisibility& visible) {
      const std::vector<EyeSample> relit = renderer.shade(kept, visible);
      const GBuffer own = renderer.g_buffer(camera, block, 2, 7);
      const std::vector<EyeSample> expected = renderer.shade(own, renderer.light_visibility(own));
      ASSERT_EQ(relit.size(), expected.size());
      float brightest = 0;
      for (std::size_t k = 0; k < relit.size(); ++k) {
        ASSERT_TRUE((relit[k].single == expected[k].single).all());
        ASSERT_TRUE((relit[k].multiple == expected[k].multiple).all());
        ASSERT_TRUE((relit[k].background == expected[k].background).all());
        ASSERT_EQ(relit[k].alpha, expected[k].alpha);
        brightest = std::max(brightest, relit[k].multiple.maxCoeff());
      }
      EXPECT_GT(brightest, 0);
    };
    expect_same(second, visibility);
    expect_same(third, visibility);
  }
}

TEST(PrecomputedRendererEndToEnd, MoreSamplesMakeThePictureOfAll) {
  const auto world =
      make_world(open_pack(test_cotton()),
                 {directional({0.3F, 0.2F, 1}, 1), gaussian({-0.5F, 0, 1}, 150, 2)}, {half_roof()});
  const Camera camera = camera_above(2, 20, 20);
  const FrameBuffers whole =
      shade_picture(world->renderer(), camera, {0, 0, 20, 20}, 13, test::no_progress);
  std::vector<int> seen;
  const FrameBuffers grown = shade_picture(world->renderer(), camera, {0, 0, 20, 20}, 3,
                                           test::no_progress, [&](const FrameBuffers& frame) {
                                             seen.push_back(frame.spp);
                                             return std::vector{13 - frame.spp};
                                           });
  EXPECT_EQ(seen, (std::vector<int>{3, 13}));
  EXPECT_EQ(grown.spp, 13);
  for (std::size_t k = 0; k < whole.pixel_count(); ++k) {
    ASSERT_TRUE((grown.beauty[k] == whole.beauty[k]).all() &&
                (grown.half0[k] == whole.half0[k]).all());
    ASSERT_TRUE((grown.variance[k] == whole.variance[k]).all());
    ASSERT_EQ(grown.segment[k], whole.segment[k]);
    ASSERT_EQ(grown.depth[k], whole.depth[k]);
  }
}

TEST(PrecomputedRendererEndToEnd, SameBytesForAnyThreadsAndCrop) {
  const auto world =
      make_world(open_pack(test_cotton()),
                 {directional({0.3F, 0.2F, 1}, 1), gaussian({-0.5F, 0, 1}, 150, 2)}, {half_roof()});
  const Camera camera = camera_above(2, 50, 40);
  const auto render = [&](std::size_t threads, const PixelRect& crop) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return shade_picture(world->renderer(), camera, crop, 3, test::no_progress);
  };
  const FrameBuffers one = render(1, {0, 0, 50, 40});
  const FrameBuffers two = render(2, {0, 0, 50, 40});
  const FrameBuffers crop = render(2, {13, 7, 30, 21});
  for (std::size_t k = 0; k < one.pixel_count(); ++k) {
    ASSERT_TRUE((one.beauty[k] == two.beauty[k]).all() &&
                (one.multiple[k] == two.multiple[k]).all());
    ASSERT_EQ(one.segment[k], two.segment[k]);
  }
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 30; ++x) {
      const std::size_t whole = static_cast<std::size_t>((y + 7) * 50 + x + 13);
      const std::size_t part = static_cast<std::size_t>(y * 30 + x);
      ASSERT_TRUE((one.beauty[whole] == crop.beauty[part]).all());
      ASSERT_TRUE((one.variance[whole] == crop.variance[part]).all());
    }
  }
}

/// Transfer of random numbers of order 3, with or without cones.
FabricPack random_pack(bool both_sides, bool cones) {
  FabricPack pack = open_pack(test_cotton(), both_sides);
  Transfer& transfer = *pack.transfer;
  transfer.order = 3;
  RandomStream random(1, RandomStage::kTest, 0, 0);
  transfer.matrices.resize(std::size_t{16} * 16 * 3);
  for (float& value : transfer.matrices) value = random.uniform();
  transfer.standard_error.assign(std::size_t{4} * 3, 0);
  if (!cones) return pack;
  transfer.cones.emplace();
  transfer.cones->harmonics = transfer.matrices;
  for (float& value : transfer.cones->harmonics) value *= 0.5F;
  transfer.cones->moments.resize(std::size_t{ConeTransfer::kWidths} * 16 * ConeTransfer::kAzimuths *
                                 3);
  for (float& value : transfer.cones->moments) value = random.uniform();
  for (std::uint32_t k = 0; k < pack.exemplar.segment_count(); ++k)
    pack.bundle_tangent.push_back(pack.exemplar.segment_tangent(k));
  return pack;
}

double largest_difference(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  double difference = 0;
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    difference = std::max(difference, static_cast<double>((a[k] - b[k]).abs().maxCoeff()));
    largest = std::max(largest, static_cast<double>(b[k].abs().maxCoeff()));
  }
  return difference / largest;
}

// Near lights are summed before the transfer, lights at infinity after it.
TEST(PrecomputedRendererAgreement, FarAwayNearLightsAreThoseAtInfinity) {
  const Vec3d axis = Vec3d(-0.4, 0.3, 1).normalized();
  const Vec3d other = Vec3d(0.6, 0.1, 1).normalized();
  const Rgb irradiance(2, 3, 4);
  const auto shown = [](const PackWorld& world) {
    return shade_picture(world.renderer(), camera_above(1, 16, 16), {0, 0, 16, 16}, 2,
                         test::no_progress);
  };
  for (const bool both_sides : {false, true}) {
    for (const bool cones : {false, true}) {
      const FabricPack pack = random_pack(both_sides, cones);
      const FrameBuffers far = shown(
          *make_world(pack, {{LightType::kDirectional, axis.cast<float>(), 0, irradiance},
                             {LightType::kDirectional, other.cast<float>(), 0, Rgb(1, 0, 3)}}));
      const FrameBuffers near =
          shown(*make_world(pack, {test::point_light(1e5 * axis, 1e4 * irradiance),
                                   test::point_light(1e5 * other, 1e4 * Rgb(1, 0, 3))}));
      EXPECT_LT(largest_difference(near.single, far.single), 1e-3);
      EXPECT_LT(largest_difference(near.multiple, far.multiple), 1e-3) << both_sides << cones;
    }
  }
}

TEST(PrecomputedRendererAgreement, ASphereIsTheGaussianThatStandsForIt) {
  for (const bool cones : {false, true}) {
    const FabricPack pack = random_pack(false, cones);
    const Light sphere = test::sphere_light({-200, 150, 500}, 100, Rgb(3, 2, 1));
    const SeenLight seen = seen_from(sphere, {0, 0, 0});
    const auto shown = [&](const Light& light) {
      return shade_picture(make_world(pack, {light})->renderer(), camera_above(1, 16, 16),
                           {0, 0, 16, 16}, 2, test::no_progress);
    };
    const FrameBuffers near = shown(sphere);
    const FrameBuffers far =
        shown({LightType::kSphericalGaussian, seen.axis, seen.sharpness, seen.irradiance});
    // 3 mm of 500 change the light by that.
    EXPECT_LT(largest_difference(near.single, far.single), 0.01);
    EXPECT_LT(largest_difference(near.multiple, far.multiple), 0.01);
  }
}

TEST(PrecomputedRendererLaw, ShadowRaysEndAtANearLight) {
  // The eye is under half a roof at z = 1, x > 0, and looks at the cloth there.
  const auto brightness = [](const Light& light, bool roofed) {
    const auto world =
        make_world(open_pack(test_cotton()), {light},
                   roofed ? std::vector<TriangleMesh>{half_roof()} : std::vector<TriangleMesh>{});
    CameraConfig config;
    config.position = Vec3d(1, -0.2, 0.8);
    config.look_at = Vec3d(1, 0, 0);
    config.fov = 0.5;
    config.width = config.height = 16;
    const FrameBuffers frame =
        shade_picture(world->renderer(), Camera(config), {0, 0, 16, 16}, 2, test::no_progress);
    Rgb sum = Rgb::Zero();
    for (std::size_t k = 0; k < frame.pixel_count(); ++k)
      sum += frame.single[k] + frame.multiple[k];
    return sum[0];
  };
  for (int which = 0; which < 3; ++which) {
    for (const double z : {0.7, 1.5}) {
      const Light light = which == 0   ? test::point_light({1.2, 0, z}, Rgb(1, 1, 1))
                          : which == 1 ? test::sphere_light({1.2, 0, z}, 0.2, Rgb(1, 1, 1))
                                       : test::rectangle_light({1.2, 0, z}, {0, 0, -1}, {0, 1, 0},
                                                               0.5, 0.5, Rgb(1, 1, 1));
      const float open = brightness(light, false);
      EXPECT_GT(open, 0);
      EXPECT_EQ(brightness(light, true), z > 1 ? 0 : open) << which << ' ' << z;
    }
  }
}

TEST(PrecomputedRendererEndToEnd, SameBytesForAnyThreadsUnderNearLights) {
  const auto world = make_world(
      random_pack(false, true),
      {test::point_light({1, 1, 3}, Rgb(1, 1, 1)), test::sphere_light({-1, 1, 3}, 1, Rgb(1, 1, 1)),
       test::rectangle_light({0, -1, 4}, {0, 0, -1}, {0, 1, 0}, 3, 1, Rgb(1, 1, 1))},
      {half_roof()});
  const auto render = [&](std::size_t threads, RenderMethod method) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    PrecomputedSettings settings;
    settings.method = method;
    return shade_picture(world->renderer(settings), camera_above(2, 40, 32), {0, 0, 40, 32}, 2,
                         test::no_progress);
  };
  for (const RenderMethod method :
       {RenderMethod::kExact, RenderMethod::kPrinted, RenderMethod::kDualScattering}) {
    const FrameBuffers one = render(1, method);
    const FrameBuffers two = render(2, method);
    double light = 0;
    for (std::size_t k = 0; k < one.pixel_count(); ++k) {
      ASSERT_TRUE((one.beauty[k] == two.beauty[k]).all());
      light += static_cast<double>(one.single[k].sum());
    }
    EXPECT_GT(light, 0);
  }
}

TEST(PrecomputedRenderer, RectanglesAreSplitByTheNearestCloth) {
  Light light = test::rectangle_light({0, 0, 20}, {0, 0, -1}, {0, 1, 0}, 40, 10, Rgb(1, 1, 1));
  const auto count = [&](const Light& own) {
    return make_world(open_pack(test_cotton()), {own})->renderer().fitted_lights().lights.size();
  };
  EXPECT_EQ(count(light), 4U);  // 40 mm wide at 20 mm: parts of 10 mm
  light.gaussians = 2;
  EXPECT_EQ(count(light), 2U);
  light.gaussians = 16;
  light.position_mm.z() = 400;
  EXPECT_EQ(count(light), 1U);
}

TEST(PrecomputedRenderer, SaysWhatThePackLacks) {
  const auto fails = [](FabricPack pack, const Light& light, bool volume) {
    const auto world = make_world(std::move(pack), {light});
    PrecomputedSettings settings;
    if (volume) settings.method = RenderMethod::kVolume;
    EXPECT_THROW(world->renderer(settings), FileError);
  };
  const Light sharp = directional({0, 0, 1}, 1);
  const Light soft = gaussian({0, 0, 1}, 8, 1);
  FabricPack pack = open_pack(test_cotton());
  pack.ssdf.reset();
  make_world(pack, {soft})->renderer();
  fails(pack, sharp, false);
  pack = open_pack(test_cotton());
  pack.sgs.reset();
  make_world(pack, {sharp})->renderer();
  fails(pack, soft, false);
  pack = open_pack(test_cotton());
  pack.volume.reset();
  fails(pack, sharp, true);
  pack.transfer.reset();
  fails(pack, sharp, false);
}

/// Blocks of one and the other pack, like a chessboard, 0.6 mm each.
std::unique_ptr<ClothScene> chessboard(const FabricPack& a, const FabricPack& b,
                                       const std::optional<YarnTintConfig>& tint = {}) {
  BlockLayout layout;
  layout.width_mm = static_cast<double>(a.exemplar.width_mm);
  layout.height_mm = static_cast<double>(a.exemplar.height_mm);
  layout.tile_blocks = {{1, 1}, {1, 1}};
  layout.columns = layout.rows = 2;
  layout.pattern.clear();
  for (const std::uint32_t exemplar : {0U, 1U, 1U, 0U})
    layout.pattern.push_back({exemplar, BlockLayout::kByOrder, BlockLayout::kByOrder});
  std::vector<ClothTiling::Tile> tiles = {std::make_shared<const TileScene>(a.exemplar),
                                          std::make_shared<const TileScene>(b.exemplar)};
  std::vector<ClothPiece> pieces;
  pieces.push_back({ClothTiling(std::move(tiles), layout), flat_cloth(6, 4), false, tint});
  return std::make_unique<ClothScene>(std::move(pieces), std::vector<TriangleMesh>{});
}

TEST(PrecomputedRenderer, EveryBlockIsShadedFromItsOwnPack) {
  // A white fabric among black ones: its blocks show what it shows alone, the rest is black.
  FabricPack white = open_pack(test::white_fiber(), true);
  FabricPack black = white;
  for (float& value : black.transfer->matrices) value = 0;
  const auto scene = chessboard(white, black);
  EXPECT_EQ(scene->part_count(), 2U);
  const std::vector<const FabricPack*> packs = {&white, &black};
  const std::vector<Light> lights = {gaussian({0, 0, 1}, 0, 4 * kPif)};
  const PrecomputedRenderer renderer(*scene, packs, lights, Rgb(0, 0, 0), {});
  const Camera camera = camera_above(2, 48, 32);
  const FrameBuffers frame =
      shade_picture(renderer, camera, camera.full_frame(), 1, test::no_progress);
  int of_white = 0;
  int of_black = 0;
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    if (frame.alpha[k] < 1) continue;
    const BlockPlace place = scene->tiling(0).place_of(frame.fabric_position[k].cast<double>());
    const bool is_white = (place.column + place.row) % 2 == 0;
    (is_white ? of_white : of_black) += 1;
    EXPECT_NEAR(frame.beauty[k].maxCoeff(), is_white ? 1 : 0, 1e-3) << k;
  }
  EXPECT_GT(of_white, 50);
  EXPECT_GT(of_black, 50);
}

TEST(PrecomputedRenderer, TintsMultiplyWhatIsSeen) {
  // The identity as transfer holds no yarn's light back: what is seen is a power of the tint.
  FabricPack pack = open_pack(test_cotton(), true);
  const std::vector<const FabricPack*> packs = {&pack, &pack};
  const std::vector<Light> lights = {gaussian({0, 0, 1}, 0, 4 * kPif)};
  const auto plain_scene = chessboard(pack, pack);
  const auto scene = chessboard(pack, pack, YarnTintConfig{.rms = 0.2});
  const Camera camera = camera_above(2, 48, 32);
  const FrameBuffers plain =
      shade_picture(PrecomputedRenderer(*plain_scene, packs, lights, Rgb(0, 0, 0), {}), camera,
                    camera.full_frame(), 1, test::no_progress);
  const FrameBuffers tinted =
      shade_picture(PrecomputedRenderer(*scene, packs, lights, Rgb(0, 0, 0), {}), camera,
                    camera.full_frame(), 1, test::no_progress);
  const Rgb exponent = own_yarn_scatterings(scene->tile(0), pack.materials);
  int changed = 0;
  for (std::size_t k = 0; k < plain.pixel_count(); ++k) {
    EXPECT_EQ(plain.alpha[k], tinted.alpha[k]);
    if (plain.alpha[k] < 1) continue;
    ShellHit hit;
    hit.segment = plain.segment[k];
    hit.fabric = plain.fabric_position[k].cast<double>();
    const BlockPlace place = scene->tiling(0).place_of(hit.fabric);
    hit.part = (place.column + place.row) % 2 == 0 ? 0 : 1;
    const Rgb tint = scene->tint(hit);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(tinted.multiple[k][c], plain.multiple[k][c] * std::pow(tint[c], exponent[c]),
                  1e-5);
    }
    changed += std::abs(tint[2] - 1) > 0.02F ? 1 : 0;
  }
  EXPECT_GT(changed, 50);
}

}  // namespace
}  // namespace heddle
