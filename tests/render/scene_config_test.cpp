#include "render/scene_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "formats/image_file.h"
#include "formats/input_error.h"
#include "render/radiance_picture.h"
#include "render/surface/surface_presets.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

// Paths in a scene are relative to its folder: one with the files that the scenes below name.
class SceneConfigTest : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "drape.obj") << "v 0 0 0\n";
    std::ofstream(folder_ / "silk.toml") << "name = \"silk\"\n";
  }
  SceneConfig read(const std::string& text) const {
    const std::filesystem::path path = folder_ / "scene.toml";
    std::ofstream(path) << text;
    return read_scene_config(TomlTable::load(path));
  }
  std::string message(const std::string& text) const {
    try {
      read(text);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

const std::string kScene = R"(name = "test"
background = [0.1, 0.2, 0.3]
[camera]
position_mm = [0, -400, 300]
look_at_mm = [0, 0, 10]
fov_deg = 30
fov_axis = "vertical"
resolution_px = [640, 480]
[[light]]
type = "directional"
direction = [0, 3, 4]
irradiance = [1, 2, 3]
[[light]]
type = "sg"
axis = [0, 0, 2]
sharpness = 0
irradiance = [4, 5, 6]
[[cloth]]
mesh = "drape.obj"
mesh_unit = "m"
uv_size_mm = 300
fabric = "silk.toml"
underlay = true
[[cloth]]
flat_mm = [30, 20]
fabric = "silk.toml"
[[mesh]]
mesh = "drape.obj"
mesh_unit = "cm"
[render]
method = "path"
spp = 64
seed = 7
shadow_sigma_mm = 0.5
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(SceneConfigTest, ReadsEveryKey) {
  const SceneConfig scene = read(kScene);
  EXPECT_EQ(scene.name, "test");
  ASSERT_EQ(scene.views.size(), 1U);
  EXPECT_EQ(scene.views[0].name, "");
  EXPECT_EQ(scene.views[0].camera.fov_axis, FovAxis::kVertical);
  EXPECT_NEAR(scene.views[0].camera.fov, radians(30), 1e-12);
  EXPECT_EQ(scene.views[0].camera.width, 640);
  EXPECT_EQ(scene.views[0].camera.up, Vec3d(0, 0, 1));
  ASSERT_EQ(scene.lights.size(), 2U);
  EXPECT_NEAR(scene.lights[0].axis.y(), 0.6, 1e-6);
  EXPECT_EQ(scene.lights[1].type, LightType::kSphericalGaussian);
  EXPECT_EQ(scene.lights[1].irradiance[2], 6);
  ASSERT_EQ(scene.cloths.size(), 2U);
  EXPECT_EQ(scene.cloths[0].mesh->mm_per_unit, 1000);
  EXPECT_TRUE(scene.cloths[0].underlay);
  EXPECT_FALSE(scene.cloths[1].mesh);
  EXPECT_EQ(scene.cloths[1].flat_height_mm, 20);
  EXPECT_FALSE(scene.cloths[1].underlay);
  ASSERT_EQ(scene.meshes.size(), 1U);
  EXPECT_EQ(scene.meshes[0].mm_per_unit, 10);
  EXPECT_EQ(scene.method, RenderMethod::kPath);
  EXPECT_EQ(scene.views[0].spp, 64);
  EXPECT_EQ(scene.seed, 7U);
  EXPECT_EQ(scene.shadow_sigma_mm, 0.5);
  EXPECT_NEAR(scene.background[1], 0.2, 1e-7);
}

TEST_F(SceneConfigTest, LayersFilterAndScreen) {
  const SceneConfig plain = read(kScene);
  EXPECT_EQ(plain.light_groups, std::vector<std::string>{""});
  EXPECT_TRUE(plain.filter.is_default());
  EXPECT_FALSE(plain.layers.any());
  EXPECT_EQ(plain.look, ScreenLook{});
  EXPECT_EQ(plain.cloths[0].name, "");

  const std::string more = with(
      with(with(kScene, "irradiance = [4, 5, 6]", "irradiance = [4, 5, 6]\ngroup = \"fill_2\""),
           "underlay = true", "underlay = true\nname = \"shirt-1\""),
      "mesh_unit = \"cm\"", "mesh_unit = \"cm\"\nname = \"ball\"");
  const SceneConfig scene =
      read(more +
           "filter = \"gaussian\"\nfilter_width_px = 1.5\nlayers = [\"lobes\", \"cryptomatte\"]\n"
           "[png]\nexposure_stops = -1.5\ntransform = \"filmic\"\n");
  EXPECT_EQ(scene.light_groups, (std::vector<std::string>{"rest", "fill_2"}));
  EXPECT_EQ(scene.lights[0].group, 0);
  EXPECT_EQ(scene.lights[1].group, 1);
  EXPECT_EQ(scene.filter.text(), "gaussian 1.5 px");
  EXPECT_TRUE(scene.layers.lobes && scene.layers.cryptomatte && !scene.layers.surface);
  EXPECT_EQ(scene.look.exposure_stops, -1.5);
  EXPECT_EQ(scene.look.transform, ScreenTransform::kFilmic);
  EXPECT_EQ(scene.cloths[0].name, "shirt-1");
  EXPECT_EQ(scene.meshes[0].name, "ball");
  EXPECT_EQ(read(kScene + "filter = \"blackman-harris\"\n").filter.text(), "blackman-harris 3 px");

  EXPECT_NE(message(kScene + "filter = \"mitchell\"\n").find("box"), std::string::npos);
  EXPECT_NE(message(kScene + "layers = [\"depth\"]\n").find("got depth"), std::string::npos);
  for (const char* group : {"", "2nd", "a b", "a-b"}) {
    EXPECT_NE(message(with(kScene, "irradiance = [4, 5, 6]",
                           "irradiance = [4, 5, 6]\ngroup = \"" + std::string(group) + "\""))
                  .find("a letter first"),
              std::string::npos)
        << group;
  }
  EXPECT_NE(message(with(kScene, "underlay = true", "underlay = true\nname = \"a/b\""))
                .find("becomes the name of a matte"),
            std::string::npos);
}

TEST_F(SceneConfigTest, Defaults) {
  const SceneConfig scene = read(kScene.substr(0, kScene.find("[render]")));
  EXPECT_EQ(scene.method, RenderMethod::kExact);
  EXPECT_FALSE(scene.shadow_sigma_mm);
}

const std::string kView = R"([[view]]
name = "close-up"
position_mm = [0, -40, 30]
look_at_mm = [0, 0, 10]
fov_deg = 20
fov_axis = "horizontal"
resolution_px = [320, 200]
spp = 8
[view.reference]
corner_px = [300, 0]
size_px = [20, 10]
spp = 256
local = true
)";

TEST_F(SceneConfigTest, ViewsAndReferences) {
  const SceneConfig scene = read(kScene + kView);
  ASSERT_EQ(scene.views.size(), 2U);
  EXPECT_FALSE(scene.views[0].reference);
  EXPECT_EQ(scene.views[1].name, "close-up");
  EXPECT_EQ(scene.views[1].camera.height, 200);
  EXPECT_EQ(scene.views[1].spp, 8);
  ASSERT_TRUE(scene.views[1].reference);
  EXPECT_EQ(scene.views[1].reference->crop.x0, 300);
  EXPECT_EQ(scene.views[1].reference->crop.height, 10);
  EXPECT_EQ(scene.views[1].reference->spp, 256);
  EXPECT_TRUE(scene.views[1].reference->local);
  EXPECT_EQ(read(kScene + with(kView, "spp = 8\n", "")).views[1].spp, 64) << "that of [render]";

  EXPECT_NE(message(kScene + with(kView, "close-up", "close/up")).find("file name"),
            std::string::npos);
  EXPECT_NE(message(kScene + with(kView, "close-up", "..")).find("file name"), std::string::npos);
  EXPECT_NE(message(kScene + kView + kView).find("no other view"), std::string::npos);
  EXPECT_NE(message(kScene + with(kView, "spp = 8", "spp = 7")).find("even"), std::string::npos);
  EXPECT_NE(message(kScene + with(kView, "[300, 0]", "[301, 0]")).find("inside"),
            std::string::npos);
  EXPECT_NE(message(kScene + with(kView, "spp = 256", "spp = 3")).find("even"), std::string::npos);
}

TEST_F(SceneConfigTest, MistakesAreLocated) {
  struct Case {
    const char* from;
    const char* to;
    const char* expected;
  };
  const Case cases[] = {
      {"fov_deg = 30", "fov_deg = 0", "scene.toml:6"},
      {"fov_axis = \"vertical\"\n", "", "fov_axis"},
      {"resolution_px = [640, 480]", "resolution_px = [640, 480.5]", "scene.toml:8"},
      {"look_at_mm = [0, 0, 10]", "look_at_mm = [0, -400, 300]", "scene.toml:5"},
      {"look_at_mm = [0, 0, 10]", "look_at_mm = [0, -400, 10]", "parallel"},
      {"direction = [0, 3, 4]", "direction = [0, 0, 0]", "scene.toml:11"},
      {"sharpness = 0", "sharpness = -1", "scene.toml:16"},
      {"type = \"sg\"", "type = \"cone\"", "scene.toml:14"},
      {"irradiance = [1, 2, 3]", "irradiance = [1, -2, 3]", "scene.toml:12"},
      {"mesh_unit = \"m\"\n", "", "mesh_unit"},
      {"mesh_unit = \"m\"", "mesh_unit = \"inch\"", "scene.toml:20"},
      {"flat_mm = [30, 20]", "flat_mm = [30, 20]\nuv_size_mm = 3", "uv_size_mm"},
      {"flat_mm = [30, 20]", "flat_mm = [30, 20]\nmesh = \"drape.obj\"", "either"},
      {"fabric = \"silk.toml\"", "fabric = \"wool.toml\"", "wool.toml"},
      {"fabric = \"silk.toml\"", "surface = \"silk\"", "scene.toml:22:"},
      {"fabric = \"silk.toml\"", "surface = \"silk\"", "silk-crepe-de-chine, silk-shot, velvet"},
      {"fabric = \"silk.toml\"", "surface = \"silk.toml\"", "model"},
      {"fabric = \"silk.toml\"", "surface = \"wool.toml\"", "wool.toml"},
      {"fabric = \"silk.toml\"", "surface = \"velvet\"", "underlay"},
      {"fabric = \"silk.toml\"", "surface = \"velvet\"\nsurface_method = \"fast\"",
       "one of \"sampled\", \"interactive\""},
      {"fabric = \"silk.toml\"", "surface = \"irawan-denim\"\nsurface_method = \"interactive\"",
       "irawan-denim has no interactive form"},
      {"fabric = \"silk.toml\"", "surface = \"irawan-denim\"\nsurface_method = \"interactive\"",
       "silk-crepe-de-chine, silk-shot, velvet"},
      {"fabric = \"silk.toml\"", "fabric = \"silk.toml\"\nsurface_method = \"interactive\"",
       "surface_method"},
      {"fabric = \"silk.toml\"", "fabric = \"silk.toml\"\nsurface = \"velvet\"",
       "one of fabric, surface and pattern"},
      {"fabric = \"silk.toml\"\n", "", "one of fabric, surface and pattern"},
      {"spp = 64", "spp = 63", "even"},
      {"name = \"test\"", "name = \"test\"\nnmae = 3", "nmae"},
  };
  for (const Case& c : cases) {
    const std::string text = message(with(kScene, c.from, c.to));
    EXPECT_NE(text.find(c.expected), std::string::npos) << c.to << "\n" << text;
  }
}

const std::string kNearLights = R"([[light]]
type = "point"
position_mm = [100, 200, 300]
irradiance_at_1_m = [1, 2, 3]
[[light]]
type = "sphere"
position_mm = [0, 0, 300]
radius_mm = 20
radiance = [4, 5, 6]
[[light]]
type = "rectangle"
position_mm = [300, 0, 0]
look_at_mm = [0, 0, 0]
size_mm = [200, 100]
radiance = [7, 8, 9]
texture = "light.exr"
gaussians = 9
)";

TEST_F(SceneConfigTest, ReadsNearLights) {
  Image image{2, 1, {}, {}};
  for (const char* name : {"R", "G", "B"}) image.channels[name].values = {1, 0.5F};
  write_exr(folder_ / "light.exr", image);
  const std::string text = kScene + kNearLights;
  const SceneConfig scene = read(text);
  ASSERT_EQ(scene.lights.size(), 5U);
  const Light& point = scene.lights[2];
  EXPECT_EQ(point.type, LightType::kPoint);
  EXPECT_EQ(point.position_mm, Vec3d(100, 200, 300));
  EXPECT_EQ(point.irradiance[1], 2);
  const Light& sphere = scene.lights[3];
  EXPECT_EQ(sphere.type, LightType::kSphere);
  EXPECT_EQ(sphere.radius_mm, 20);
  EXPECT_EQ(sphere.irradiance[2], 6);
  const Light& rectangle = scene.lights[4];
  EXPECT_EQ(rectangle.type, LightType::kRectangle);
  EXPECT_EQ(rectangle.axis, Vec3(-1, 0, 0));
  // Who looks at it from the origin, z up, has -y at the right.
  EXPECT_LT((rectangle.half_right_mm - Vec3d(0, -100, 0)).norm(), 1e-9);
  EXPECT_LT((rectangle.half_up_mm - Vec3d(0, 0, 50)).norm(), 1e-9);
  EXPECT_EQ(rectangle.texture->pixel(0, 1)[0], 0.5F);
  EXPECT_EQ(rectangle.gaussians, 9);
  ASSERT_EQ(scene.light_files.size(), 1U);

  struct Case {
    const char* from;
    const char* to;
    const char* expected;
  };
  // kScene has 34 lines.
  const Case cases[] = {
      {"radius_mm = 20", "radius_mm = 0", "scene.toml:42:"},
      {"radius_mm = 20", "radius_mm = -3", "radius_mm"},
      {"size_mm = [200, 100]", "size_mm = [200, 0]", "scene.toml:48:"},
      {"look_at_mm = [0, 0, 0]", "look_at_mm = [300, 0, 0]", "scene.toml:47:"},
      {"look_at_mm = [0, 0, 0]", "look_at_mm = [300, 0, -9]", "parallel"},
      {"look_at_mm = [0, 0, 0]", "look_at_mm = [0, 0, 0]\nup = [0, 0, 0]", "scene.toml:48:"},
      {"texture = \"light.exr\"", "texture = \"none.exr\"", "scene.toml:50:"},
      {"gaussians = 9", "gaussians = 0", "scene.toml:51:"},
      {"position_mm = [100, 200, 300]\n", "", "position_mm"},
      {"irradiance_at_1_m = [1, 2, 3]", "irradiance = [1, 2, 3]", "irradiance_at_1_m"},
      {"= 20\nradiance = [4, 5, 6]", "= 20\nradiance = [4, -5, 6]", "scene.toml:43:"},
      {"type = \"point\"", "type = \"point\"\nsharpness = 3", "sharpness"},
  };
  for (const Case& c : cases) {
    const std::string said = message(with(text, c.from, c.to));
    EXPECT_NE(said.find(c.expected), std::string::npos) << c.to << "\n" << said;
  }
}

TEST_F(SceneConfigTest, ASurfaceStandsInForAFabric) {
  const std::string flat = "[[cloth]]\nflat_mm = [30, 20]\nfabric = \"silk.toml\"\n";
  const auto cloth = [&](const std::string& lines) {
    return read(with(kScene, flat, "[[cloth]]\nflat_mm = [30, 20]\n" + lines)).cloths[1];
  };
  EXPECT_FALSE(cloth("fabric = \"silk.toml\"\n").surface);
  const ClothConfig velvet = cloth("surface = \"velvet\"\n");
  EXPECT_TRUE(velvet.fabric.empty());
  EXPECT_EQ(velvet.flat_height_mm, 20);
  ASSERT_TRUE(velvet.surface && velvet.surface->model);
  EXPECT_EQ(velvet.surface_method, SurfaceMethod::kSampled);
  EXPECT_EQ(cloth("surface = \"velvet\"\nsurface_method = \"interactive\"\n").surface_method,
            SurfaceMethod::kInteractive);
  EXPECT_EQ(velvet.surface->name, "velvet");
  const Vec3d wi = Vec3d(0.1, 0.5, 1).normalized();
  const Vec3d wo = Vec3d(0.2, -0.3, 1).normalized();
  const Rgbd expected = read_surface_model(surface_preset("velvet"))->reflected({}, wi, wo);
  EXPECT_TRUE((velvet.surface->model->reflected({}, wi, wo) == expected).all());

  // A file of the same content is the same surface; another content has another text.
  const std::string of_velvet = velvet.surface->text;
  std::string text;
  {
    std::ifstream preset(std::filesystem::path(HEDDLE_SOURCE_DIR) / "configs/fabrics/velvet.toml");
    text.assign(std::istreambuf_iterator<char>(preset), {});
  }
  std::ofstream(folder_ / "own.toml") << "# a comment\n" << text;
  EXPECT_EQ(cloth("surface = \"own.toml\"\n").surface->text, of_velvet);
  std::ofstream(folder_ / "own.toml") << with(text, "ior = 1.", "ior = 1.1");
  EXPECT_NE(cloth("surface = \"own.toml\"\n").surface->text, of_velvet);
  std::ofstream(folder_ / "own.toml")
      << with(text, "model = \"microcylinder\"", "model = \"felt\"");
  EXPECT_NE(message(with(kScene, flat, "[[cloth]]\nflat_mm = [30, 20]\nsurface = \"own.toml\"\n"))
                .find("own.toml:"),
            std::string::npos);
}

TEST_F(SceneConfigTest, MeshesAreSubdividedGroupedAndPlacedIfAsked) {
  const SceneConfig plain = read(kScene);
  EXPECT_FALSE(plain.cloths[0].mesh->is_smooth());
  EXPECT_TRUE(plain.cloths[0].mesh->placement.is_identity());
  EXPECT_TRUE(plain.cloths[0].on_uvs.is_identity());
  EXPECT_TRUE(plain.cloths[1].flat_placement.is_identity());
  EXPECT_EQ(plain.cloths[0].thickness, 1);
  EXPECT_FALSE(plain.meshes[0].is_smooth());
  EXPECT_FALSE(is_cut_for_pictures(plain));

  const std::string place = "scale = 2\nrotate_deg = [90, 0, -180]\ntranslate_mm = [1, 2, 3]\n";
  std::string text =
      with(kScene, "uv_size_mm = 300\n",
           "uv_size_mm = 300\ngroup = \"sleeve\"\nsubdivide = 2\nsubdivide_corners = "
           "\"round\"\nsubdivide_vertices = \"near\"\nuv_turn_deg = 90\nuv_offset_mm = [3, "
           "4]\nuv_tiling = [5, 6]\nthickness = "
           "1.5\n" +
               place);
  text = with(text, "flat_mm = [30, 20]\n", "flat_mm = [30, 20]\n" + place);
  text = with(text, "mesh_unit = \"cm\"\n", "mesh_unit = \"cm\"\nsubdivide_px = 4\n");
  const SceneConfig scene = read(text);
  const MeshFile& mesh = *scene.cloths[0].mesh;
  EXPECT_EQ(mesh.group, "sleeve");
  EXPECT_EQ(mesh.subdivide, 2);
  EXPECT_FALSE(mesh.sharp_corners);
  EXPECT_TRUE(mesh.near_vertices);
  EXPECT_EQ(scene.cloths[0].thickness, 1.5);
  EXPECT_NEAR(scene.cloths[0].on_uvs.turn, radians(90), 1e-12);
  EXPECT_EQ(scene.cloths[0].on_uvs.offset_mm, Eigen::Vector2d(3, 4));
  EXPECT_EQ(scene.cloths[0].on_uvs.tiling, Eigen::Vector2d(5, 6));
  for (const Placement& placement : {mesh.placement, scene.cloths[1].flat_placement}) {
    EXPECT_EQ(placement.scale, 2);
    EXPECT_LT((placement.rotate - Vec3d(radians(90), 0, radians(-180))).norm(), 1e-12);
    EXPECT_EQ(placement.translate_mm, Vec3d(1, 2, 3));
  }
  EXPECT_EQ(scene.meshes[0].subdivide_px, 4);
  EXPECT_TRUE(is_cut_for_pictures(scene));
  EXPECT_NE(message(with(text, "subdivide_px = 4", "subdivide_px = 4\nsubdivide = 1"))
                .find("only one of subdivide and subdivide_px"),
            std::string::npos);
  EXPECT_NE(message(with(text, "subdivide = 2", "subdivide = 9")).find("scene.toml:23:"),
            std::string::npos);
  EXPECT_NE(message(with(text, "thickness = 1.5", "thickness = 0")).find("thickness"),
            std::string::npos);
  EXPECT_NE(message(with(kScene, "flat_mm = [30, 20]\n", "flat_mm = [30, 20]\nuv_turn_deg = 3\n"))
                .find("uv_turn_deg"),
            std::string::npos);
}

TEST_F(SceneConfigTest, ASceneNeedsLightAndCloth) {
  EXPECT_NE(
      message("name = \"a\"\n" + kScene.substr(kScene.find("[camera]"),
                                               kScene.find("[[light]]") - kScene.find("[camera]")))
          .find("[[light]]"),
      std::string::npos);
}

/// kScene with another cloth than its own.
std::string scene_with_cloth(const std::string& cloth) {
  return kScene.substr(0, kScene.find("[[cloth]]")) + "[[cloth]]\nflat_mm = [10, 20]\n" + cloth;
}

const std::string kPattern =
    "[cloth.pattern]\npicture = \"two.png\"\ncorner_blocks = [1, -2]\n"
    "[[cloth.pattern.fabric]]\ncolor = \"#000000\"\nfile = \"silk.toml\"\n"
    "[[cloth.pattern.fabric]]\ncolor = \"#FF8000\"\nfile = \"wool.toml\"\n";

TEST_F(SceneConfigTest, APatternIsReadFromItsPicture) {
  std::ofstream(folder_ / "wool.toml") << "name = \"wool\"\n";
  // Upper row: black, orange, orange; lower row: orange, black, black.
  write_png(folder_ / "two.png", 3, 2,
            {0, 0, 0, 255, 128, 0, 255, 128, 0, 255, 128, 0, 0, 0, 0, 0, 0, 0});
  const ClothConfig cloth = read(scene_with_cloth(kPattern)).cloths.at(0);
  ASSERT_TRUE(cloth.pattern);
  EXPECT_EQ(cloth.pattern->columns, 3);
  EXPECT_EQ(cloth.pattern->rows, 2);
  EXPECT_EQ(cloth.pattern->blocks, (std::vector<std::uint16_t>{1, 0, 0, 0, 1, 1}));
  EXPECT_EQ(cloth.pattern->corner_blocks, (std::array<int, 2>{1, -2}));
  EXPECT_EQ(fabric_files(cloth),
            (std::vector<std::filesystem::path>{folder_ / "silk.toml", folder_ / "wool.toml"}));
  ASSERT_TRUE(cloth.blocks);
  EXPECT_EQ(cloth.blocks->order, BlockOrder::kAligned);

  write_png(folder_ / "two.png", 1, 2, {0, 0, 0, 255, 128, 1});
  EXPECT_NE(message(scene_with_cloth(kPattern)).find("column 0, row 1 from the top, is #ff8001"),
            std::string::npos)
      << message(scene_with_cloth(kPattern));
}

TEST_F(SceneConfigTest, APatternTakesTheFabricsPlace) {
  std::ofstream(folder_ / "wool.toml") << "name = \"wool\"\n";
  write_png(folder_ / "two.png", 1, 1, {0, 0, 0});
  EXPECT_NE(message(scene_with_cloth("fabric = \"silk.toml\"\n" + kPattern))
                .find("one of fabric, surface and pattern"),
            std::string::npos);
  EXPECT_NE(message(scene_with_cloth("")).find("one of fabric, surface and pattern"),
            std::string::npos);
  std::string same = kPattern;
  same.replace(same.find("#FF8000"), 7, "#000000");
  EXPECT_NE(message(scene_with_cloth(same)).find("that no other fabric of the pattern has"),
            std::string::npos);
  same.replace(same.rfind("#000000"), 7, "orange!");
  EXPECT_NE(message(scene_with_cloth(same)).find("#rrggbb"), std::string::npos);
}

TEST_F(SceneConfigTest, UnevennessIsOffUnlessAsked) {
  const ClothConfig plain = read(kScene).cloths.at(0);
  EXPECT_FALSE(plain.blocks || plain.pattern || plain.yarn_drift || plain.yarn_tint);
  const ClothConfig cloth =
      read(scene_with_cloth(
               "fabric = \"silk.toml\"\n"
               "blocks = { size_repeats = [2, 3], order = \"scattered\", seed = 5 }\n"
               "yarn_drift = { spacing_rms_percent = 4, across_mm = 1, along_mm = 9, seed = 6 }\n"
               "yarn_tint = { rms_percent = 5, correlation_yarns = 2, seed = 7 }\n"))
          .cloths.at(0);
  EXPECT_EQ(cloth.blocks->size_repeats, (std::array<int, 2>{2, 3}));
  EXPECT_EQ(cloth.blocks->order, BlockOrder::kScattered);
  EXPECT_EQ(cloth.blocks->seed, 5U);
  EXPECT_DOUBLE_EQ(cloth.yarn_drift->spacing_rms, 0.04);
  EXPECT_EQ(cloth.yarn_drift->across_mm, 1);
  EXPECT_EQ(cloth.yarn_drift->along_mm, 9);
  EXPECT_EQ(cloth.yarn_drift->seed, 6U);
  EXPECT_DOUBLE_EQ(cloth.yarn_tint->rms, 0.05);
  EXPECT_EQ(cloth.yarn_tint->correlation_yarns, 2);
  EXPECT_EQ(cloth.yarn_tint->seed, 7U);
  EXPECT_NE(message(scene_with_cloth("fabric = \"silk.toml\"\nyarn_drift = { "
                                     "spacing_rms_percent = 4, across_mm = 9, along_mm = 1 }\n"))
                .find("not below across_mm"),
            std::string::npos);
}

TEST_F(SceneConfigTest, ColouredMeshes) {
  const std::string mesh = "mesh_unit = \"cm\"\n";
  const auto scene = [&](const std::string& keys) { return with(kScene, mesh, mesh + keys); };
  EXPECT_FALSE(read(kScene).meshes[0].paint);
  const SceneConfig matte = read(scene("color = \"#ff0000\"\n"));
  ASSERT_TRUE(matte.meshes[0].paint);
  EXPECT_EQ(matte.meshes[0].paint->gloss_albedo(0.5)[0], 0);
  const SceneConfig metal =
      read(scene("color = [0, 0, 0]\nroughness = 0.1\nreflectance = [0.9, 0.6, 0.2]\n"));
  EXPECT_NEAR(metal.meshes[0].paint->gloss_albedo(1)[1], 0.6, 0.01);
  for (const auto& [keys, expected] :
       {std::pair{"roughness = 0.3\n", "'roughness': expected color beside it"},
        std::pair{"reflectance = [1, 1, 1]\n", "'reflectance': expected color beside it"},
        std::pair{"color = [1, 0, 0]\nreflectance = [1, 1, 1]\n",
                  "'reflectance': expected roughness beside it"},
        std::pair{"color = [1, 0, 0]\nroughness = 0.01\n", "roughness"},
        std::pair{"color = [1, 0, 2]\n", "color"}}) {
    const std::string error = message(scene(keys));
    EXPECT_NE(error.find("scene.toml:3"), std::string::npos) << error;
    EXPECT_NE(error.find(expected), std::string::npos) << error;
  }
}

TEST_F(SceneConfigTest, FramesOfNumberedMeshesAndTurntables) {
  for (int frame = 0; frame < 2; ++frame)
    std::ofstream(folder_ / ("d_0" + std::to_string(frame) + ".obj")) << "v 0 0 0\n";
  const std::string turning =
      with(kScene, "fov_deg = 30\n", "fov_deg = 30\nturntable_deg_per_frame = 45\n");
  SceneConfig scene = read(with(turning, "\"drape.obj\"", "\"d_##.obj\""));
  EXPECT_EQ(scene.cloths[0].mesh->path.filename(), "d_00.obj");
  EXPECT_EQ(scene.views[0].camera.position, Vec3d(0, -400, 300));
  show_frame(scene, 1);
  EXPECT_EQ(scene.cloths[0].mesh->path.filename(), "d_01.obj");
  EXPECT_LT(
      (scene.views[0].camera.position - Vec3d(400 * std::sqrt(0.5), -400 * std::sqrt(0.5), 300))
          .norm(),
      1e-9)
      << "anticlockwise from above, about what it looks at";
  EXPECT_THROW(show_frame(scene, 2), ConfigError);
  // Shapes that are cut for pictures are cut for all frames alike.
  const auto cuts = [&](int frame) {
    show_frame(scene, frame);
    return cameras_of_cuts(scene);
  };
  EXPECT_EQ(cuts(0).size(), 24U);
  EXPECT_EQ(cuts(0)[5].position, cuts(1)[5].position);
  const std::string wrong = message(with(kScene, "\"drape.obj\"", "\"e_##.obj\""));
  EXPECT_NE(wrong.find("scene.toml:19:"), std::string::npos) << wrong;
  EXPECT_NE(wrong.find("e_00.obj', which is frame 0"), std::string::npos) << wrong;
  EXPECT_EQ(read("frame = 1\n" + with(kScene, "\"drape.obj\"", "\"d_##.obj\""))
                .cloths[0]
                .mesh->path.filename(),
            "d_01.obj");
  // A file of exactly that name is no sequence.
  std::ofstream(folder_ / "e_##.obj") << "v 0 0 0\n";
  EXPECT_EQ(read(with(kScene, "\"drape.obj\"", "\"e_##.obj\"")).cloths[0].mesh->path.filename(),
            "e_##.obj");
}

}  // namespace
}  // namespace heddle
