// configs/README.md documents every key that the parsers ask for, with its type, range and default,
// and no other.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include "fibers/cloth/fabric_config.h"
#include "fibers/cloth/weave_config.h"
#include "formats/image_file.h"
#include "formats/toml_table.h"
#include "precompute/transfer_bake.h"
#include "precompute/visibility_settings.h"
#include "precompute/voxelize.h"
#include "render/scene_config.h"
#include "render/surface/surface_model.h"
#include "render/surface/surface_presets.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

const fs::path kConfigs = fs::path(HEDDLE_SOURCE_DIR) / "configs";

/// "| `key` | type | range | default | meaning |" -> key: "type | range | default"
using Keys = std::map<std::string, std::string>;

/// The rows of one section of the README ("## Fabrics").
Keys documented(const std::string& section) {
  std::ifstream stream(kConfigs / "README.md");
  const std::regex row(
      R"(\| `([^`]+)` \| ([^|]+) \| ([^|]*(?:\\\|[^|]*)*) \| ([^|]+) \| ([^|]+)\|)");
  Keys keys;
  bool inside = false;
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("## ")) inside = line == "## " + section;
    std::smatch match;
    if (!inside || !std::regex_match(line, match, row)) continue;
    const std::string range = std::regex_replace(match[3].str(), std::regex(R"(\\\|)"), "|");
    EXPECT_FALSE(keys.contains(match[1])) << match[1] << " is documented twice";
    keys[match[1]] = match[2].str() + " | " + range + " | " + match[4].str();
  }
  return keys;
}

void add(const TomlTable& document, Keys& keys) {
  for (const AskedKey& key : document.asked_keys())
    keys[key.path] = key.type + " | " + key.range + " | " + key.default_value;
}

std::vector<fs::path> files_in(const char* folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kConfigs / folder)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  return files;
}

void expect_equal(const Keys& asked, const Keys& documented) {
  for (const auto& [key, properties] : asked) {
    const auto found = documented.find(key);
    if (found == documented.end()) {
      ADD_FAILURE() << "not documented: | `" << key << "` | " << properties << " | ... |";
    } else {
      EXPECT_EQ(found->second, properties) << key;
    }
  }
  for (const auto& [key, properties] : documented)
    EXPECT_TRUE(asked.contains(key)) << key << " is documented, and nobody asks for it";
}

// Those of [weave] that say how warp and weft cross have a section of their own.
void remove_weave_keys(Keys& asked) {
  for (const auto& [key, properties] : documented("Weaves")) asked.erase(key);
}

TEST(ConfigDocumentation, NamesEveryKeyOfAWeave) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "d.wif")
      << "[WIF]\n[WEAVING]\nShafts=1\nTreadles=1\nRising Shed=yes\n[WARP]\nThreads=1\n[WEFT]\n"
         "Threads=1\n[THREADING]\n1=1\n[LIFTPLAN]\n1=1\n";
  write_png(folder.path() / "p.png", 1, 1, {0, 0, 0});
  Keys asked;
  for (const char* keys :
       {"notation = \"satin 5/2\"\nface = \"warp\"", "notation = \"pointed 2/2\"\nwidth = 4",
        "matrix = \"1\"", "draft = \"d.wif\"", "picture = \"p.png\""}) {
    const TomlTable document =
        TomlTable::parse(std::string("[weave]\n") + keys, (folder.path() / "fabric.toml").string());
    read_weave(document.table("weave"));
    add(document, asked);
  }
  asked.erase("weave");
  expect_equal(asked, documented("Weaves"));
}

// Those of a yarn too, wherever it stands.
void remove_yarn_keys(Keys& asked) {
  for (const auto& [key, properties] : documented("Yarns")) {
    for (const char* place : {"yarn.NAME.", "warp.", "weft.", "knit.", "curves."})
      asked.erase(place + key);
  }
}

TEST(ConfigDocumentation, NamesEveryKeyOfAYarn) {
  const std::string way =
      "yarn_twist_per_m = 0\nply_twist_per_m = 0\nmigration = 0\nwander_rms_deg = 0\n"
      "density = { epsilon = 0, beta = 1 }\n"
      "hairs = { per_m = 0, start_mm = [0, 0], rise_mm = [1, 0], along_mm = [0, 0], "
      "around_deg = [0, 0] }\nloops = { per_m = 0, height_mm = [0, 0] }\n"
      "slubs = [{ per_m = 0, length_mm = [1, 0], thickness = [1, 0] }]\n"
      "neps = { per_m = 0, diameter_mm = [1, 0], fibers = 1 }\n";
  Keys asked;
  for (const std::string& size :
       {std::string("plies = 1\nfibers_per_ply = 9\nwidth_mm = 1\nheight_mm = 1\n"),
        std::string("plies = 1\ncolor = \"#204060\"\ncount = \"2 tex\"\n"),
        "from = \"" + (kConfigs / "yarns" / "cotton1.toml").string() + "\"\n"}) {
    const TomlTable document = TomlTable::parse(
        "[fiber.f]\nradius_um = 5\ndensity_g_cm3 = 1.5\n"
        "scattering = \"white-isotropic\"\n[yarn]\nfiber = \"f\"\n" +
            size + (size.starts_with("from") ? "" : way),
        "fabric.toml");
    std::vector<FiberType> fibers = {read_fiber(document.table("fiber").table("f"), "f")};
    read_yarn(document.table("yarn"), "yarn", fibers);
    add(document, asked);
  }
  Keys of_yarn;
  for (const auto& [key, properties] : asked) {
    if (key.starts_with("yarn.")) of_yarn[key.substr(5)] = properties;
  }
  expect_equal(of_yarn, documented("Yarns"));
}

TEST(ConfigDocumentation, NamesEveryKeyOfFoundCurves) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "c.obj") << "v 0 0 0\nv 1 0 0\nl 1 2\n";
  Keys asked;
  for (const char* what : {"as = \"yarns\"\nyarn = \"y\"", "as = \"yarns\"\nsequence = [\"y\"]",
                           "as = \"fibers\"\nfiber = \"f\""}) {
    const TomlTable document = TomlTable::parse(
        "name = \"n\"\nsegment_um = 100\n[fiber.f]\nradius_um = 5\n"
        "scattering = \"white-isotropic\"\n[yarn.y]\nfiber = \"f\"\nfrom = \"" +
            (kConfigs / "yarns" / "cotton1.toml").string() +
            "\"\n[curves]\nfile = \"c.obj\"\nunit_mm = 1\nnormal = \"z\"\nfrom_mm = [0, 0]\n"
            "size_mm = [1, 1]\n" +
            what,
        (folder.path() / "fabric.toml").string());
    read_fabric_config(document);
    add(document, asked);
  }
  Keys of_curves;
  for (const auto& [key, properties] : asked) {
    if (key.starts_with("curves.")) of_curves[key] = properties;
  }
  expect_equal(of_curves, documented("Found curves"));
}

TEST(ConfigDocumentation, NamesEveryKeyOfAFabric) {
  Keys asked;
  for (const fs::path& file : files_in("fabrics")) {
    const TomlTable document = TomlTable::load(file);
    if (document.has("model")) continue;  // a surface fabric
    const FabricConfig config = read_fabric_config(document);
    read_visibility_settings(document.table("visibility"), config.light_from_both_sides);
    read_transfer_settings(document.table("transfer"));
    read_volume_settings(document.table("volume"));
    document.finish();
    add(document, asked);
  }
  // What none of them holds.
  TemporaryFolder folder;
  std::ofstream(folder.path() / "d.wif")
      << "[WIF]\n[WEAVING]\nShafts=1\nTreadles=1\nRising Shed=yes\n[WARP]\nThreads=1\nColor=1\n"
         "[WEFT]\nThreads=1\nColor=1\n[COLOR PALETTE]\nEntries=1\nRange=0,255\n[COLOR TABLE]\n"
         "1=9,9,9\n[THREADING]\n1=1\n[LIFTPLAN]\n1=1\n";
  const std::string yarn = "[yarn.y]\nfiber = \"f\"\nfrom = \"" +
                           (kConfigs / "yarns" / "cotton1.toml").string() + "\"\n";
  for (const char* cloth :
       {"[weave]\ndraft = \"d.wif\"\nrepeats_x = 1\nrepeats_y = 1\n[warp]\nspacing_mm = 1\n"
        "sequence = [\"y\"]\ncolors = \"draft\"\n[weft]\nspacing_mm = 1\nsequence = [\"y\"]\n"
        "colors = \"draft\"\n",
        "[knit]\nstructure = \"jersey\"\nwales_per_cm = 5\ncourses_per_cm = 7\nwales = 1\n"
        "courses = 2\nsequence = [\"y\"]\n"}) {
    const TomlTable document = TomlTable::parse(
        "name = \"n\"\nsegment_um = 100\ncoarse = 2\n[fiber.f]\nradius_um = 5\ncolor_r = [0, 0, "
        "0]\n"
        "color_tt = [0, 0, 0]\nbeta_r_deg = 5\nbeta_tt_deg = 5\ngamma_tt_deg = 9\n" +
            yarn + cloth,
        (folder.path() / "fabric.toml").string());
    read_fabric_config(document);
    add(document, asked);
  }
  remove_weave_keys(asked);
  remove_yarn_keys(asked);
  expect_equal(asked, documented("Fabrics"));
}

TEST(ConfigDocumentation, NamesEveryKeyOfASurfaceFabric) {
  struct Model {
    const char* name;
    const char* section;
    std::string more;  // what no preset holds
  };
  const std::string yarn =
      "diffuse = [0, 0, 0]\nspecular = [0, 0, 0]\nsemimajor = 1\neccentricity = 0\nangle_deg = "
      "0\nk = [1, 1]\n";
  const Model models[] = {
      {"irawan-2012", "Woven yarns", ""},
      {"microcylinder", "Microcylinder", ""},
      {"woven-cotton", "Woven cotton",
       "model = \"woven-cotton\"\nunit_mm = 1\n[weave]\nmatrix = \"10 01\"\nend_widths = "
       "[1]\npick_widths = [1]\n[warp]\n" +
           yarn + "[weft]\n" + yarn},
  };
  for (const Model& model : models) {
    Keys asked;
    for (const std::string& name : surface_preset_names(model.name)) {
      const TomlTable document = surface_preset(name);
      read_surface_model(document);
      add(document, asked);
    }
    if (!model.more.empty()) {
      const TomlTable document = TomlTable::parse(model.more, "more.toml");
      read_surface_model(document);
      add(document, asked);
    }
    remove_weave_keys(asked);
    expect_equal(asked, documented(model.section));
  }
}

TEST(ConfigDocumentation, ThePageOfSurfaceModelsNamesEverySurfaceFabric) {
  std::ifstream stream(fs::path(HEDDLE_SOURCE_DIR) / "docs/surface-models.md");
  std::stringstream text;
  text << stream.rdbuf();
  for (const std::string& name : surface_preset_names()) {
    EXPECT_NE(text.str().find("`" + name + "`"), std::string::npos) << name;
  }
}

TEST(ConfigDocumentation, NamesEveryKeyOfAScene) {
  Keys asked;
  for (const fs::path& file : files_in("scenes")) {
    const TomlTable document = TomlTable::load(file);
    read_scene_config(document);
    add(document, asked);
  }
  // What no scene of ours holds.
  const std::string more =
      "[[mesh]]\nmesh = \"../meshes/drape_sphere_64.obj\"\nmesh_unit = \"m\"\ngroup = \"cloth\"\n"
      "name = \"ball\"\n"
      "[[cloth]]\nmesh = \"../meshes/drape_sphere_64.obj\"\nmesh_unit = \"m\"\ngroup = "
      "\"cloth\"\nuv_size_mm = 300\nfabric = \"../fabrics/cotton-tiny.toml\"\n"
      "[[cloth]]\nflat_mm = [1, 1]\nfabric = \"../fabrics/cotton-tiny.toml\"\nfar_surface = "
      "\"silk-shot\"\n"
      "[[light]]\ntype = \"sphere\"\nposition_mm = [0, 0, 9]\nradius_mm = 1\nradiance = [1, 1, 1]\n"
      "[[light]]\ntype = \"rectangle\"\nposition_mm = [0, 9, 9]\nlook_at_mm = [0, 0, 0]\nsize_mm = "
      "[1, 1]\nradiance = [1, 1, 1]\ntexture = \"../maps/sky_128.hdr\"\n";
  std::ifstream stream(kConfigs / "scenes" / "ci.toml");
  std::stringstream text;
  text << stream.rdbuf() << more;
  const TomlTable document =
      TomlTable::parse(text.str(), (kConfigs / "scenes" / "ci.toml").string());
  read_scene_config(document);
  add(document, asked);
  expect_equal(asked, documented("Scenes"));
}

}  // namespace
}  // namespace heddle
