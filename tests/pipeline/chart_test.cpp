// `heddle chart`: the law of its fronts, and the built program's charts of a tiny scene. The page
// is opened in Chromium, which `pipeline/install_packages.sh --tests` installs; without it that
// test is skipped (and counted as such), but fails in CI.

#include "pipeline/chart/chart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <regex>
#include <set>

#include "pipeline/chart/xml_text.h"
#include "pipeline/work_time.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::vector<CostAndError> random_points(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> grid(1, 12);  // coarse, so that ties come up
  std::vector<CostAndError> points(40);
  for (CostAndError& point : points)
    point = {static_cast<double>(grid(random)), static_cast<double>(grid(random))};
  return points;
}

bool dominates(const CostAndError& a, const CostAndError& b) {
  return a.cost <= b.cost && a.error <= b.error && (a.cost < b.cost || a.error < b.error);
}

TEST(ChartLaw, FrontIsWhatNothingDominates) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const std::vector<CostAndError> points = random_points(seed);
    const std::vector<bool> front = pareto_front(points);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const bool dominated =
          std::any_of(points.begin(), points.end(),
                      [&](const CostAndError& other) { return dominates(other, points[k]); });
      ASSERT_EQ(front[k], !dominated) << "seed " << seed << ", point " << k;
    }
  }
}

TEST(ChartLaw, FrontDoesNotDependOnTheOrder) {
  const std::vector<CostAndError> points = random_points(3);
  const std::vector<bool> front = pareto_front(points);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  std::vector<CostAndError> shuffled;
  for (const std::size_t k : order) shuffled.push_back(points[k]);
  const std::vector<bool> shuffled_front = pareto_front(shuffled);
  for (std::size_t k = 0; k < order.size(); ++k) EXPECT_EQ(shuffled_front[k], front[order[k]]);
}

TEST(ChartLaw, PointsThatAreNotFiniteAreOnNoFront) {
  EXPECT_EQ(pareto_front(std::vector<CostAndError>{{1, NAN}, {NAN, 0}, {2, 3}, {INFINITY, 0}}),
            (std::vector<bool>{false, false, true, false}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(Chart, TextForMarkup) {
  EXPECT_EQ(xml_text("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
}

TEST(Chart, WorkTimeCountsCoresAndWalls) {
  const Stopwatch watch;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  const WorkTime slept = watch.elapsed();
  EXPECT_GE(slept.seconds, 0.03);
  EXPECT_LT(slept.core_seconds, 0.02);
  EXPECT_NEAR((slept + slept - slept).seconds, slept.seconds, 1e-9);
  EXPECT_GE(working_threads(), 1);
}

// A variant reads as if the fabric said so, and so has the keys of a fabric that does.
TEST(Chart, VariantsOfAFabricAreFabrics) {
  const TemporaryFolder folder;
  const auto document = [&](const std::string& from, const std::string& to,
                            const FabricVariant& variant) {
    std::ofstream(folder.path() / "fabric.toml")
        << std::regex_replace(std::string(kSmallFabric), std::regex(from), to);
    return read_fabric_document(folder.path() / "fabric.toml", {}, variant);
  };
  const FabricDocument usual = document("", "", {});
  const FabricDocument varied = document("", "", {.cell_size = 2, .voxel_rate = 2});
  const FabricDocument cells =
      document("cell_mean_free_paths = 2.5", "cell_mean_free_paths = 5.0", {});
  const FabricDocument voxels = document("\\[volume\\]", "[volume]\nvoxels_per_radius = 3.0", {});
  EXPECT_NE(varied.transfer_text, usual.transfer_text);
  EXPECT_EQ(varied.transfer_text, cells.transfer_text);
  EXPECT_EQ(varied.transfer.cell_mean_free_paths, cells.transfer.cell_mean_free_paths);
  EXPECT_EQ(varied.volume_text, voxels.volume_text);
  EXPECT_EQ(varied.volume.voxels_per_radius, voxels.volume.voxels_per_radius);
  EXPECT_EQ(varied.cloth_text, usual.cloth_text);
  EXPECT_EQ(varied.visibility_text, usual.visibility_text);
}

SceneConfig scene_of_fibers() {
  SceneConfig scene;
  scene.cloths.emplace_back();
  return scene;
}

std::vector<std::string> labels_of(const std::vector<ChartRun>& runs, const std::string& method) {
  std::vector<std::string> labels;
  for (const ChartRun& run : runs) {
    if (run.method == method) labels.push_back(run.label);
  }
  return labels;
}

TEST(Chart, FormsOfVisibilityFollowTheLights) {
  const auto labels = [](std::optional<float> sharpness) {
    SceneConfig scene = scene_of_fibers();
    Light light;
    if (sharpness) {
      light.type = LightType::kSphericalGaussian;
      light.sharpness = *sharpness;
    }
    scene.lights = {light};
    return labels_of(chart_runs(scene, {}, {}), "exact, form of visibility");
  };
  using Labels = std::vector<std::string>;
  EXPECT_EQ(labels({}), Labels{});  // a directional light has one form only
  EXPECT_EQ(labels(10.0F), (Labels{"signed distance", "blend"}));
  EXPECT_EQ(labels(15.0F), (Labels{"Gaussians", "signed distance", "blend"}));
  EXPECT_EQ(labels(50.0F), (Labels{"Gaussians", "blend"}));
}

TEST(Chart, LaddersHoldEverySetting) {
  SceneConfig scene = scene_of_fibers();
  scene.cloths[0].fabric = "warm.toml";
  scene.cloths.push_back(scene.cloths[0]);
  scene.cloths.emplace_back().fabric = "cool.toml";
  const std::vector<ChartRun> runs = chart_runs(scene, {}, {});
  for (const std::string_view method : render_method_names())
    EXPECT_GE(labels_of(runs, std::string(method)).size(), 3U) << method;
  EXPECT_EQ(labels_of(runs, "path").size(), 5U);
  EXPECT_EQ(labels_of(runs, "exact, order of the transfer").size(), 6U);
  EXPECT_EQ(labels_of(runs, "exact, size of the cells"),
            (std::vector<std::string>{"cells x 4", "cells x 2", "cells x 1"}));
  for (const ChartRun& run : runs) {
    EXPECT_TRUE(!traces_paths(run.request.method) || run.request.spp % 2 == 0)
        << "a path tracer keeps two halves";
    EXPECT_EQ(run.request.local, run.method == "path, local");
    EXPECT_EQ(run.settings.at("spp"), run.request.spp);
    // Every fabric of the scene, or none.
    EXPECT_TRUE(run.variant.fabrics.empty() || run.variant.fabrics.size() == 2);
    for (const char* fabric : {"warm.toml", "cool.toml"}) {
      const SceneVariant::OfFabric of = run.variant.of(fabric);
      EXPECT_EQ(run.settings.contains("order"), of.order.has_value());
      EXPECT_EQ(run.settings.value("cell_size", 1.0), of.variant.cell_size);
      EXPECT_EQ(run.settings.value("voxel_rate", 1.0), of.variant.voxel_rate);
    }
    // A run that changes nothing needs no data of its own.
    if (run.label == "cells x 1" || run.label == "voxels x 1") {
      EXPECT_EQ(run.variant, SceneVariant{});
    }
  }
  EXPECT_LT(chart_runs(scene_of_fibers(), {}, {.quick = true}).size(), runs.size());
  EXPECT_TRUE(labels_of(chart_runs(SceneConfig{}, {}, {}), "exact, order of the transfer").empty());
}

TEST(Chart, SurfacesThatHaveAChoiceAreShadedBothWays) {
  SceneConfig scene;
  scene.cloths.emplace_back().surface.emplace();
  EXPECT_TRUE(labels_of(chart_runs(scene, {}, {}), "exact, surfaces interactive").empty());
  scene.cloths[0].surface->interactive.emplace();
  for (const char* name : {"exact, surfaces sampled", "exact, surfaces interactive"}) {
    EXPECT_EQ(labels_of(chart_runs(scene, {}, {.quick = true}), name),
              (std::vector<std::string>{"1 spp", "4 spp"}));
  }
  for (const ChartRun& run : chart_runs(scene, {}, {})) {
    EXPECT_EQ(run.settings.contains("surface_method"), run.variant.surface_method.has_value());
    EXPECT_EQ(run.method == "exact, surfaces interactive",
              run.variant.surface_method == SurfaceMethod::kInteractive);
  }
}

/// The small scene by a name that must be escaped, from further away.
std::string chart_scene() {
  const std::string name = R"(name = "tiny <swatch>, \"quoted\"")";
  std::string scene = edited(kSmallScene, R"(name = "swatch")", name);
  scene = edited(scene, "[0.1, -0.5, 1.0]", "[0.3, -1.5, 3]");
  scene = edited(scene, "[24, 24]", "[24, 18]");
  return edited(scene, "[4, 4]", "[10, 10]");
}

/// A chart of a tiny scene. ctest runs each test in a process of its own, so each makes its chart:
/// a few seconds.
class ChartEndToEnd : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::ofstream(folder_->path() / "fabric.toml") << kSmallFabric;
    std::ofstream(folder_->path() / "scene.toml") << chart_scene();
    first_ = run({"--quick", "--reference-spp", "64"}).status;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  void SetUp() override { ASSERT_EQ(first_, 0) << text_of(folder_->path() / "stderr.txt"); }

  static ProgramResult run(std::vector<std::string> options, const std::string& name = "chart") {
    options.insert(options.begin(), {"chart", folder_->path() / "scene.toml", "-o",
                                     folder_->path() / name, "--cache", folder_->path() / "cache"});
    return Program(folder_->path(), options).wait();
  }
  static fs::path path(const std::string& name) { return folder_->path() / name; }
  static Json chart(const std::string& name = "chart") {
    return Json::parse(text_of(path(name) / "chart.json"));
  }

  static int command_status(const std::string& command) {
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  static int schema_status(const fs::path& file) {
    const fs::path root = HEDDLE_SOURCE_DIR;
    return command_status("python3 " + (root / "tests/pipeline/check_schema.py").string() + " " +
                          (root / "docs/chart-schema.json").string() + " " + file.string());
  }

  static std::unique_ptr<TemporaryFolder> folder_;
  static int first_;
};

std::unique_ptr<TemporaryFolder> ChartEndToEnd::folder_;
int ChartEndToEnd::first_ = -1;

TEST_F(ChartEndToEnd, RowsAreCompleteAndSorted) {
  const Json json = chart();
  const std::string csv = text_of(path("chart") / "chart.csv");
  std::vector<std::string> methods;
  std::map<std::string, std::vector<int>> samples;
  for (const Json& row : json.at("rows")) {
    SCOPED_TRACE(row.at("method").get<std::string>() + ", " + row.at("label").get<std::string>());
    EXPECT_EQ(row.at("status"), "done") << row.at("message");
    EXPECT_EQ(row.at("key").get<std::string>().size(), 32U);
    EXPECT_EQ(row.at("seed"), 1);
    EXPECT_GT(row.at("render_seconds"), 0.0);
    EXPECT_GE(row.at("total_seconds"), row.at("render_seconds"));
    double stages = 0;
    for (const Json& stage : row.at("stages")) stages += stage.at("seconds").get<double>();
    EXPECT_NEAR(row.at("precompute_seconds").get<double>(), stages, 1e-9);
    for (const char* against : {"full", "local"}) {
      const Json& error = row.at("error").at(against);
      EXPECT_LE(error.at("relative_rmse_low"), error.at("relative_rmse"));
      EXPECT_GE(error.at("relative_rmse_high"), error.at("relative_rmse"));
      EXPECT_TRUE(fs::exists(path("chart") / error.at("difference").get<std::string>()));
    }
    EXPECT_TRUE(fs::exists(path("chart") / row.at("picture").get<std::string>()));
    const auto method = row.at("method").get<std::string>();
    if (methods.empty() || methods.back() != method) methods.push_back(method);
    samples[method].push_back(row.at("settings").at("spp").get<int>());
  }
  EXPECT_EQ(methods, (std::vector<std::string>{"path", "path, local", "exact", "volume",
                                               "exact, form of visibility", "volume, resolution"}));
  for (const char* method : {"path", "path, local", "exact", "volume"}) {
    EXPECT_EQ(samples.at(method).size(), 2U);
    EXPECT_TRUE(std::is_sorted(samples.at(method).begin(), samples.at(method).end()));
  }
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
            json.at("rows").size() + 1);
  const std::string names = csv.substr(0, csv.find('\n'));
  for (const char* name : {"method", "settings", "key", "seed", "program_version",
                           "full_relative_rmse", "local_flip"}) {
    EXPECT_NE(names.find(name), std::string::npos) << name;
  }
  EXPECT_NE(csv.find("\"path, local\",2 spp,spp=2,done"), std::string::npos);
}

TEST_F(ChartEndToEnd, InfoListsItsRuns) {
  Program program(folder_->path(), {"info", path("chart") / "chart.json", "--json"});
  const ProgramResult result = program.wait();
  ASSERT_EQ(result.status, 0) << result.error;
  const Json info = Json::parse(result.out);
  EXPECT_EQ(info.at("kind"), "chart");
  for (const Json& row : chart().at("rows")) {
    EXPECT_TRUE(info.contains("run." + row.at("method").get<std::string>() + ", " +
                              row.at("label").get<std::string>()));
  }
}

// What the rows of one chart say of each other.
TEST_F(ChartEndToEnd, RowsFollowTheirSettings) {
  const Json json = chart();
  std::map<std::string, std::set<std::string>> stages;
  std::map<std::string, std::string> keys;
  std::map<std::string, double> error;
  for (const Json& row : json.at("rows")) {
    const std::string name =
        row.at("method").get<std::string>() + " " + row.at("label").get<std::string>();
    for (const Json& stage : row.at("stages"))
      stages[name].insert(stage.at("stage").get<std::string>());
    keys[name] = row.at("key");
    error[name] = row.at("error").at("full").at("relative_rmse");
  }
  // Path tracing pays for the fibers only; the others for what their lights and eye rays need.
  using Names = std::set<std::string>;
  EXPECT_EQ(stages.at("path 2 spp"), Names{"synth"});
  EXPECT_EQ(stages.at("exact 1 spp"), (Names{"synth", "maps", "ssdf", "sg", "transfer"}));
  EXPECT_EQ(stages.at("volume 1 spp"),
            (Names{"synth", "maps", "ssdf", "sg", "transfer", "voxelize"}));
  EXPECT_EQ(stages.at("exact, form of visibility signed distance"),
            (Names{"synth", "maps", "ssdf", "transfer"}));

  // Settings that change pictures have keys of their own; those that do not share them.
  EXPECT_EQ(keys.at("exact, form of visibility blend"), keys.at("exact 4 spp"));
  std::set<std::string> distinct;
  for (const auto& [name, key] : keys) distinct.insert(key);
  EXPECT_EQ(distinct.size(), keys.size() - 1);

  // The path tracer has no bias: its error is its noise, which falls with the root of its samples
  // (2 to 8: by half). Single values spread widely where there are so few; a factor of 1.5 is left
  // on both sides.
  EXPECT_GT(error.at("path 8 spp") / error.at("path 2 spp"), 0.5 / 1.5);
  EXPECT_LT(error.at("path 8 spp") / error.at("path 2 spp"), 0.5 * 1.5);
}

TEST_F(ChartEndToEnd, FollowsItsSchema) {
  EXPECT_EQ(schema_status(path("chart") / "chart.json"), 0);
  const auto broken_status = [&](auto&& breakage) {
    Json json = chart();
    breakage(json);
    std::ofstream(path("broken.json")) << json;
    return schema_status(path("broken.json"));
  };
  EXPECT_EQ(broken_status([](Json&) {}), 0);
  EXPECT_EQ(broken_status([](Json& json) { json.erase("rows"); }), 1);
  EXPECT_EQ(broken_status([](Json& json) { json["rows"][0]["status"] = "fine"; }), 1);
  EXPECT_EQ(broken_status([](Json& json) { json["rows"][1]["render_seconds"] = "1"; }), 1);
  EXPECT_EQ(broken_status([](Json& json) { json["rows"][1]["error"]["full"]["flip"] = 1.5; }), 1);
  EXPECT_EQ(broken_status([](Json& json) { json["references"]["full"]["surprise"] = 1; }), 1);
}

std::map<std::string, fs::file_time_type> times_of(const fs::path& folder) {
  std::map<std::string, fs::file_time_type> times;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".exr")
      times[entry.path().filename()] = entry.last_write_time();
  }
  return times;
}

TEST_F(ChartEndToEnd, ResumeDoesNothingTwice) {
  fs::copy(path("chart"), path("resumed"), fs::copy_options::recursive);
  const auto before = times_of(path("resumed") / "runs");
  const Json first = chart();
  const fs::path taken =
      path("resumed") / "runs" / (first.at("rows").at(2).at("key").get<std::string>() + ".exr");
  fs::remove(taken);
  const ProgramResult result = run({"--quick", "--reference-spp", "64", "--resume"}, "resumed");
  ASSERT_EQ(result.status, 0) << result.error;
  EXPECT_TRUE(fs::exists(taken));
  for (const auto& [name, time] : times_of(path("resumed") / "runs")) {
    if (name == taken.filename()) continue;
    EXPECT_EQ(time, before.at(name)) << name << " was rendered again";
  }
  const Json second = chart("resumed");
  for (std::size_t k = 0; k < first.at("rows").size(); ++k) {
    const Json& a = first.at("rows").at(k);
    const Json& b = second.at("rows").at(k);
    EXPECT_EQ(a.at("render_seconds") == b.at("render_seconds"), k != 2);
    EXPECT_EQ(a.at("key"), b.at("key"));
    EXPECT_EQ(a.at("error").at("full").at("relative_rmse"),
              b.at("error").at("full").at("relative_rmse"));
    EXPECT_EQ(a.at("precompute_seconds"), b.at("precompute_seconds"));
  }
}

// A volume that cannot be built: rows that need it say so, the others are as they were.
TEST_F(ChartEndToEnd, AFailingRunIsARow) {
  fs::copy(path("cache"), path("saved"), fs::copy_options::recursive);
  for (const auto& pack : fs::directory_iterator(path("cache") / "pack")) {
    if (fs::exists(pack.path() / "volume.vdb")) fs::remove_all(pack.path());
  }
  fs::remove_all(path("cache") / "voxelize");
  std::ofstream(path("cache") / "voxelize") << "no folder";
  const ProgramResult result = run({"--quick", "--reference-spp", "16"}, "failing");
  fs::remove_all(path("cache"));
  fs::rename(path("saved"), path("cache"));
  ASSERT_EQ(result.status, 0) << result.error;
  EXPECT_NE(result.error.find("volume, 1 spp: failed"), std::string::npos) << result.error;
  const Json json = chart("failing");
  for (const Json& row : json.at("rows")) {
    const bool needs_volume = row.at("method").get<std::string>().starts_with("volume");
    EXPECT_EQ(row.at("status"), needs_volume ? "failed" : "done") << row;
    EXPECT_EQ(row.at("message").get<std::string>().find("voxelize") != std::string::npos,
              needs_volume)
        << row;
    EXPECT_EQ(row.at("error").at("full").is_null(), needs_volume);
  }
  EXPECT_EQ(json.at("rows").size(), chart().at("rows").size());
  EXPECT_EQ(schema_status(path("failing") / "chart.json"), 0);
  EXPECT_NE(text_of(path("failing") / "chart.svg").find("Runs that failed: 3."), std::string::npos);

  // What is wrong with the request itself makes no chart.
  EXPECT_EQ(run({"--reference-spp", "3"}, "refused").status, 2);
  EXPECT_EQ(run({"--crop", "0,0,99,9"}, "refused").status, 2);
  EXPECT_EQ(run({"--view", "none"}, "refused").status, 2);
}

TEST_F(ChartEndToEnd, ScriptOfThePageRunsInChromium) {
  // It stands alone: but for the name of SVG there is no address in it.
  const std::string html = text_of(path("chart") / "index.html");
  EXPECT_EQ(std::regex_replace(html, std::regex("http://www.w3.org/2000/svg"), "").find("http"),
            std::string::npos);
  EXPECT_NE(html.find("tiny &lt;swatch&gt;, &quot;quoted&quot;"), std::string::npos);
  EXPECT_EQ(html.find("tiny <swatch>"), std::string::npos);

  if (command_status("command -v chromium >/dev/null") != 0) {
    const std::string reason =
        "not run: no chromium on this machine (pipeline/install_packages.sh --tests installs it)";
    if (std::getenv("CI") != nullptr) FAIL() << reason;
    GTEST_SKIP() << reason;
  }
  const std::string command =
      "timeout 60 chromium --headless --no-sandbox --disable-gpu --user-data-dir=" +
      path("profile").string() + " --dump-dom file://" + (path("chart") / "index.html").string() +
      " > " + path("dom.html").string() + " 2>/dev/null";
  ASSERT_EQ(command_status(command), 0);
  const std::string dom = text_of(path("dom.html"));
  const auto count_of = [&dom](const std::string& pattern) {
    const std::regex expression(pattern);
    return std::distance(std::sregex_iterator(dom.begin(), dom.end(), expression),
                         std::sregex_iterator());
  };
  // Two references, two panels each.
  const auto rows = static_cast<std::ptrdiff_t>(chart().at("rows").size());
  EXPECT_EQ(count_of("<body data-points=\"" + std::to_string(4 * rows) + "\">"), 1);
  EXPECT_EQ(count_of("<tr data-row="), rows);
  EXPECT_EQ(
      count_of("<img id=\"(picture|reference|difference)\"[^>]* src=\"data:image/png;base64,"), 3);
}

}  // namespace
}  // namespace heddle
