// Relighting from kept samples (docs/relight.md).

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/pipeline/scene_shop.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

constexpr char kSoftLight[] = R"([[light]]
type = "sg"
axis = [-0.5, 0.4, 1]
sharpness = 15
irradiance = [1, 1, 1]
)";

constexpr char kOtherLights[] = R"([[light]]
type = "sphere"
position_mm = [1, -1, 2]
radius_mm = 0.5
radiance = [3, 2, 1]
[[light]]
type = "rectangle"
position_mm = [-2, 1, 3]
look_at_mm = [0, 0, 0]
size_mm = [2, 1]
radiance = [1, 2, 3]
group = "window"
[[light]]
type = "point"
position_mm = [0, -3, 2]
irradiance_at_1_m = [1e-5, 1e-5, 1e-5]
[[light]]
type = "environment"
map = "SOURCE/configs/maps/sky_128.hdr"
gaussians = 2
group = "sky"
)";

/// The scene of everything with a group for each of its two lights, and all layers.
class RelightShop : public EverythingShop {
 public:
  RelightShop() {
    std::string scene = edited(text_of(*this / "everything.toml"), "irradiance = [3, 3, 3]",
                               "irradiance = [3, 3, 3]\ngroup = \"key\"");
    scene = edited(scene, "spp = 2", "spp = 2\nlayers = [\"lobes\", \"surface\", \"cryptomatte\"]");
    write("first.toml", scene);
    write("dimmed.toml", edited(scene, "irradiance = [1, 1, 1]", "irradiance = [0.5, 0.4, 2]"));
    write("other.toml", edited(edited(scene, "direction = [0.3, 0.2, 1]", "direction = [-1, 0, 1]"),
                               kSoftLight, edited(kOtherLights, "SOURCE", HEDDLE_SOURCE_DIR)));
  }
  /// Expects that relighting `kept` makes the files that rendering does. Returns what it said.
  std::string relight(const std::string& kept, const std::string& scene,
                      const std::vector<std::string>& options) const {
    std::vector<std::string> render = {"render", scene, "-o", "rendered.exr", "-j", "2"};
    render.insert(render.end(), options.begin(), options.end());
    succeed(render);
    const ProgramResult result = run({"relight", kept, scene, "-o", "relit.exr", "-j", "1"});
    EXPECT_EQ(result.status, 0) << result.error;
    EXPECT_EQ(text_of(*this / "relit.exr"), text_of(*this / "rendered.exr")) << scene;
    EXPECT_EQ(text_of(*this / "relit.png"), text_of(*this / "rendered.png")) << scene;
    return result.error;
  }
};

TEST(RelightEndToEnd, MakesTheFilesThatRenderMakes) {
  const RelightShop shop;
  const auto says = [](const std::string& said, const std::string& line) {
    EXPECT_NE(said.find(line), std::string::npos) << said;
  };
  const std::vector<std::string> crop = {"--crop", "2,1,23,20", "--spp", "9"};
  shop.succeed({"render", "first.toml", "-o", "kept-1.exr", "--keep", "light", "-j", "1", "--crop",
                "2,1,23,20", "--spp", "9"});
  shop.succeed({"render", "first.toml", "-o", "kept-2.exr", "--keep", "light", "-j", "2", "--crop",
                "2,1,23,20", "--spp", "9"});
  EXPECT_EQ(text_of(shop / "kept-1.gbuffer"), text_of(shop / "kept-2.gbuffer"));

  const std::string same = shop.relight("kept-1.gbuffer", "first.toml", crop);
  EXPECT_EQ(text_of(shop / "relit.exr"), text_of(shop / "kept-1.exr"));
  says(same, "light of key: as it was kept");
  says(same, "light of rest: as it was kept");
  const std::string dimmed = shop.relight("kept-1.gbuffer", "dimmed.toml", crop);
  says(dimmed, "light of key: as it was kept");
  says(dimmed, "light of rest: shaded anew, with the shadows that were kept");
  const std::string other = shop.relight("kept-1.gbuffer", "other.toml", crop);
  says(other, "light of key: shaded anew, with new shadow rays");
  says(other, "light of sky: shaded anew, with new shadow rays");

  // Without light, and for a method that draws directions beside shadows.
  const std::vector<std::string> dual = {"--method", "dual-scattering"};
  shop.succeed({"render", "everything.toml", "-o", "dual.exr", "--keep", "rays", dual[0], dual[1]});
  says(shop.relight("dual.gbuffer", "everything.toml", dual),
       "all light: shaded anew, with new shadow rays");
}

TEST(RelightEndToEnd, OtherScenesAndDamagedFilesAreRefused) {
  const SequenceShop shop;
  shop.write("flat.toml", kSmallScene);
  shop.succeed({"render", "flat.toml", "-o", "f.exr", "--keep", "rays"});
  const auto refused = [&](const std::vector<std::string>& arguments, int status,
                           const std::string& reason) {
    const ProgramResult result = shop.run(arguments);
    EXPECT_EQ(result.status, status) << reason;
    EXPECT_NE(result.error.find(reason), std::string::npos) << result.error;
    EXPECT_FALSE(fs::exists(shop / "x.exr"));
  };
  const auto differs = [&](const std::string& from, const std::string& to,
                           const std::string& part) {
    shop.write("edited.toml", edited(kSmallScene, from, to));
    refused({"relight", "f.gbuffer", "edited.toml", "-o", "x.exr"}, 2, "its lights: " + part + ".");
  };
  differs("fov_deg = 25", "fov_deg = 26", "camera");
  differs("flat_mm = [4, 4]", "flat_mm = [4, 5]", "cloth 1");
  differs("spp = 2", "spp = 2\nfilter = \"triangle\"", "[render]");
  shop.write("fabric.toml", edited(kSmallFabric, "[0.5, 0.6, 0.7]", "[0.5, 0.6, 0.8]"));
  refused({"relight", "f.gbuffer", "flat.toml", "-o", "x.exr"}, 2,
          "its lights: fabric 1 (fabric.toml).");
  shop.write("fabric.toml", kSmallFabric);

  const std::string whole = text_of(shop / "f.gbuffer");
  write_bytes(shop / "f.gbuffer", whole.substr(0, whole.size() - 1));
  refused({"relight", "f.gbuffer", "flat.toml", "-o", "x.exr"}, 1, "f.gbuffer: damaged");
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  write_bytes(shop / "f.gbuffer", flipped);
  refused({"relight", "f.gbuffer", "flat.toml", "-o", "x.exr"}, 1, "f.gbuffer: damaged");
  refused({"relight", "flat.toml", "flat.toml", "-o", "x.exr"}, 1, "no G-buffer");

  refused({"render", "flat.toml", "-o", "x.exr", "--keep", "rays", "--method", "path"}, 2,
          "--keep: the method path");
  for (const std::vector<std::string>& with :
       {std::vector<std::string>{"--noise", "0.1"}, {"--frames", "0-1"}, {"--tolerance", "0.1"}}) {
    std::vector<std::string> render = {"render", "flat.toml", "-o", "x.exr", "--keep", "light"};
    render.insert(render.end(), with.begin(), with.end());
    refused(render, 2, "--keep: not together with");
  }
}

}  // namespace
}  // namespace heddle
