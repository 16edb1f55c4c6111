// Every warning appears past its limit and not before it, says where and what to do, and reaches
// the console, the picture's report and `heddle check`.

#include "pipeline/warnings.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>

#include "fibers/cloth/synthesize.h"
#include "fibers/tracing/segment_origins.h"
#include "precompute/segment_cells.h"
#include "tests/pipeline/program.h"
#include "tests/stability/folded_mesh.h"
#include "tests/stability/small_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace heddle::stability {
namespace {

using Subjects = std::vector<std::string>;

Subjects subjects_of(std::span<const Warning> warnings) {
  Subjects subjects;
  for (const Warning& warning : warnings) {
    subjects.push_back(warning.subject);
    EXPECT_GT(warning.expected_error, 0) << warning.subject;
    EXPECT_FALSE(warning.what.empty() || warning.instead.empty()) << warning.subject;
  }
  return subjects;
}

bool contains(const Subjects& subjects, const char* subject) {
  return std::find(subjects.begin(), subjects.end(), subject) != subjects.end();
}

/// A pack without data but a number of cells.
FabricPack pack_of(Exemplar exemplar, std::uint32_t cells) {
  FabricPack pack;
  pack.name = "cloth";
  pack.exemplar = std::move(exemplar);
  pack.transfer.emplace();
  pack.transfer->paths.resize(cells);
  return pack;
}

Exemplar exemplar_of(const SmallFabric& fabric) {
  const TomlTable document = TomlTable::parse(fabric.toml(), "fabric.toml");
  return synthesize(read_fabric_config(document));
}

TEST(PackWarningsStability, CellsBeyondSixMeanFreePaths) {
  SmallFabric dense;
  dense.radius_um = 6;
  dense.fibers = 72;
  const Exemplar exemplar = exemplar_of(dense);
  const TileScene tile(exemplar);
  bool last = false;
  int changes = 0;
  for (const std::uint32_t cells : {400U, 200U, 100U, 50U, 20U, 10U, 4U}) {
    const FabricPack pack = pack_of(exemplar, cells);
    const bool warns = contains(subjects_of(pack_warnings(pack, tile)), "cells");
    EXPECT_EQ(warns, pack_facts(pack, tile).cell_mean_free_paths > kCellMeanFreePaths) << cells;
    changes += warns != last;
    last = warns;
  }
  EXPECT_EQ(changes, 1) << "none with small cells, one with large ones";
}

TEST(PackWarningsStability, CellsAreMeasuredAsTheConfigStatesThem) {
  SmallPipeline pipeline;
  const FabricPack pack = pipeline.pack();
  EXPECT_NEAR(pack_facts(pack, TileScene(pack.exemplar)).cell_mean_free_paths,
              SmallFabric{}.cell_mean_free_paths, 0.3);
}

TEST(PackWarningsStability, SpecularParallelFilaments) {
  SmallFabric silk;
  silk.weave = "notation = \"satin 5/2\"\nface = \"warp\"";
  silk.radius_um = 5;
  silk.spacing_mm = 0.1;
  silk.width_mm = 0.06;  // room to pass without steep flanks
  silk.height_mm = 0.07;
  silk.fibers = 32;
  silk.twist_per_m = 0;
  silk.wander_deg = 0;
  silk.beta_r_deg = 1;
  silk.color_r = "[0.7, 0.01, 0.07]";
  const auto warned = [](const SmallFabric& fabric) {
    const FabricPack pack = pack_of(exemplar_of(fabric), 1000);
    return subjects_of(pack_warnings(pack, TileScene(pack.exemplar)));
  };
  EXPECT_EQ(warned(silk), Subjects{"truncation"});
  SmallFabric wandering = silk;
  wandering.wander_deg = 25;
  EXPECT_EQ(warned(wandering), Subjects{});
  SmallFabric rough = silk;
  rough.beta_r_deg = 15;
  rough.beta_tt_deg = 15;
  EXPECT_EQ(warned(rough), Subjects{});
}

TEST(PackWarningsStability, FewFibersAreNoReasonToWarn) {
  SmallFabric one;
  one.fibers = 1;
  one.twist_per_m = one.wander_deg = 0;
  const FabricPack pack = pack_of(exemplar_of(one), 4);
  pack_warnings(pack, TileScene(pack.exemplar));
  FabricPack bare = pack_of(exemplar_of(one), 1);
  bare.transfer.reset();
  EXPECT_EQ(subjects_of(pack_warnings(bare, TileScene(bare.exemplar))), Subjects{});
}

/// A fabric that is baked in a second; what it looks like does not matter here.
SmallFabric plain(const std::string& light_from = "face") {
  SmallFabric fabric;
  fabric.fibers = 8;
  fabric.wander_deg = 9;  // far from parallel
  fabric.radius_um = 16;
  fabric.segment_um = 100;
  fabric.order = 2;
  fabric.cell_mean_free_paths = 4;
  fabric.paths = 1024;
  fabric.light_from = light_from;
  return fabric;
}

class Pictures {
 public:
  explicit Pictures(const std::string& light_from = "face") : pipeline_(plain(light_from)) {}
  SmallPipeline& pipeline() { return pipeline_; }
  Subjects warned(const SmallScene& scene, RenderMethod method = RenderMethod::kExact, int spp = 2,
                  const SceneVariant& variant = {}) {
    SmallScene small = scene;
    small.pixels = 16;
    const PictureResult result = pipeline_.picture(small, method, spp, true, variant);
    for (const Warning& warning : result.warnings) {
      EXPECT_NE(pipeline_.messages().find(warning_text(warning)), std::string::npos)
          << "said as well as reported";
    }
    Subjects subjects = subjects_of(result.warnings);
    // of the few harmonics of this fabric; it has a test of its own
    std::erase(subjects, "ringing");
    return subjects;
  }

 private:
  SmallPipeline pipeline_;
};

Vec3d inclined(double degrees) {
  return {std::sin(radians(degrees)), 0, std::cos(radians(degrees))};
}

TEST(PictureWarningsStability, ViewsAndLights) {
  Pictures pictures;
  SmallScene scene;
  EXPECT_EQ(pictures.warned(scene), Subjects{});

  scene.light = directional(inclined(85));
  EXPECT_EQ(pictures.warned(scene), Subjects{}) << "low, but in front";
  scene.light = directional(inclined(95));
  EXPECT_EQ(pictures.warned(scene), Subjects{"behind"});
  EXPECT_EQ(pictures.warned(scene, RenderMethod::kPath), Subjects{})
      << "paths know light from behind";
  scene.cloth = "flat_mm = [40, 40]\nunderlay = true\n";
  EXPECT_EQ(pictures.warned(scene), Subjects{}) << "nothing shines through an underlay";
  scene = {};

  const double radius_mm = plain().radius_um * 1e-3;
  scene.wide_mm = 1.2 * kPixelRadii * radius_mm * 16;
  EXPECT_EQ(pictures.warned(scene), Subjects{});
  scene.wide_mm = 0.8 * kPixelRadii * radius_mm * 16;
  EXPECT_EQ(pictures.warned(scene), Subjects{"zoom"});
  scene = {};

  scene.flat_mm = 400;
  scene.eye = 50 * inclined(kGrazingDegrees - 2);
  EXPECT_EQ(pictures.warned(scene), Subjects{});
  scene.eye = 50 * inclined(kGrazingDegrees + 2);
  EXPECT_EQ(pictures.warned(scene), Subjects{"grazing"});
  scene = {};

  scene.flat_mm = 2;  // the rim at 1 mm, the cloth 0.2 mm thick
  EXPECT_EQ(pictures.warned(scene), Subjects{});
  scene.look_at.x() = 0.95;
  scene.wide_mm = 0.4;
  EXPECT_EQ(pictures.warned(scene), Subjects{"rim"});
  scene = {};

  const double tile = 2 * plain().spacing_mm;
  scene.flat_mm = 100;
  scene.wide_mm = 0.8 * tile * 16;
  EXPECT_EQ(pictures.warned(scene), Subjects{}) << "noisy, but a pixel is within a repeat";
  scene.wide_mm = 1.3 * tile * 16;
  EXPECT_EQ(pictures.warned(scene), Subjects{"distance"});
  EXPECT_EQ(pictures.warned(scene, RenderMethod::kExact, 4096), Subjects{}) << "enough samples";
}

TEST(PictureWarningsStability, LightsCloseToTheCloth) {
  Pictures pictures;
  const double tile = 2 * plain().spacing_mm;
  SmallScene scene;
  scene.brightness = "radiance = [1, 1, 1]\n";
  for (const double tiles : {kNearTiles - 1, kNearTiles + 1}) {
    // The picture is two tiles wide, and the sphere's surface that far above its middle.
    scene.light = fmt::format("type = \"sphere\"\nposition_mm = [0, 0, {}]\nradius_mm = 0.5\n",
                              tiles * tile + 0.5);
    EXPECT_EQ(pictures.warned(scene), tiles < kNearTiles ? Subjects{"near-light"} : Subjects{});
    EXPECT_EQ(pictures.warned(scene, RenderMethod::kPath), Subjects{});
  }
}

TEST(PictureWarningsStability, SharpnessOfLights) {
  Pictures face;
  SmallScene scene;
  scene.cloth = "flat_mm = [40, 40]\nunderlay = true\n";
  const auto warned = [&](Pictures& pictures, double sharpness, RenderMethod method,
                          const VisibilityBlend& blend) {
    scene.light = gaussian({0.3, 0.2, 1}, sharpness);
    return pictures.warned(scene, method, 2, {.blend = blend});
  };
  for (const double sharpness : {2.0, 4.0, 15.0, 99.0, 150.0, 300.0, 1e5}) {
    const bool sharp = sharpness > kLobesSharpness;
    const bool soft = sharpness < kDistanceSharpness;
    EXPECT_EQ(warned(face, sharpness, RenderMethod::kExact, {}), Subjects{}) << sharpness;
    EXPECT_EQ(warned(face, sharpness, RenderMethod::kExact, kLobesOnly),
              sharp ? Subjects{"sum-of-gaussians"} : Subjects{});
    EXPECT_EQ(warned(face, sharpness, RenderMethod::kExact, kSignedDistanceOnly),
              soft ? Subjects{"signed-distance"} : Subjects{});
    const bool gamma = sharpness < kPrintedGammaSharpness;
    EXPECT_EQ(warned(face, sharpness, RenderMethod::kPrinted, {}),
              gamma ? Subjects{"gamma"} : Subjects{})
        << sharpness;
  }
  Pictures both("both");
  EXPECT_EQ(warned(both, 10, RenderMethod::kExact, {}), Subjects{});
  EXPECT_EQ(warned(both, 60, RenderMethod::kExact, {}), Subjects{});
  EXPECT_EQ(warned(both, 60, RenderMethod::kExact, kLobesOnly), Subjects{"sum-of-gaussians"});
  EXPECT_EQ(warned(both, 300, RenderMethod::kExact, {}), Subjects{})
      << "the signed distance serves it";
  scene.light = directional(inclined(120));
  EXPECT_EQ(both.warned(scene), Subjects{});
  scene.light = directional(inclined(90 - kPlaneDegrees + 2));
  EXPECT_EQ(both.warned(scene), Subjects{"behind"});
}

TEST(PictureWarningsStability, TightFolds) {
  Pictures pictures;
  SmallScene scene;
  scene.eye = {3, 0.5, 20};
  scene.look_at = {3, 2, 0};
  scene.wide_mm = 3;
  scene.cloth = "mesh = \"fold.obj\"\nmesh_unit = \"mm\"\nuv_size_mm = 1\n";
  const double half = 0.5 * 0.2;  // of the cloth, mm
  for (const double ratio : {0.6, 1.6}) {
    FoldedMesh(half / ratio).write(pictures.pipeline().folder() / "fold.obj");
    EXPECT_EQ(contains(pictures.warned(scene), "shell"), ratio > 1) << ratio;
  }
}

TEST(PictureWarningsStability, NegativeLight) {
  Pictures pictures;
  SmallScene scene;
  CameraConfig config;
  config.position = scene.eye;
  const Camera camera(config);
  SceneJob job = pictures.pipeline().job(scene);
  const ClothScene cloth(std::vector<ClothPiece>{}, {});
  const PictureSetup setup{
      &cloth, {}, job.config().lights, &camera, {0, 0, 1, 1}, RenderMethod::kExact, {}};
  for (const float negative : {0.005F, 0.02F}) {
    FrameBuffers frame(2, 1);
    frame.multiple[0] = Rgb::Constant(1 - negative);
    frame.multiple[1] = Rgb::Constant(-negative);
    EXPECT_EQ(subjects_of(frame_warnings(setup, frame)),
              negative > kNegativeShare ? Subjects{"ringing"} : Subjects{});
  }
}

TEST(PictureWarningsStability, WideLightsOnInteractiveSurfaces) {
  const ClothScene cloth(std::vector<ClothPiece>{}, {});
  const Camera camera(CameraConfig{});
  for (const float sharpness : {0.0F, 3.0F, 19.0F, 21.0F, 150.0F}) {
    Light light;
    light.type = LightType::kSphericalGaussian;
    light.axis = Vec3(0, 0, 1);
    light.sharpness = sharpness;
    const std::vector<Light> lights = {light};
    PictureSetup setup{&cloth, {}, lights, &camera, {0, 0, 1, 1}, RenderMethod::kExact, {}};
    EXPECT_EQ(subjects_of(picture_warnings(setup)), Subjects{}) << sharpness;
    setup.interactive_surfaces = true;
    EXPECT_EQ(subjects_of(picture_warnings(setup)),
              sharpness < kInteractiveSharpness ? Subjects{"wide-light"} : Subjects{})
        << sharpness;
  }
}

TEST(PictureWarningsStability, NoneOnTheCottonBall) {
  namespace fs = std::filesystem;
  const fs::path file = fs::path(HEDDLE_SOURCE_DIR) / "configs" / "scenes" / "cotton-ball.toml";
  const SceneConfig config = read_scene_config(TomlTable::load(file));
  const FabricDocument document = read_fabric_document(config.cloths.at(0).fabric, {});
  const auto tile = std::make_shared<const TileScene>(synthesize(document.config));
  const SegmentOrigins origins = find_segment_origins(*tile, false, OriginChoice::kExposed, 1);
  const double edge =
      document.transfer.cell_mean_free_paths * tile->mean_free_path(1, kMeanFreePathSamples);
  FabricPack pack =
      pack_of(tile->exemplar(),
              make_segment_cells(tile->exemplar(), origins, static_cast<float>(edge)).count);
  EXPECT_EQ(subjects_of(pack_warnings(pack, *tile)), Subjects{});
  const std::vector<ClothTiling> tilings = {tile};
  const ClothScene scene = make_cloth_scene(config, tilings);
  const std::vector<const FabricPack*> packs = {&pack};
  for (const ViewConfig& view : config.views) {
    const Camera camera(view.camera);
    const PictureSetup setup{&scene,        packs, config.lights, &camera, camera.full_frame(),
                             config.method, {}};
    EXPECT_EQ(subjects_of(picture_warnings(setup)), Subjects{}) << view.name;
  }
}

TEST(WarningsEndToEnd, CheckAndRunSaySoAndSucceed) {
  const TemporaryFolder folder;
  SmallFabric silk = plain();
  silk.weave = "notation = \"satin 5/2\"\nface = \"warp\"";
  silk.twist_per_m = silk.wander_deg = 0;
  silk.beta_r_deg = 1;
  silk.cell_mean_free_paths = 20;
  SmallScene scene;
  scene.light = directional(inclined(100));
  std::ofstream(folder.path() / "fabric.toml") << silk.toml();
  std::ofstream(folder.path() / "scene.toml") << scene.toml() << "[render]\nspp = 2\n";
  ::setenv("HEDDLE_CACHE", (folder.path() / "cache").c_str(), 1);
  const auto run = [&](std::vector<std::string> arguments) {
    return Program(folder.path(), std::move(arguments)).wait();
  };
  const std::string pack = folder.path() / "pack";
  ASSERT_EQ(run({"precompute", folder.path() / "fabric.toml", "-o", pack}).status, 0);
  const ProgramResult check = run({"check", pack, "--json"});
  EXPECT_EQ(check.status, 0);
  EXPECT_NE(check.error.find("warning: cells: "), std::string::npos) << check.error;
  const auto report = nlohmann::json::parse(check.out);
  EXPECT_TRUE(report.at("sound").get<bool>());
  EXPECT_EQ(report.at("warnings").at(0).at("subject"), "cells");
  for (const char* round : {"rendered", "from the cache"}) {
    const ProgramResult result =
        run({"run", folder.path() / "scene.toml", "-o", folder.path() / "out", "--quiet"});
    EXPECT_EQ(result.status, 0) << result.error;
    EXPECT_NE(result.error.find("warning: behind: the light reaches"), std::string::npos)
        << round << ": " << result.error;
    EXPECT_NE(result.error.find("warning: cells: "), std::string::npos)
        << round << ": " << result.error;
  }
}

}  // namespace
}  // namespace heddle::stability
