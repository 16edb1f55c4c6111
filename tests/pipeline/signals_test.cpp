// SIGINT and SIGTERM: every command ends within a second, with its status, and says what is kept of
// its work; what it says is true.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "fibers/baked/fabric_pack.h"
#include "formats/image_file.h"
#include "pipeline/version.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Arguments = std::vector<std::string>;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A folder of inputs that keep any command busy for a while, and a warm cache of the small fabric.
class BusyWorkshop {
 public:
  BusyWorkshop() {
    const std::string small = edited(kSmallFabric, "fibers_per_ply = 24", "fibers_per_ply = 12");
    write("fabric.toml", small);
    write("scene.toml", kSmallScene);
    // Two million segments; twenty million; a chunk of transfer that takes hours.
    write("many.toml", edited(edited(edited(small, "repeats_x = 1", "repeats_x = 24"),
                                     "repeats_y = 1", "repeats_y = 24"),
                              "fibers_per_ply = 12", "fibers_per_ply = 96"));
    write("huge.toml",
          edited(text_of(*this / "many.toml"), "fibers_per_ply = 96", "fibers_per_ply = 960"));
    write("slow.toml", edited(small, "_paths = 4096", "_paths = 100000000"));
    write("large.toml", edited(kSmallScene, "[24, 24]", "[2048, 2048]"));
    write("slow-scene.toml", edited(kSmallScene, "spp = 4", "spp = 10000000"));
  }
  fs::path operator/(const std::string& name) const { return folder_.path() / name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(*this / name) << text;
  }

  /// Runs in the folder, so that relative names do.
  Program start(const Arguments& arguments, const std::function<void()>& prepare = {}) const {
    return Program(folder_.path(), arguments, "", [&] {
      if (::chdir(folder_.path().c_str()) != 0) ::_exit(125);
      ::setenv("HEDDLE_CACHE", "cache", 1);
      if (prepare) prepare();
    });
  }
  /// The report of a job that must succeed.
  Json report(Arguments arguments) const {
    arguments.emplace_back("--json");
    const ProgramResult result = start(arguments).wait();
    EXPECT_EQ(result.status, 0) << arguments.front() << ": " << result.error;
    return result.status == 0 ? Json::parse(result.out) : Json{{"stages", Json::array()}};
  }

 private:
  TemporaryFolder folder_;
};

/// The line about the interruption; how long the program took to end after the signal.
struct Ending {
  std::string message;
  double seconds = 0;
};

std::function<bool()> after(double seconds) {
  return [seconds, start = Clock::now()] { return seconds_since(start) >= seconds; };
}

/// So long after the program has started to answer signals.
std::function<bool()> into(const Program& program, double seconds) {
  return [&program, seconds, start = std::optional<Clock::time_point>()]() mutable {
    if (!start && program.answers_signals()) start = Clock::now();
    return start && seconds_since(*start) >= seconds;
  };
}

/// Sends the signal once `condition` holds; the program must then end as it should.
Ending interrupt(Program& program, int signal_number, const std::function<bool()>& condition) {
  Ending ending;
  const auto too_late = after(120);
  if (!program.signal_when([&] { return condition() || too_late(); }, signal_number)) {
    ADD_FAILURE() << "ended before the signal: " << program.wait().error;
    return ending;
  }
  const Clock::time_point sent = Clock::now();
  const ProgramResult result = program.wait();
  ending.seconds = seconds_since(sent);
  EXPECT_EQ(result.status, 128 + signal_number) << result.error;
  EXPECT_LE(ending.seconds, 1.0);
  const std::size_t at = result.error.find("heddle: interrupted; ");
  EXPECT_NE(at, std::string::npos) << result.error;
  if (at != std::string::npos)
    ending.message = result.error.substr(at, result.error.find('\n', at) - at);
  return ending;
}

void leave_standard_input_open() {
  int ends[2];
  if (::pipe(ends) != 0 || ::dup2(ends[0], STDIN_FILENO) < 0) ::_exit(124);
}

/// A pack of nothing but the fibers of many.toml, and two large pictures.
void make_large_files(const BusyWorkshop& shop) {
  const Json report = shop.report({"synth", "many.toml"});
  fs::create_directories(shop / "many.pack");
  fs::copy_file(shop / report.at("artifacts").at(0).get<std::string>(),
                shop / "many.pack" / "fibers.safetensors");
  const Exemplar exemplar = read_exemplar(shop / "many.pack" / "fibers.safetensors");
  PackManifest manifest;
  manifest.name = "many";
  manifest.program_version = kProgramVersion;
  manifest.counts = {{"fibers", exemplar.fiber_count()}, {"segments", exemplar.segment_count()}};
  manifest.files["fibers.safetensors"] = {};
  write_manifest(shop / "many.pack", std::move(manifest));

  Image image;
  image.width = image.height = 4096;
  const std::vector<float> grey(
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height), 0.5F);
  for (const char* channel : {"R", "G", "B"})
    image.channels[channel] = {ChannelType::kHalf, grey, {}};
  write_exr(shop / "grey.exr", image);
}

TEST(SignalsEndToEnd, EveryCommandEndsWithinASecondAndSaysWhatIsKept) {
  const BusyWorkshop shop;
  shop.report({"precompute", "fabric.toml"});
  make_large_files(shop);
  struct Case {
    Arguments arguments;
    std::string kept;
    std::function<void()> prepare = {};
  };
  const std::string stages = "finished stages and chunks are kept in the cache";
  const std::vector<Case> cases = {
      {{"synth", "huge.toml"}, stages},
      {{"visibility", "many.toml"}, stages},
      {{"transfer", "slow.toml"}, stages},
      {{"pack", "slow.toml"}, stages},
      {{"precompute", "slow.toml"}, stages},
      {{"accuracy", "fabric.toml"}, "the measurement is lost"},
      {{"run", "slow-scene.toml"}, "a picture that was being rendered is lost"},
      {{"render", "scene.toml", "-o", "exact.exr", "--spp", "1000000"}, "the picture is lost"},
      {{"render", "scene.toml", "-o", "path.exr", "--method", "path", "--spp", "1000000"},
       "the picture is lost"},
      {{"chart", "scene.toml", "-o", "chart", "--reference-spp", "1000000"},
       "with --resume goes on from them"},
      {{"plan", "large.toml", "--tolerance", "0.02"}, "the measurement is lost"},
      {{"eval"}, "the answers printed so far are complete", leave_standard_input_open},
      {{"info", "many.toml"}, "nothing was written"},
      {{"check", "many.pack"}, "nothing was written"},
      {{"compare", "grey.exr", "grey.exr"}, "nothing was written"},
  };
  for (const Case& one : cases) {
    for (const auto& [signal_number, moment] : {std::pair{SIGINT, 0.3}, std::pair{SIGTERM, 0.0}}) {
      SCOPED_TRACE(one.arguments.front() + " " + one.arguments.back() + " after " +
                   std::to_string(moment) + " s");
      Program program = shop.start(one.arguments, one.prepare);
      const Ending ending = interrupt(program, signal_number, into(program, moment));
      EXPECT_NE(ending.message.find(one.kept), std::string::npos) << ending.message;
    }
  }
  for (const char* name : {"exact.exr", "path.exr"}) EXPECT_FALSE(fs::exists(shop / name)) << name;
  for (const auto& entry : fs::recursive_directory_iterator(shop / "")) {
    EXPECT_NE(entry.path().extension(), ".tmp") << entry.path() << " was left behind";
  }
}

TEST(SignalsEndToEnd, ASecondSignalEndsAtOnce) {
  const BusyWorkshop shop;
  Program program = shop.start({"eval"}, leave_standard_input_open);
  ASSERT_TRUE(program.signal_when(into(program, 0), SIGTERM));
  EXPECT_LE(interrupt(program, SIGTERM, after(0.05)).seconds, 0.3);
}

// As under nohup, or in the background of a shell.
TEST(SignalsEndToEnd, ASignalIgnoredOnStartStaysIgnored) {
  const BusyWorkshop shop;
  Program program = shop.start({"eval"}, [] {
    leave_standard_input_open();
    ::signal(SIGINT, SIG_IGN);
  });
  ASSERT_TRUE(program.signal_when(into(program, 0), SIGINT));
  interrupt(program, SIGTERM, after(1.0));
}

TEST(SignalsEndToEnd, StandardErrorThatNobodyReadsHoldsNothingUp) {
  const BusyWorkshop shop;
  const auto closed_pipe = [] {
    leave_standard_input_open();
    int ends[2];
    if (::pipe(ends) != 0 || ::dup2(ends[1], STDERR_FILENO) < 0) ::_exit(124);
    ::close(ends[0]);
  };
  const auto full_pipe = [] {
    leave_standard_input_open();
    int ends[2];
    if (::pipe2(ends, O_NONBLOCK) != 0) ::_exit(124);
    while (::write(ends[1], "full", 4) > 0) {
    }
    ::fcntl(ends[1], F_SETFL, 0);
    if (::dup2(ends[1], STDERR_FILENO) < 0) ::_exit(124);
  };
  for (const std::function<void()>& prepare :
       {std::function<void()>(closed_pipe), std::function<void()>(full_pipe)}) {
    Program program = shop.start({"eval"}, prepare);
    ASSERT_TRUE(program.signal_when(into(program, 0), SIGTERM));
    const Clock::time_point sent = Clock::now();
    EXPECT_EQ(program.wait().status, 143);
    EXPECT_LE(seconds_since(sent), 1.0);
  }
}

/// Files with this extension at any depth, temporary ones left out.
std::vector<fs::path> files_in(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const bool is_hidden = entry->path().filename().string().starts_with(".");
    if (!is_hidden && entry->path().extension() == extension) files.push_back(entry->path());
  }
  return files;
}

std::function<bool()> once_there_is(const fs::path& folder, const std::string& extension) {
  return [folder, extension] { return !files_in(folder, extension).empty(); };
}

/// Which stages a job built, the picture's own left out.
std::vector<std::string> stages_built(const Json& report) {
  std::vector<std::string> built;
  for (const Json& stage : report.at("stages")) {
    if (stage.at("built").get<bool>()) built.push_back(stage.at("stage").get<std::string>());
  }
  return built;
}

TEST(SignalsEndToEnd, StagesGoOnFromFinishedChunks) {
  const BusyWorkshop shop;
  // Several chunks of transfer, each of which takes longer than it takes to notice the first.
  shop.write("chunks.toml", edited(kSmallFabric, "_paths = 4096", "_paths = 16384"));
  Program program = shop.start({"precompute", "chunks.toml"});
  interrupt(program, SIGINT, once_there_is(shop / "cache" / "transfer", ".safetensors"));
  const Json report = shop.report({"precompute", "chunks.toml"});
  std::uint64_t chunks_found = 0;
  for (const Json& stage : report.at("stages")) {
    chunks_found += stage.at("chunks_found").get<std::uint64_t>();
    if (stage.at("stage") == "synth") {
      EXPECT_FALSE(stage.at("built").get<bool>());
    }
  }
  EXPECT_GE(chunks_found, 1U);
}

TEST(SignalsEndToEnd, RenderKeepsTheDataOfItsFabricsAndNothingOfThePicture) {
  const BusyWorkshop shop;
  Program program = shop.start({"render", "scene.toml", "-o", "out.exr", "--spp", "1000000"});
  interrupt(program, SIGINT, once_there_is(shop / "cache" / "pack", ".json"));
  for (const char* extension : {".exr", ".png"})
    EXPECT_EQ(files_in(shop / "", extension), std::vector<fs::path>{});
  EXPECT_EQ(stages_built(shop.report({"render", "scene.toml", "-o", "out.exr"})),
            std::vector<std::string>{});
  EXPECT_TRUE(fs::exists(shop / "out.exr"));
}

TEST(SignalsEndToEnd, RunKeepsFinishedPictures) {
  const BusyWorkshop shop;
  shop.write("scene.toml", edited(kSmallScene, "spp = 4", "spp = 2000"));
  Program program = shop.start({"run", "scene.toml"});
  interrupt(program, SIGTERM, once_there_is(shop / "cache" / "picture", ".exr"));
  const std::vector<std::string> built = stages_built(shop.report({"run", "scene.toml"}));
  EXPECT_EQ(std::count(built.begin(), built.end(), "scene"), 0);
  EXPECT_EQ(std::count(built.begin(), built.end(), "scene-reference"), 1);
}

TEST(SignalsEndToEnd, ChartGoesOnFromFinishedPictures) {
  const BusyWorkshop shop;
  Arguments chart = {"chart", "scene.toml",      "-o", "chart", "--quick", "--methods",
                     "path",  "--reference-spp", "200"};
  Program program = shop.start(chart);
  interrupt(program, SIGINT, once_there_is(shop / "chart" / "runs", ".json"));
  std::map<fs::path, fs::file_time_type> kept;
  for (const fs::path& record : files_in(shop / "chart" / "runs", ".json"))
    kept[record] = fs::last_write_time(record);
  EXPECT_EQ(kept.size(), 1U) << "the first reference alone";
  chart.emplace_back("--resume");
  shop.report(chart);
  for (const auto& [record, time] : kept)
    EXPECT_EQ(fs::last_write_time(record), time) << "rendered again";
  EXPECT_GT(files_in(shop / "chart" / "runs", ".json").size(), kept.size());
}

TEST(SignalsEndToEnd, AccuracyKeepsStagesAndNothingOfTheMeasurement) {
  const BusyWorkshop shop;
  Program program = shop.start({"accuracy", "fabric.toml"});
  interrupt(program, SIGINT, once_there_is(shop / "cache" / "pack", ".json"));
  EXPECT_EQ(files_in(shop / "cache" / "accuracy", ".json"), std::vector<fs::path>{});
  EXPECT_EQ(stages_built(shop.report({"precompute", "fabric.toml"})), std::vector<std::string>{});
}

}  // namespace
}  // namespace heddle
