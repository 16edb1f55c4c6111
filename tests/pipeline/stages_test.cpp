// What the stages of a fabric depend on, field by field of its config; and what a stage that is
// done by chunks says.

#include "pipeline/stages.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "fibers/baked/transfer.h"
#include "formats/input_error.h"
#include "formats/toml_table.h"
#include "precompute/segment_cells.h"
#include "precompute/visibility_settings.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

// The stages whose results follow what a field says.
const Names kOfGeometry = {"synth", "maps", "ssdf", "sg", "transfer", "voxelize", "accuracy"};
const Names kOfScattering = {"synth", "transfer", "accuracy"};
const Names kOfLight = {"maps", "ssdf", "sg", "transfer", "accuracy"};
const Names kOfVisibility = {"ssdf", "sg", "accuracy"};
const Names kOfTransfer = {"transfer", "accuracy"};
const Names kOfVolume = {"voxelize", "accuracy"};
const Names kOfThePackOnly = {};

struct Field {
  const char* path;   // as in AskedKey::path
  const char* value;  // as in the file
  const char* other;
  Names stages;  // whose keys change where `other` stands in place of `value`
};

/// Every field of a fabric. The fibers NAME are called a and b, and both are alike.
const std::vector<Field> kFields = {
    {"name", "\"tiny\"", "\"other\"", kOfThePackOnly},
    {"seed", "7", "8", kOfGeometry},
    {"light_from", "\"face\"", "\"both\"", kOfLight},
    {"segment_um", "60", "50", kOfGeometry},
    {"weave.notation", "\"satin 5/2\"", "\"satin 5/3\"", kOfGeometry},
    {"weave.face", "\"warp\"", "\"weft\"", kOfGeometry},
    {"weave.repeats_x", "1", "2", kOfGeometry},
    {"weave.repeats_y", "1", "2", kOfGeometry},
    {"weave.crimp_warp", "0.4", "0.5", kOfGeometry},
    {"fiber.NAME.radius_um", "14", "15", kOfGeometry},
    {"fiber.NAME.scattering", "\"khungurn\"", "\"white-isotropic\"", kOfScattering},
    {"fiber.NAME.color_r", "[0.3, 0.2, 0.1]", "[0.3, 0.2, 0.2]", kOfScattering},
    {"fiber.NAME.color_tt", "[0.8, 0.6, 0.4]", "[0.7, 0.6, 0.4]", kOfScattering},
    {"fiber.NAME.beta_r_deg", "5", "6", kOfScattering},
    {"fiber.NAME.beta_tt_deg", "10", "11", kOfScattering},
    {"fiber.NAME.gamma_tt_deg", "20", "21", kOfScattering},
    {"warp.fiber", "\"a\"", "\"b\"", kOfScattering},
    {"warp.spacing_mm", "0.3", "0.31", kOfGeometry},
    {"warp.width_mm", "0.2", "0.21", kOfGeometry},
    {"warp.height_mm", "0.12", "0.13", kOfGeometry},
    {"warp.plies", "1", "2", kOfGeometry},
    {"warp.fibers_per_ply", "2", "3", kOfGeometry},
    {"warp.yarn_twist_per_m", "0", "700", kOfGeometry},
    {"warp.ply_twist_per_m", "700", "1400", kOfGeometry},
    {"warp.migration", "0.1", "0.2", kOfGeometry},
    {"warp.migration_per_turn", "1", "2", kOfGeometry},
    {"warp.contact_flattening", "0", "0.1", kOfGeometry},
    {"warp.wander_rms_deg", "4", "5", kOfGeometry},
    {"weft.fiber", "\"a\"", "\"b\"", kOfScattering},
    {"weft.spacing_mm", "0.3", "0.31", kOfGeometry},
    {"weft.width_mm", "0.2", "0.21", kOfGeometry},
    {"weft.height_mm", "0.12", "0.13", kOfGeometry},
    {"weft.plies", "1", "2", kOfGeometry},
    {"weft.fibers_per_ply", "2", "3", kOfGeometry},
    {"weft.yarn_twist_per_m", "0", "700", kOfGeometry},
    {"weft.ply_twist_per_m", "700", "1400", kOfGeometry},
    {"weft.migration", "0.1", "0.2", kOfGeometry},
    {"weft.migration_per_turn", "1", "2", kOfGeometry},
    {"weft.contact_flattening", "0", "0.1", kOfGeometry},
    {"weft.wander_rms_deg", "4", "5", kOfGeometry},
    {"visibility.components", "4", "5", kOfVisibility},
    {"visibility.pca_segments", "100", "101", kOfVisibility},
    {"visibility.sg_axes", "\"sphere\"", "\"hemisphere\"", kOfVisibility},
    {"visibility.sg_count", "8", "9", kOfVisibility},
    {"visibility.sg_sharpness", "20", "21", kOfVisibility},
    {"visibility.sg_weights", "\"voronoi\"", "\"nnls\"", kOfVisibility},
    {"transfer.order", "0", "1", kOfTransfer},
    {"transfer.cell_mean_free_paths", "4", "5", kOfTransfer},
    {"transfer.min_paths", "4096", "4097", kOfTransfer},
    {"transfer.max_paths", "8192", "8193", kOfTransfer},
    {"transfer.cones", "\"off\"", "\"on\"", kOfTransfer},
    {"transfer.target_error", "0.5", "0.4", kOfTransfer},
    {"volume.voxels_per_radius", "0.5", "0.6", kOfVolume},
};

using Changes = std::map<std::string, std::string>;  // by path

/// The fabric of all fields; `changes` take the place of their values, "" leaves the key out.
std::string fabric_text(const Changes& changes) {
  const auto value_of = [&](const std::string& path, const char* value) {
    const auto change = changes.find(path);
    return change != changes.end() ? change->second : std::string(value);
  };
  const std::string root = "root";
  std::vector<std::string> order = {root};
  std::map<std::string, std::string> sections;
  const bool is_white = changes.contains("fiber.NAME.scattering");
  for (const Field& field : kFields) {
    const std::string path = field.path;
    const std::size_t dot = path.rfind('.');
    const std::string table = dot == std::string::npos ? root : path.substr(0, dot);
    const std::string key = dot == std::string::npos ? path : path.substr(dot + 1);
    if (!sections.contains(table) && table != root) order.push_back(table);
    // What scatters everything evenly has no lobes.
    const bool of_lobes = table == "fiber.NAME" && key != "radius_um" && key != "scattering";
    if (is_white && of_lobes) continue;
    const std::string value = value_of(path, field.value);
    if (!value.empty()) sections[table] += key + " = " + value + "\n";
  }
  std::string text = sections[root];
  for (const std::string& table : order) {
    if (table == root) continue;
    if (table != "fiber.NAME") {
      text += "[" + table + "]\n" + sections[table];
      continue;
    }
    text += "[fiber.a]\n" + sections[table];
    text +=
        "[fiber.b]\nradius_um = 14\ncolor_r = [0.3, 0.2, 0.1]\ncolor_tt = [0.8, 0.6, 0.4]\n"
        "beta_r_deg = 5\nbeta_tt_deg = 10\ngamma_tt_deg = 20\n";
  }
  return text;
}

/// A cache and a fabric file of its own, and what the stages say to the console but progress.
class Stages {
 public:
  FabricStages of(const std::string& text, const FabricVariant& variant = {},
                  BakeChoices choices = BakeChoices::kShipped) {
    std::ofstream(folder_.path() / "fabric.toml") << text;
    return {folder_.path() / "fabric.toml", context_, variant, choices};
  }
  std::map<std::string, std::string> keys(FabricStages&& stages, std::optional<int> order = {}) {
    Needs needs = kEverything;
    needs.order = order;
    std::map<std::string, std::string> keys = {{"accuracy", stages.accuracy_place().key}};
    for (const StageCost& cost : stages.costs(needs)) keys[cost.stage] = cost.key;
    return keys;
  }
  std::string said() const { return said_.str(); }
  const StageResult& result_of(const std::string& stage) const {
    for (const StageResult& result : context_.results) {
      if (result.stage == stage) return result;
    }
    throw FileError("no stage " + stage);
  }

 private:
  TemporaryFolder folder_;
  std::ostringstream said_;
  Console console_{said_, false, true};

 public:
  StageContext context_{.cache = Cache(folder_.path() / "cache"),
                        .console = &console_,
                        .fabric_seed = {},
                        .picture_seed = {},
                        .results = {}};
};

Names differing(const std::map<std::string, std::string>& a,
                const std::map<std::string, std::string>& b) {
  Names names;
  for (const auto& [stage, key] : a) {
    if (b.at(stage) != key) names.insert(stage);
  }
  return names;
}

std::string joined(const Names& names) {
  std::string text;
  for (const std::string& name : names) text += name + " ";
  return text;
}

TEST(StageKeys, TheTableNamesEveryFieldOfAFabric) {
  const TomlTable document = TomlTable::parse(fabric_text({}), "fabric.toml");
  const FabricConfig config = read_fabric_config(document);
  read_visibility_settings(document.table("visibility"), config.light_from_both_sides);
  read_transfer_settings(document.table("transfer"));
  read_volume_settings(document.table("volume"));
  document.finish();
  Names asked;
  for (const AskedKey& key : document.asked_keys()) {
    // Keys that may be absent, and are.
    const bool is_table = key.type.starts_with("table");
    const bool is_absent = key.default_value == "optional" &&
                           std::none_of(kFields.begin(), kFields.end(),
                                        [&](const Field& field) { return field.path == key.path; });
    if (!is_table && !is_absent) asked.insert(key.path);
  }
  Names listed;
  for (const Field& field : kFields) listed.insert(field.path);
  EXPECT_EQ(asked, listed);
  EXPECT_EQ(listed.size(), kFields.size());
}

TEST(StageKeys, EachFieldChangesTheStagesThatDependOnItAndNoOthers) {
  Stages stages;
  const auto base = stages.keys(stages.of(fabric_text({})));
  ASSERT_EQ(base.size(), 7U);
  EXPECT_EQ(stages.keys(stages.of("# A comment says nothing.\n" + fabric_text({}))), base);
  for (const Field& field : kFields) {
    const auto changed = stages.keys(stages.of(fabric_text({{field.path, field.other}})));
    EXPECT_EQ(joined(differing(base, changed)), joined(field.stages)) << field.path;
  }
}

// What is not in the file: an order asked for, a chart's factors, the printed choices.
TEST(StageKeys, VariantsChangeWhatTheySayAndAreWhatAConfigWouldSay) {
  Stages stages;
  const auto base = stages.keys(stages.of(fabric_text({})));
  const auto differences = [&](const std::map<std::string, std::string>& keys) {
    return joined(differing(base, keys));
  };
  // The table of accuracy is of the fabric's own order.
  EXPECT_EQ(differences(stages.keys(stages.of(fabric_text({})), 2)), joined({"transfer"}));
  EXPECT_EQ(stages.keys(stages.of(fabric_text({})), 2).at("transfer"),
            stages.keys(stages.of(fabric_text({{"transfer.order", "2"}}))).at("transfer"));
  const auto cells = stages.keys(stages.of(fabric_text({}), {.cell_size = 2}));
  EXPECT_EQ(differences(cells), joined(kOfTransfer));
  EXPECT_EQ(cells, stages.keys(stages.of(fabric_text({{"transfer.cell_mean_free_paths", "8"}}))));
  const auto voxels = stages.keys(stages.of(fabric_text({}), {.voxel_rate = 3}));
  EXPECT_EQ(differences(voxels), joined(kOfVolume));
  EXPECT_EQ(voxels, stages.keys(stages.of(fabric_text({{"volume.voxels_per_radius", "1.5"}}))));
  EXPECT_EQ(differences(stages.keys(stages.of(fabric_text({}), {}, BakeChoices::kPrinted))),
            joined(kOfLight));
  stages.context_.fabric_seed = 8;
  EXPECT_EQ(stages.keys(stages.of(fabric_text({}))),
            stages.keys(stages.of(fabric_text({{"seed", "8"}}))));
}

/// Four fibers of four pieces: a pack of everything in a fraction of a second.
Changes four_fibers() {
  return {{"weave.notation", "\"plain\""}, {"weave.face", ""},
          {"segment_um", "400"},           {"warp.fibers_per_ply", "1"},
          {"weft.fibers_per_ply", "1"},    {"warp.ply_twist_per_m", "0"},
          {"weft.ply_twist_per_m", "0"},   {"transfer.max_paths", "4096"}};
}

TEST(StageKeys, APackIsAnotherWhereAnyOfItsPartsIs) {
  Stages stages;
  const auto pack_with = [&](const Changes& more, const Needs& needs = kEverything) {
    Changes changes = four_fibers();
    for (const auto& [path, value] : more) changes[path] = value;
    return stages.of(fabric_text(changes)).pack(needs).key;
  };
  Names keys;
  std::size_t packs = 0;
  const auto expect_new = [&](const std::string& key, const std::string& what) {
    EXPECT_TRUE(keys.insert(key).second) << what;
    ++packs;
  };
  expect_new(pack_with({}), "all");
  for (const Field& field : kFields) {
    const std::string path = field.path;
    const bool one_of_each = path == "name" || path == "light_from" ||
                             path == "visibility.components" || path == "transfer.target_error" ||
                             path == "volume.voxels_per_radius" || path == "fiber.NAME.color_r";
    if (one_of_each) expect_new(pack_with({{path, field.other}}), path);
  }
  expect_new(pack_with({}, {}), "fibers");
  expect_new(pack_with({}, {.ssdf = true, .order = {}}), "signed distances");
  expect_new(pack_with({}, {.sgs = true, .order = {}}), "Gaussians");
  expect_new(pack_with({}, {.transfer = true, .order = {}}), "transfer");
  expect_new(pack_with({}, {.transfer = true, .order = 1}), "transfer to order 1");
  expect_new(pack_with({}, {.volume = true, .order = {}}), "volume");
  EXPECT_EQ(packs, 13U);
  EXPECT_EQ(stages.said(), "");
}

// A stage by chunks, from nothing and from what a shard left: every chunk is done once, the last
// too, which is shorter; a clean run has nothing to warn of.
TEST(StageChunks, ACleanRunAndAResumeWarnOfNothing) {
  const std::string text = fabric_text({{"weave.notation", "\"plain\""},
                                        {"weave.face", ""},
                                        {"warp.fibers_per_ply", "4"},
                                        {"weft.fibers_per_ply", "4"},
                                        {"transfer.cell_mean_free_paths", "0.5"},
                                        {"transfer.max_paths", "4096"}});
  for (const bool resumed : {false, true}) {
    Stages stages;
    FabricStages of_fabric = stages.of(text);
    if (resumed) {
      of_fabric.transfer_shard({}, {1, 3});
      // Its line of the report has the same key: it stands for the stage.
      EXPECT_GT(stages.result_of("transfer").chunks, 0U);
      stages.context_.results.clear();
    }
    const Transfer transfer = read_transfer(of_fabric.transfer({}).path);
    EXPECT_EQ(stages.said(), "");
    const StageResult& result = stages.result_of("transfer");
    const std::size_t cells = transfer.cell_count();
    // As many as cubes of half a mean free path would hold fibers.
    const Exemplar exemplar = read_exemplar(of_fabric.synth().path);
    const TileScene scene(exemplar);
    const double edge = 0.5 * scene.mean_free_path(7, kMeanFreePathSamples);
    EXPECT_EQ(cells, make_segment_cells(
                         exemplar, find_segment_origins(scene, false, OriginChoice::kExposed, 7),
                         static_cast<float>(edge))
                         .count);
    ASSERT_GT(cells, 64U);
    ASSERT_NE(cells % 32, 0U) << "the last chunk is to be a short one";
    const std::size_t chunks = (cells + 31) / 32;
    EXPECT_EQ(result.chunks + result.resumed, chunks);
    EXPECT_EQ(result.resumed, resumed ? (chunks + 1) / 3 : 0U);
  }
}

}  // namespace
}  // namespace heddle
