// The built program as a user runs it: same bytes whatever the threads, the cache, the shards and
// the kills; what it says of broken input, and with which exit status.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <sstream>

#include "formats/image_file.h"
#include "formats/tensor_file.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/artifact_record.h"
#include "pipeline/picture_request.h"
#include "pipeline/scene_job.h"
#include "pipeline/stages.h"
#include "pipeline/work_time.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Arguments = std::vector<std::string>;

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = text_of(entry.path());
  }
  return files;
}

/// Names of differing files, so that a failure does not print megabytes.
std::vector<std::string> differences(const fs::path& a, const fs::path& b) {
  const auto left = files_of(a);
  const auto right = files_of(b);
  std::vector<std::string> names;
  for (const auto& [name, bytes] : left) {
    const auto other = right.find(name);
    if (other == right.end() || other->second != bytes) names.push_back(name);
  }
  for (const auto& [name, bytes] : right) {
    if (!left.contains(name)) names.push_back(name);
  }
  return names;
}

bool any_chunk_in(const fs::path& stage_folder) {
  std::error_code error;
  for (fs::recursive_directory_iterator entry(stage_folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".safetensors" &&
        entry->path().parent_path().extension() == ".partial" &&
        entry->path().filename().string().find("tmp") == std::string::npos) {
      return true;
    }
  }
  return false;
}

/// A folder with the small fabric and its scene, in which the program is run with a cache of its
/// own.
class Workshop {
 public:
  Workshop() {
    std::ofstream(folder_.path() / "fabric.toml") << kSmallFabric;
    std::ofstream(folder_.path() / "scene.toml") << kSmallScene;
  }
  fs::path operator/(const std::string& name) const { return folder_.path() / name; }

  /// Arguments with their file names (those that hold a dot, or "pack") made absolute.
  Arguments absolute(Arguments arguments) const {
    for (std::size_t k = 1; k < arguments.size(); ++k) {
      if (arguments[k] == "pack" || arguments[k].find('.') != std::string::npos)
        arguments[k] = *this / arguments[k];
    }
    return arguments;
  }
  Program start(const Arguments& arguments, const std::string& input = "") const {
    ::setenv("HEDDLE_CACHE", (*this / "cache").c_str(), 1);
    return Program(folder_.path(), absolute(arguments), input);
  }
  ProgramResult run(const Arguments& arguments, const std::string& input = "") const {
    return start(arguments, input).wait();
  }
  /// The report of a job that must succeed.
  Json report(Arguments arguments) const {
    arguments.push_back("--json");
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.status, 0) << result.error;
    return result.status == 0 ? Json::parse(result.out) : Json{{"stages", Json::array()}};
  }

 private:
  TemporaryFolder folder_;
};

const Arguments kPrecompute = {"precompute", "fabric.toml", "-o", "pack"};

/// Kills the job once a chunk of `stage` is on disk, and runs it again.
void expect_same_bytes_after_kill(const fs::path& reference, const std::string& stage,
                                  std::uint64_t chunks_of_stage) {
  SCOPED_TRACE("killed during " + stage);
  const Workshop shop;
  const fs::path chunks = shop / "cache" / stage;
  Program program = shop.start(kPrecompute);
  ASSERT_TRUE(program.signal_when([&] { return any_chunk_in(chunks); }, SIGKILL))
      << program.wait().error;
  ASSERT_EQ(program.wait().status, -SIGKILL);
  ASSERT_TRUE(any_chunk_in(chunks)) << "the stage was over before it was killed";

  // What a clean resume says beside its report: nothing.
  Arguments quietly = kPrecompute;
  quietly.insert(quietly.end(), {"--quiet", "--json"});
  const ProgramResult resumed = shop.run(quietly);
  ASSERT_EQ(resumed.status, 0) << resumed.error;
  EXPECT_EQ(resumed.error, "");
  std::uint64_t found = 0;
  std::uint64_t built = 0;
  const Json report = Json::parse(resumed.out);
  for (const Json& entry : report.at("stages")) {
    if (entry.at("stage") != stage) continue;
    found = entry.at("chunks_found").get<std::uint64_t>();
    built = entry.at("chunks_built").get<std::uint64_t>();
  }
  EXPECT_GE(found, 1U);
  EXPECT_EQ(found + built, chunks_of_stage) << "each chunk once";
  EXPECT_EQ(differences(reference, shop / "pack"), std::vector<std::string>{});
  EXPECT_FALSE(any_chunk_in(chunks)) << "chunks are removed once the artifact is published";
}

TEST(StagesEndToEnd, SameBytesHoweverTheJobIsRun) {
  const Workshop shop;
  const fs::path reference = shop / "pack";
  const Json cold = shop.report({"precompute", "fabric.toml", "-o", "pack", "--threads", "2"});
  EXPECT_GE(cold.at("stages").size(), 6U);
  for (const Json& stage : cold.at("stages"))
    EXPECT_TRUE(stage.at("built").get<bool>()) << stage.dump();
  {
    SCOPED_TRACE("warm cache");
    const Json warm = shop.report({"precompute", "fabric.toml"});
    EXPECT_EQ(warm.at("stages").size(), 2U)
        << "the fibers and the pack; what the pack holds is not asked for";
    for (const Json& stage : warm.at("stages"))
      EXPECT_FALSE(stage.at("built").get<bool>()) << stage.dump();
  }
  {
    SCOPED_TRACE("another dye keeps the visibility");
    const std::string color = "[0.2, 0.3, 0.4]";
    std::string dyed = kSmallFabric;
    std::ofstream(shop / "dyed.toml")
        << dyed.replace(dyed.find(color), color.size(), "[0.9, 0.1, 0.1]");
    const Json report = shop.report({"visibility", "dyed.toml"});
    for (const Json& stage : report.at("stages")) {
      EXPECT_EQ(stage.at("built").get<bool>(), stage.at("stage") == "synth") << stage.dump();
    }
  }
  {
    SCOPED_TRACE("one thread, two shards each");
    const Workshop other;
    for (const char* stage : {"visibility", "transfer"}) {
      for (const char* shard : {"1/2", "2/2"})
        other.report({stage, "fabric.toml", "--shard", shard, "-j", "1"});
    }
    const Json report = other.report({"precompute", "fabric.toml", "-o", "pack", "-j", "1"});
    for (const Json& stage : report.at("stages"))
      EXPECT_EQ(stage.at("chunks_built"), 0) << stage.dump();
    EXPECT_EQ(differences(reference, other / "pack"), std::vector<std::string>{});
  }
  for (const Json& entry : cold.at("stages")) {
    const auto stage = entry.at("stage").get<std::string>();
    if (stage == "maps" || stage == "transfer")
      expect_same_bytes_after_kill(reference, stage, entry.at("chunks_built").get<std::uint64_t>());
  }
}

TEST(StagesEndToEnd, SignalsEndWithTheirStatusAndKeepChunks) {
  const Workshop shop;
  for (const auto& [signal_number, status] : {std::pair{SIGINT, 130}, std::pair{SIGTERM, 143}}) {
    fs::remove_all(shop / "cache");
    Program program = shop.start({"visibility", "fabric.toml"});
    ASSERT_TRUE(
        program.signal_when([&] { return any_chunk_in(shop / "cache" / "maps"); }, signal_number));
    const ProgramResult result = program.wait();
    EXPECT_EQ(result.status, status) << result.error;
    EXPECT_NE(result.error.find("interrupted"), std::string::npos) << result.error;
    EXPECT_TRUE(any_chunk_in(shop / "cache" / "maps"));
  }
}

TEST(PackEndToEnd, DamagedPacksAreRefused) {
  const Workshop shop;
  shop.report(kPrecompute);
  EXPECT_EQ(shop.run({"check", "pack"}).status, 0);
  const Json info = shop.report({"info", "pack"});
  EXPECT_EQ(info.at("name"), "small");

  fs::rename(shop / "pack", shop / "sound");
  int refused = 0;
  for (const auto& [name, bytes] : files_of(shop / "sound")) {
    std::vector<std::pair<std::string, std::string>> damages = {
        {"empty", ""},
        {"cut in half", bytes.substr(0, bytes.size() / 2)},
        {"cut by a byte", bytes.substr(0, bytes.size() - 1)}};
    for (const double place : {0.0, 0.1, 0.37, 0.5, 0.81, 0.99}) {
      std::string flipped = bytes;
      flipped[static_cast<std::size_t>(place * static_cast<double>(bytes.size()))] ^= 0x10;
      damages.emplace_back("a bit flipped at " + std::to_string(place), flipped);
    }
    for (const auto& [damage, damaged] : damages) {
      fs::remove_all(shop / "pack");
      fs::copy(shop / "sound", shop / "pack");
      std::ofstream(shop / "pack" / name, std::ios::binary | std::ios::trunc) << damaged;
      const ProgramResult result = shop.run({"check", "pack"});
      // A manifest without its last line feed says the same.
      if (name == "manifest.json" && damage == "cut by a byte") continue;
      EXPECT_EQ(result.status, 1) << name << ": " << damage << ": " << result.error;
      EXPECT_NE(result.error.find(name), std::string::npos) << damage << ": " << result.error;
      ++refused;
    }
  }
  EXPECT_EQ(refused, 6 * 9 - 1);
}

TEST(PackEndToEnd, NumpyAloneOpensAPack) {
  const Workshop shop;
  ASSERT_EQ(shop.run({"synth", "fabric.toml"}).status, 0);
  // The snippet of fibers/README.md, as it stands there.
  const std::string readme = text_of(fs::path(HEDDLE_SOURCE_DIR) / "fibers/README.md");
  const std::string fence = "```python\n";
  const std::size_t begin = readme.find(fence);
  ASSERT_NE(begin, std::string::npos);
  const std::string snippet =
      readme.substr(begin + fence.size(), readme.find("```", begin + 3) - begin - fence.size());

  fs::create_directories(shop / "cotton.pack");
  for (const auto& [name, bytes] : files_of(shop / "cache" / "synth")) {
    std::ofstream(shop / "cotton.pack" / "fibers.safetensors", std::ios::binary) << bytes;
  }
  std::ofstream(shop / "snippet.py") << snippet
                                     << "print(tensors['points_mm'].shape[1], round(1000 * "
                                        "float(tensors['radius_mm'].min()), 3))\n";
  const std::string command =
      "cd '" + (shop / "").string() + "' && /usr/bin/python3 snippet.py > printed.txt 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << text_of(shop / "printed.txt");
  EXPECT_EQ(text_of(shop / "printed.txt").substr(0, 5), "3 10.") << text_of(shop / "printed.txt");
}

TEST(PicturesEndToEnd, SameBytesForOneAndTwoThreadsAndNothingTwice) {
  const Workshop shop;
  const Json first = shop.report({"run", "scene.toml", "-o", "pictures.2", "-j", "2"});
  EXPECT_GE(first.at("artifacts").size(), 3U) << "picture, reference, difference";
  const Json again = shop.report({"run", "scene.toml", "-o", "pictures.again"});
  for (const Json& stage : again.at("stages"))
    EXPECT_FALSE(stage.at("built").get<bool>()) << stage.dump();

  fs::remove_all(shop / "cache" / "picture");
  shop.report({"run", "scene.toml", "-o", "pictures.1", "-j", "1"});
  for (const auto& [name, bytes] : files_of(shop / "pictures.2")) {
    EXPECT_EQ(text_of(shop / "pictures.again" / name), bytes) << name;
    const bool has_timings =
        name.ends_with(".json") && name.find("difference") == std::string::npos;
    if (!has_timings) {
      EXPECT_EQ(text_of(shop / "pictures.1" / name), bytes) << name;
    }
  }

  // The other methods, a crop, and the exit statuses of compare.
  ASSERT_EQ(shop.run({"render", "scene.toml", "-o", "volume.exr", "--method", "volume"}).status, 0);
  ASSERT_EQ(shop.run({"render", "scene.toml", "-o", "exact.exr"}).status, 0);
  EXPECT_EQ(text_of(shop / "exact.exr"), text_of(shop / "pictures.2" / "scene.exr"));
  ASSERT_EQ(shop.run({"render", "scene.toml", "-o", "crop.exr", "--crop", "4,4,12,10", "--method",
                      "path", "--local"})
                .status,
            0);
  EXPECT_EQ(shop.run({"compare", "volume.exr", "exact.exr", "-o", "difference.exr"}).status, 0);
  EXPECT_EQ(shop.run({"compare", "volume.exr", "exact.exr", "--max-rmse", "0"}).status, 1);
  EXPECT_EQ(shop.run({"compare", "volume.exr", "crop.exr"}).status, 2);
  EXPECT_EQ(shop.run({"render", "scene.toml", "-o", "x.exr", "--local"}).status, 2);
  EXPECT_EQ(shop.run({"render", "scene.toml", "-o", "x.exr", "--crop", "0,0,25,24"}).status, 2);
}

TEST(PicturesEndToEnd, TheSeedOfAPictureLeavesItsFabricsAlone) {
  const Workshop shop;
  shop.report({"render", "scene.toml", "-o", "first.exr"});
  const Json other = shop.report({"render", "scene.toml", "-o", "other.exr", "--seed", "9"});
  for (const Json& stage : other.at("stages"))
    EXPECT_FALSE(stage.at("built").get<bool>()) << stage.dump();
  EXPECT_EQ(read_exr(shop / "other.exr").metadata.at("heddle.seed"), "9");
  const Json error = shop.report({"compare", "other.exr", "first.exr"});
  EXPECT_GT(error.at("relative_rmse"), 0.0);
  EXPECT_TRUE(error.at("shared_seed").is_null());

  // A fabric's own seed draws other fibers, and so another artifact.
  const Json fibers = shop.report({"synth", "fabric.toml"});
  const Json others = shop.report({"synth", "fabric.toml", "--seed", "9"});
  EXPECT_FALSE(fibers.at("stages").at(0).at("built").get<bool>());
  EXPECT_TRUE(others.at("stages").at(0).at("built").get<bool>());
  EXPECT_NE(fibers.at("artifacts").at(0), others.at("artifacts").at(0));
}

TEST(PicturesEndToEnd, CompareWarnsOfASharedSeed) {
  const Workshop shop;
  shop.report({"render", "scene.toml", "-o", "exact.exr"});
  shop.report({"render", "scene.toml", "-o", "volume.exr", "--method", "volume"});
  const ProgramResult shared = shop.run({"compare", "volume.exr", "exact.exr", "--json"});
  EXPECT_EQ(shared.status, 0);
  EXPECT_NE(shared.error.find("come from seed 1"), std::string::npos) << shared.error;
  // What two pictures differ by in the mean, they differ by in the root mean square.
  const Json error = Json::parse(shared.out);
  EXPECT_EQ(error.at("shared_seed"), "1");
  double mean_difference = 0;
  double mean = 0;
  for (int c = 0; c < 3; ++c) {
    mean_difference += error.at("mean_picture").at(c).get<double>() -
                       error.at("mean_reference").at(c).get<double>();
    mean += error.at("mean_reference").at(c).get<double>();
  }
  EXPECT_GE(error.at("relative_rmse").get<double>(), std::abs(mean_difference) / mean);
  const ProgramResult itself = shop.run({"compare", "exact.exr", "exact.exr"});
  EXPECT_EQ(itself.error, "") << "equal pictures are equal, whatever their seed";
}

/// The scene with two groups of lights and every layer. render: more keys of [render].
std::string layered_scene(const std::string& render = "") {
  return edited(edited(kSmallScene, "irradiance = [1, 1, 1]",
                       "irradiance = [1, 1, 1]\ngroup = \"fill\""),
                "[[cloth]]", "[[cloth]]\nname = \"swatch\"") +
         "layers = [\"lobes\", \"surface\", \"cryptomatte\"]\n" + render +
         "[png]\nexposure_stops = 0.5\ntransform = \"filmic\"\n";
}

/// Ids and shares of a matte's layers, as any program that knows Cryptomatte reads them.
std::map<std::uint32_t, double> decoded(const Image& image, const std::string& layer,
                                        std::size_t pixel) {
  std::map<std::uint32_t, double> shares;
  for (const char* rank : {"00", "01", "02"}) {
    for (const auto& [id, share] : {std::pair{".R", ".G"}, std::pair{".B", ".A"}}) {
      const ImageChannel& ids = image.channels.at(layer + rank + id);
      const ImageChannel& coverage = image.channels.at(layer + rank + share);
      EXPECT_EQ(ids.type, ChannelType::kFloat);
      if (coverage.values[pixel] == 0) continue;
      shares[std::bit_cast<std::uint32_t>(ids.values[pixel])] +=
          static_cast<double>(coverage.values[pixel]);
    }
  }
  return shares;
}

/// By the layer's name in the metadata.
std::map<std::string, std::uint32_t> manifest_of(const Image& image, const std::string& layer) {
  std::map<std::string, std::uint32_t> ids;
  for (const auto& [key, value] : image.metadata) {
    if (!key.starts_with("cryptomatte/") || !key.ends_with("/name") || value != layer) continue;
    const std::string prefix = key.substr(0, key.size() - 4);
    EXPECT_EQ(image.metadata.at(prefix + "hash"), "MurmurHash3_32");
    const Json manifest = Json::parse(image.metadata.at(prefix + "manifest"));
    for (const auto& [name, hex] : manifest.items())
      ids[name] = static_cast<std::uint32_t>(std::stoul(hex.get<std::string>(), nullptr, 16));
  }
  EXPECT_FALSE(ids.empty()) << layer;
  return ids;
}

void expect_sums_in_halves(const Image& image) {
  const auto half = [](float value) { return float_from_half(half_from_float(value)); };
  for (const char* color : {"R", "G", "B"}) {
    const auto of = [&](const std::string& layer) -> const std::vector<float>& {
      const ImageChannel& channel = image.channels.at(layer + color);
      EXPECT_EQ(channel.type, ChannelType::kHalf);
      return channel.values;
    };
    for (std::size_t k = 0; k < of("").size(); ++k) {
      const float background = of("background.")[k];
      ASSERT_EQ(half(background + of("C_rest.")[k] + of("C_fill.")[k]), of("")[k]);
      ASSERT_EQ(half(background + of("single.")[k] + of("multiple.")[k]), of("")[k]);
      ASSERT_EQ(half(of("reflected.")[k] + of("transmitted.")[k]), of("single.")[k]);
    }
  }
}

double mean_of(const Image& image, const std::string& channel) {
  const std::vector<float>& values = image.channels.at(channel).values;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(LayersEndToEnd, LightGroupsAddUpAndMattesDecode) {
  const Workshop shop;
  std::ofstream(shop / "layers.toml") << layered_scene("filter = \"gaussian\"\n");
  std::ofstream(shop / "plain.toml") << edited(layered_scene("filter = \"gaussian\"\n"),
                                               "layers = [\"lobes\", \"surface\", "
                                               "\"cryptomatte\"]\n",
                                               "");
  for (const char* method : {"exact", "volume", "path", "prt"}) {
    SCOPED_TRACE(method);
    const auto rendered = [&](const char* scene, const char* file, const char* threads) {
      shop.report({"render", scene, "-o", file, "--method", method, "--spp", "6", "-j", threads});
      return read_exr(shop / file);
    };
    const Image image = rendered("layers.toml", "a.exr", "1");
    rendered("layers.toml", "b.exr", "2");
    EXPECT_EQ(text_of(shop / "a.exr"), text_of(shop / "b.exr")) << "for 1 and 2 threads";
    EXPECT_EQ(text_of(shop / "a.png"), text_of(shop / "b.png"));
    expect_sums_in_halves(image);
    EXPECT_GT(mean_of(image, "C_fill.G"), 0.01);
    // Little under light from the viewer's side, most of which TT sends on.
    EXPECT_GT(mean_of(image, "transmitted.G"), 0);
    EXPECT_EQ(image.metadata.at("heddle.filter"), "gaussian 2 px");

    // Layers that nobody asks for do not change the others.
    const Image plain = rendered("plain.toml", "c.exr", "2");
    EXPECT_EQ(plain.channels.at("C_fill.R").values, image.channels.at("C_fill.R").values);
    EXPECT_FALSE(plain.channels.contains("N.X") || plain.channels.contains("transmitted.R"));

    const auto cloths = manifest_of(image, "CryptoCloth");
    const auto yarns = manifest_of(image, "CryptoYarn");
    const auto fibers = manifest_of(image, "CryptoFiber");
    ASSERT_EQ(cloths.size(), 1U);
    EXPECT_GT(yarns.size(), 2U);
    EXPECT_GT(fibers.size(), yarns.size());
    std::set<std::uint32_t> seen;
    for (std::size_t k = 0; k < image.channels.at("A").values.size(); ++k) {
      const double alpha = static_cast<double>(image.channels.at("A").values[k]);
      const auto of_cloth = decoded(image, "CryptoCloth", k);
      EXPECT_NEAR(alpha > 0 ? of_cloth.at(cloths.at("swatch")) : 0, alpha, 1e-3);
      double of_yarns = 0;
      for (const auto& [id, share] : decoded(image, "CryptoYarn", k)) {
        of_yarns += share;
        seen.insert(id);
      }
      EXPECT_NEAR(of_yarns, alpha, 1e-3) << "six samples see six yarns at most";
    }
    std::set<std::uint32_t> named;
    for (const auto& [name, id] : yarns) {
      EXPECT_TRUE(name.starts_with("swatch/warp") || name.starts_with("swatch/weft")) << name;
      named.insert(id);
    }
    EXPECT_EQ(seen, named);
  }
  const Json png = shop.report({"info", "a.png"});
  EXPECT_EQ(png.at("text.heddle.transform"), "filmic");
  EXPECT_EQ(png.at("text.heddle.exposure_stops"), "0.5");
  const Json info = shop.report({"info", "a.exr"});
  EXPECT_NE(info.at("channel.C_fill.R").get<std::string>().find("lights of this group"),
            std::string::npos);
  const ProgramResult refused =
      shop.run({"render", "layers.toml", "-o", "d.exr", "--method", "dual-scattering"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.error.find("does not tell lobes apart"), std::string::npos);
}

TEST(LayersEndToEnd, ALookNeedsNoNewPicture) {
  const Workshop shop;
  std::ofstream(shop / "a.toml") << layered_scene();
  shop.report({"run", "a.toml", "-o", "first.d"});
  std::ofstream(shop / "a.toml") << edited(layered_scene(), "filmic", "srgb");
  const Json again = shop.report({"run", "a.toml", "-o", "second.d"});
  for (const Json& stage : again.at("stages")) {
    if (stage.at("stage") == "picture") {
      EXPECT_FALSE(stage.at("built").get<bool>());
    }
  }
  EXPECT_EQ(text_of(shop / "first.d/a.exr"), text_of(shop / "second.d/a.exr"));
  EXPECT_NE(text_of(shop / "first.d/a.png"), text_of(shop / "second.d/a.png"));
  expect_sums_in_halves(read_exr(shop / "second.d/a.exr"));
}

TEST(InfoEndToEnd, ReadsWhatTheProgramReadsAndWrites) {
  const Workshop shop;
  shop.report({"render", "scene.toml", "-o", "picture.exr"});
  fs::copy_file(shop / "picture.exr", shop / "COPY.EXR");
  fs::copy_file(shop / "picture.png", shop / "COPY.PNG");
  fs::copy_file(shop / "scene.toml", shop / "COPY.TOML");
  std::ofstream(shop / "sky.hdr", std::ios::binary)
      << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"
      << std::string("\x80\x40\x20\x81\x80\x40\x20\x81", 8);
  fs::copy_file(shop / "sky.hdr", shop / "SKY.HDR");

  EXPECT_EQ(shop.report({"info", "COPY.EXR"}), shop.report({"info", "picture.exr"}));
  const Json screen = shop.report({"info", "COPY.PNG"});
  const Json picture = shop.report({"info", "picture.exr"});
  EXPECT_EQ(screen.at("resolution_px"), picture.at("resolution_px"));
  EXPECT_EQ(screen.at("channels"), 3);
  EXPECT_EQ(shop.report({"info", "COPY.TOML"}).at("kind"), "scene config");
  const Json sky = shop.report({"info", "SKY.HDR"});
  EXPECT_EQ(sky.at("resolution_px"), (Json{2, 1}));
  // 128 / 256 of 2^(129 - 128).
  EXPECT_NE(sky.at("channel.R").get<std::string>().find("mean 1 "), std::string::npos) << sky;
  const Json report = shop.report({"info", "picture.json"});
  EXPECT_EQ(report.at("kind"), "report of a picture");
  EXPECT_EQ(report.at("heddle.method"), "exact");
  for (const auto& entry : fs::directory_iterator(shop / "cache" / "synth")) {
    if (entry.path().extension() == ".json") {
      EXPECT_EQ(shop.report({"info", entry.path().string()}).at("kind"), "record of an artifact");
    }
  }
  std::ofstream(shop / "other.json") << "[1, 2]";
  EXPECT_EQ(shop.run({"info", "other.json"}).status, 1);
}

/// The small scene with a square of 3 mm below its cloth that a surface model draws.
std::string scene_with_surface(const Workshop& shop, const std::string& surface) {
  std::ofstream(shop / "square.obj")
      << "v -1.5 -1.5 -0.5\nv 1.5 -1.5 -0.5\nv 1.5 1.5 -0.5\nv -1.5 1.5 -0.5\n"
         "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  return "[[cloth]]\nmesh = \"square.obj\"\nmesh_unit = \"mm\"\nuv_size_mm = 3\nsurface = \"" +
         surface + "\"\n";
}

TEST(SurfacesEndToEnd, SurfaceBesideFibersInEveryMethod) {
  const Workshop shop;
  const std::string surface = scene_with_surface(shop, "linen-plain");
  // The fibers, 0.2 mm wide instead of 4, leave the surface open to the eye and to the lights.
  const auto scene = [&](const std::string& width) {
    std::string text = kSmallScene;
    return text.replace(text.find("[4, 4]"), 6, "[" + width + ", 4]") + surface;
  };
  std::ofstream(shop / "beside.toml") << scene("0.2");
  std::ofstream(shop / "over.toml") << scene("4");
  for (const char* method : {"exact", "volume", "path"}) {
    const auto render = [&](const std::string& name) {
      const ProgramResult result = shop.run(
          {"render", name + ".toml", "-o", name + ".exr", "--method", method, "--spp", "4"});
      EXPECT_EQ(result.status, 0) << method << ": " << result.error;
      return read_exr(shop / (name + ".exr"));
    };
    const Image beside = render("beside");
    const Image over = render("over");
    // Mean over three columns, beside the fibers (1) and on them (11).
    const auto blue = [](const Image& image, int column) {
      float sum = 0;
      for (int k = 0; k < 36; ++k)
        sum += image.channels.at("B")
                   .values[static_cast<std::size_t>((6 + k / 3) * 24 + column + k % 3)];
      return sum / 36;
    };
    EXPECT_GT(blue(beside, 1), 0.1F) << method << ": linen in the light";
    EXPECT_GT(blue(beside, 11), 0.01F) << method << ": fibers beside it";
    EXPECT_GT(blue(over, 11), 0.01F) << method << ": fibers over it";
    EXPECT_NE(blue(beside, 1), blue(over, 1)) << method << ": the surface is hidden";
    if (std::string(method) == "exact") {
      EXPECT_EQ(beside.channels.at("segment").ids[12 * 24 + 2], 0xffffffffU);
      EXPECT_NE(over.channels.at("segment").ids[12 * 24 + 2], 0xffffffffU);
      EXPECT_GT(beside.channels.at("Z").values[12 * 24 + 2], 0.5F);
    }
  }
}

TEST(SurfacesEndToEnd, SurfacesAloneNeedNoStagesAndAnEditedOneMakesANewPicture) {
  const Workshop shop;
  const std::string preset =
      text_of(fs::path(HEDDLE_SOURCE_DIR) / "configs/fabrics/linen-plain.toml");
  std::ofstream(shop / "own.toml") << preset;
  std::string scene = kSmallScene;
  const std::string fibers = "[[cloth]]\nflat_mm = [4, 4]\nfabric = \"fabric.toml\"\n";
  scene.replace(scene.find(fibers), fibers.size(), scene_with_surface(shop, "own.toml"));
  std::ofstream(shop / "alone.toml") << scene;

  const auto built = [&](const char* threads, const char* folder) {
    const Json report = shop.report({"run", "alone.toml", "-o", folder, "-j", threads});
    EXPECT_EQ(report.at("stages").size(), 2U) << "picture and reference: " << report.dump();
    return report.at("stages").at(0).at("built").get<bool>();
  };
  EXPECT_TRUE(built("2", "pictures.2"));
  EXPECT_FALSE(built("2", "pictures.again"));
  fs::remove_all(shop / "cache" / "picture");
  EXPECT_TRUE(built("1", "pictures.1"));
  for (const char* name : {"alone.exr", "alone-reference.exr"}) {
    EXPECT_EQ(text_of(shop / "pictures.1" / name), text_of(shop / "pictures.2" / name)) << name;
  }
  for (const auto& entry : fs::directory_iterator(shop / "cache"))
    EXPECT_EQ(entry.path().filename(), "picture");

  std::ofstream(shop / "own.toml") << "# comments change nothing\n" << preset;
  EXPECT_FALSE(built("2", "pictures.again"));
  std::ofstream(shop / "own.toml") << edited(preset, "kd = 0.3", "kd = 0.4");
  EXPECT_TRUE(built("2", "pictures.edited"));
  EXPECT_NE(text_of(shop / "pictures.edited" / "alone.exr"),
            text_of(shop / "pictures.2" / "alone.exr"));

  const Json info = shop.report({"info", "own.toml"});
  EXPECT_EQ(info.at("model"), "microcylinder");
  EXPECT_EQ(shop.report({"info", "alone.toml"}).at("fabrics").at(0), "own.toml");
}

// A strip of 1 mm hangs 1 mm over a square of 4 mm, light comes at 45 degrees: its shadow lies on x
// from -1.5 to -0.5.
TEST(SurfacesEndToEnd, StackedClothsShadowEachOther) {
  const Workshop shop;
  std::ofstream(shop / "strip.obj")
      << "v -0.5 -2 1\nv 0.5 -2 1\nv 0.5 2 1\nv -0.5 2 1\n"
         "vt -0.5 -2\nvt 0.5 -2\nvt 0.5 2\nvt -0.5 2\nf 1/1 2/2 3/3 4/4\n";
  const std::string start = R"(name = "stack"
[camera]
position_mm = [0, 0, 8]
look_at_mm = [0, 0, 0]
up = [0, 1, 0]
fov_deg = 30.75
fov_axis = "vertical"
resolution_px = [16, 16]
[[light]]
type = "directional"
direction = [1, 0, 1]
irradiance = [3, 3, 3]
[render]
spp = 16
)";
  const std::string strip = "[[cloth]]\nmesh = \"strip.obj\"\nmesh_unit = \"mm\"\nuv_size_mm = 1\n";
  const std::string square = "[[cloth]]\nflat_mm = [4, 4]\n";
  const std::string fibers = "fabric = \"fabric.toml\"\n";
  const std::string linen = "surface = \"linen-plain\"\n";
  const std::string interactive = linen + "surface_method = \"interactive\"\n";
  const std::map<std::string, std::string> scenes = {
      {"fibers-over-surface.toml", strip + fibers + square + linen},
      {"fibers-over-interactive.toml", strip + fibers + square + interactive},
      {"surface-over-fibers.toml", strip + linen + square + fibers},
      {"interactive-over-fibers.toml", strip + interactive + square + fibers},
      {"surface-over-surface.toml", strip + linen + square + interactive}};
  for (const auto& [name, cloths] : scenes) {
    std::ofstream(shop / name) << start + cloths;
    for (const char* method : {"exact", "volume", "path"}) {
      const ProgramResult result =
          shop.run({"render", name, "-o", "stack.exr", "--method", method});
      ASSERT_EQ(result.status, 0) << name << ": " << result.error;
      const Image image = read_exr(shop / "stack.exr");
      // Light scattered once, mean over two columns and four rows of the middle. (Multiple
      // scattering blurs the edge of a shadow.)
      const auto green = [&](int column) {
        float sum = 0;
        for (int row = 6; row < 10; ++row) {
          for (int c = column; c < column + 2; ++c)
            sum += image.channels.at("single.G").values[static_cast<std::size_t>(row * 16 + c)];
        }
        return sum / 8;
      };
      // 0.28 mm per pixel: columns from -1.4 to -0.8, and from 1.1 to 1.65; the strip covers 6
      // to 9.
      const float shadow = green(3);
      const float lit = green(12);
      const float top = green(7);
      EXPECT_GT(lit, 0.001F) << name << " " << method;
      EXPECT_GT(top, 0.002F) << name << " " << method << ": the strip itself";
      EXPECT_LT(shadow, 0.1F * lit) << name << " " << method;
      if (std::string(method) == "path") continue;
      // Every layer of a surface's pixels says something, or that there is nothing to say.
      const bool surface_below = name.find("over-fibers") == std::string::npos;
      const std::size_t pixel = 8 * 16 + 13;
      EXPECT_EQ(image.channels.at("segment").ids[pixel] == 0xffffffffU, surface_below) << name;
      EXPECT_EQ(image.channels.at("cell").ids[pixel] == 0xffffffffU, surface_below) << name;
      EXPECT_NEAR(image.channels.at("Z").values[pixel], 8, 0.3) << name;
      EXPECT_NEAR(image.channels.at("u").values[pixel], (13.5 - 8) * 0.275, 0.3) << name;
      EXPECT_GT(image.channels.at("A").values[pixel], surface_below ? 0.999 : 0.5) << name;
      const auto tangent = [&](const char* axis) {
        return image.channels.at(std::string("tangent.") + axis).values[pixel];
      };
      EXPECT_NEAR(std::hypot(tangent("X"), tangent("Y"), tangent("Z")), 1, 1e-4) << name;
      EXPECT_EQ(image.channels.at("multiple.G").values[pixel] == 0, surface_below) << name;
    }
  }
}

TEST(SurfacesEndToEnd, ThreadsLightsAndCamerasAreEditedWithoutPrecomputingAgain) {
  const Workshop shop;
  const std::string threads =
      text_of(fs::path(HEDDLE_SOURCE_DIR) / "configs/fabrics/linen-plain.toml");
  std::ofstream(shop / "own.toml") << threads;
  std::string scene = kSmallScene;
  scene.replace(scene.find("[4, 4]"), 6, "[0.2, 4]");
  scene += scene_with_surface(shop, "own.toml");
  std::ofstream(shop / "edited.toml") << scene + "surface_method = \"interactive\"\n";

  // Which of the surface's stages, and of the first picture, were built.
  const auto built = [&](const char* folder) {
    std::multiset<std::string> stages;
    const Json report = shop.report({"run", "edited.toml", "-o", folder});
    for (const Json& entry : report.at("stages")) {
      const auto stage = entry.at("stage").get<std::string>();
      if ((stage.starts_with("surface") || stage == "edited") && entry.at("built").get<bool>())
        stages.insert(stage);
    }
    return stages;
  };
  using Stages = std::multiset<std::string>;
  EXPECT_EQ(built("pictures.first"),
            (Stages{"surface-weights", "surface-maps", "surface-maps", "edited"}));
  EXPECT_EQ(built("pictures.again"), Stages{});

  std::string other = threads;
  for (const auto& [from, to] : {std::pair{"ior = 1.46", "ior = 1.6"},
                                 {"kd = 0.3", "kd = 0.5"},
                                 {"gamma_s_deg = 12", "gamma_s_deg = 9"},
                                 {"gamma_v_deg = 24", "gamma_v_deg = 40"},
                                 {"albedo = [0.06, 0.24, 0.3]", "albedo = [0.3, 0.2, 0.1]"}}) {
    other = edited(other, from, to);
  }
  std::ofstream(shop / "own.toml") << other;
  EXPECT_EQ(built("pictures.threads"), Stages{"edited"});
  EXPECT_NE(text_of(shop / "pictures.threads" / "edited.exr"),
            text_of(shop / "pictures.first" / "edited.exr"));

  scene = edited(edited(scene, "fov_deg = 25", "fov_deg = 30"), "sharpness = 15", "sharpness = 50");
  std::ofstream(shop / "edited.toml") << scene + "surface_method = \"interactive\"\n";
  EXPECT_EQ(built("pictures.lights"), Stages{"edited"});

  // A curve is another table; what stands over the cloth makes other maps.
  std::ofstream(shop / "own.toml")
      << edited(other, "offsets_deg = [-25, 25]", "offsets_deg = [-20, 20]");
  EXPECT_EQ(built("pictures.curves"), (Stages{"surface-weights", "edited"}));
  std::ofstream(shop / "edited.toml")
      << edited(scene, "[0.2, 4]", "[0.4, 4]") + "surface_method = \"interactive\"\n";
  EXPECT_EQ(built("pictures.shapes"), (Stages{"surface-maps", "surface-maps", "edited"}));

  // Sampled, nothing of it is asked for.
  fs::remove_all(shop / "cache" / "surface-maps");
  std::ofstream(shop / "edited.toml") << scene;
  EXPECT_EQ(built("pictures.sampled"), Stages{"edited"});
}

// docs/rivals.md says which part of each method is whose: parts of one author are alike to the
// last digit, and parts of two are not. All see the same cloth: no mean is a multiple of another's
// beyond what the methods are known to err by on this fabric (measured: printed -2 %, prt +46 %,
// tsai-shih-16 twice, tsai-shih-full +0.1 %, dual-scattering -56 % of exact).
TEST(RivalsEndToEnd, EveryMethodRendersTheScene) {
  const Workshop shop;
  const std::vector<std::string> methods = {
      "exact", "volume",       "path-6",         "printed",
      "prt",   "tsai-shih-16", "tsai-shih-full", "dual-scattering"};
  std::map<std::string, Image> pictures;
  for (const std::string& method : methods) {
    const std::string file = method + ".exr";
    const ProgramResult result = shop.run({"render", "scene.toml", "-o", file, "--method", method,
                                           "--crop", "8,8,14,14", "--spp", "2"});
    ASSERT_EQ(result.status, 0) << method << ": " << result.error;
    pictures[method] = read_exr(shop / file);
  }
  const auto values = [&](const std::string& method, const char* channel) {
    return pictures.at(method).channels.at(channel).values;
  };
  const auto mean = [&](const std::string& method, const char* channel) {
    double sum = 0;
    for (const float value : values(method, channel)) sum += static_cast<double>(value);
    return sum / static_cast<double>(values(method, channel).size());
  };
  for (const std::string& a : methods) {
    for (const std::string& b : methods) {
      if (a < b) {
        EXPECT_NE(values(a, "G"), values(b, "G")) << a << " and " << b;
      }
    }
  }
  for (const char* ours : {"prt", "tsai-shih-16", "tsai-shih-full"}) {
    EXPECT_EQ(values(ours, "multiple.G"), values("exact", "multiple.G")) << ours;
    EXPECT_NE(values(ours, "single.G"), values("exact", "single.G")) << ours;
  }
  EXPECT_NE(values("dual-scattering", "multiple.G"), values("exact", "multiple.G"));
  EXPECT_NE(values("printed", "multiple.G"), values("exact", "multiple.G"));
  const auto of_exact = [&](const char* method) { return mean(method, "G") / mean("exact", "G"); };
  EXPECT_NEAR(of_exact("volume"), 1, 0.15);
  EXPECT_NEAR(of_exact("tsai-shih-full"), 1, 0.02);
  EXPECT_NEAR(of_exact("printed"), 0.61, 0.15);
  EXPECT_NEAR(of_exact("prt"), 1.10, 0.3);
  EXPECT_NEAR(of_exact("tsai-shih-16"), 1.98, 0.4);
  EXPECT_NEAR(of_exact("dual-scattering"), 0.77, 0.15);
  // Six scattering events are what the path tracer's own limit says.
  ASSERT_EQ(shop.run({"render", "scene.toml", "-o", "limited.exr", "--method", "path", "--bounces",
                      "6", "--crop", "8,8,14,14", "--spp", "2"})
                .status,
            0);
  EXPECT_EQ(shop.run({"compare", "limited.exr", "path-6.exr", "--max-rmse", "0"}).status, 0);
  EXPECT_EQ(shop.run({"compare", "prt.exr", "tsai-shih-full.exr", "--max-rmse", "0"}).status, 1);
  EXPECT_EQ(
      shop.run({"render", "scene.toml", "-o", "x.exr", "--method", "path-6", "--bounces", "3"})
          .status,
      2);
}

struct BadInput {
  std::string name;
  Arguments arguments;
  std::string file;  // content of bad.toml
  int status;
  std::string message;  // part of what must be said
};

TEST(InputEndToEnd, BadInputIsNamed) {
  const Arguments synth = {"synth", "bad.toml"};
  const std::vector<BadInput> cases = {
      {"syntax", synth, edited(kSmallFabric, "name = \"small\"", "name = "), 2, "bad.toml:1:"},
      {"unknown key", synth, edited(kSmallFabric, "migration = 0", "migrtion = 0"), 2, "migr"},
      {"missing key", synth, edited(kSmallFabric, "radius_um = 10\n", ""), 2, "radius_um"},
      {"missing section", synth, edited(kSmallFabric, "[volume]\n", ""), 2, "volume"},
      {"wrong type", synth, edited(kSmallFabric, "plies = 1", "plies = \"one\""), 2, "plies"},
      {"wrong unit", synth, edited(kSmallFabric, "radius_um = 10", "radius_mm = 0.01"), 2,
       "radius_um"},
      {"out of range", synth, edited(kSmallFabric, "beta_r_deg = 5", "beta_r_deg = 500"), 2,
       "beta_r_deg"},
      {"NaN", synth, edited(kSmallFabric, "beta_r_deg = 5", "beta_r_deg = nan"), 2, "beta_r_deg"},
      {"bad notation", synth, edited(kSmallFabric, "\"plain\"", "\"plaid\""), 2, "bad.toml:6:"},
      {"unknown fiber", synth, edited(kSmallFabric, "fiber = \"thread\"", "fiber = \"wool\""), 2,
       "wool"},
      {"unknown surface",
       {"render", "bad.toml", "-o", "x.exr"},
       edited(kSmallScene, "fabric = \"fabric.toml\"", "surface = \"linen\""),
       2,
       "bad.toml:28:1: 'surface': expected a file that ends in .toml, or one of "},
      {"surface as fabric", {"synth", "bad.toml"}, "model = \"microcylinder\"\n", 2, "no fibers"},
      {"no such config", {"synth", "missing.toml"}, "", 2, "missing.toml"},
      {"no such pack", {"check", "missing.pack"}, "", 1, "missing.pack"},
      {"no such file", {"info", "missing.exr"}, "", 1, "missing.exr"},
      {"not comparable", {"compare", "missing.exr", "other.exr"}, "", 2, "missing.exr"},
      {"no subcommand", {"weave"}, "", 2, "weave"},
      {"unknown option", {"synth", "fabric.toml", "--colour"}, "", 2, "--colour"},
      {"bad option value", {"synth", "fabric.toml", "--threads", "0"}, "", 2, "--threads"},
      {"bad shard", {"visibility", "fabric.toml", "--shard", "3/2"}, "", 2, "--shard"},
      {"bad eval line", {"eval"}, "", 1, ""},
  };
  const Workshop shop;
  for (const BadInput& bad : cases) {
    SCOPED_TRACE(bad.name);
    std::ofstream(shop / "bad.toml") << bad.file;
    const ProgramResult result = shop.run(bad.arguments, "{\n");
    EXPECT_EQ(result.status, bad.status) << result.error;
    EXPECT_NE(result.error.find(bad.message), std::string::npos) << result.error;
  }
}

/// A table under which signed distances alone are as good as both forms of visibility, larger cells
/// too, and everything faster than paths; where the small fabric's own would lie. Makes plans
/// without measuring for half a minute.
void store_table(const Workshop& shop, double bias) {
  std::ostringstream silent;
  Console console(silent, false, true);
  StageContext context{.cache = Cache(shop / "cache"),
                       .console = &console,
                       .fabric_seed = {},
                       .picture_seed = {},
                       .results = {}};
  const fs::path path = FabricStages(shop / "fabric.toml", context).accuracy_place().path;
  AccuracyTable table;
  table.fabric = "small";
  table.key = "by hand";
  table.threads = working_threads();
  table.sharpness = {1, kDirectionalSharpness};
  table.footprint_mm = {0.01, 1};
  table.light_cosine = {0.5};
  table.bent_footprint_mm = 3;
  table.bent_light_cosine = 0.5;
  table.bent_between = {0.2, 0.2};
  table.bent_enclosure_square = 0.02;
  table.through = 0.5;
  const auto add = [&](const std::string& name, double bias_of_this, double noise, double seconds) {
    const Accuracy entry{bias_of_this * bias_of_this, 0, noise * noise, 0, Rgbd::Ones()};
    table.settings.push_back(
        {name, seconds, 1e-3, std::vector<Accuracy>(4, entry), std::vector<Accuracy>(2, entry)});
  };
  add("path", 0, 5, 1e-4);
  add("path-6", 1, 5, 1e-4);
  add("dual-scattering", 1, 5, 1e-4);
  for (const char* name : {"exact", "signed distance", "cells x 2", "order 1"})
    add(name, bias, 1, 1e-6);
  for (const char* name : {"volume", "voxels x 0.5", "Gaussians", "cells x 4"})
    add(name, 2, 1, 1e-6);
  // Enough that what data take decides between ways that are alike.
  for (const auto& [key, seconds] :
       std::map<CostKey, double>{{{"maps"}, 0.01},
                                 {{"ssdf"}, 0.01},
                                 {{"sg"}, 0.2},
                                 {{"transfer"}, 0.1},
                                 {{"transfer", "cells x 2"}, 0.02},
                                 {{"transfer", "cells x 4"}, 0.01},
                                 {{"transfer", "order 1"}, 0.1},
                                 {{"voxelize"}, 0.01},
                                 {{"voxelize", "voxels x 0.5"}, 0.01}}) {
    table.costs[key] = {seconds, seconds};
  }
  publish_artifact(path, fs::path(path).replace_extension(".record.json"),
                   [&](const fs::path& file) {
                     write_accuracy(file, table);
                     return BuildCost{};
                   });
}

Json plan_of(const Workshop& shop, const char* tolerance, int status) {
  const ProgramResult result = shop.run({"plan", "scene.toml", "--tolerance", tolerance, "--json"});
  EXPECT_EQ(result.status, status) << result.error;
  return Json::parse(result.out);
}

TEST(PlanEndToEnd, SaysWhatItWouldDoAndBuildsNothing) {
  const Workshop shop;
  store_table(shop, 0.2);
  const Json plan = plan_of(shop, "4e-1", 0);
  EXPECT_EQ(plan.at("format"), "heddle plan");
  EXPECT_EQ(plan.at("choice").at("name"), "exact, signed distance, cells x 2");
  EXPECT_GT(plan.at("choice").at("build_seconds"), 0);
  EXPECT_LE(plan.at("choice").at("expected_error"), 0.4);
  for (const char* stage : {"maps", "ssdf", "sg", "transfer", "voxelize"})
    EXPECT_FALSE(fs::exists(shop / "cache" / stage)) << stage;
  const ProgramResult text = shop.run({"plan", "scene.toml", "--tolerance", "4e-1"});
  EXPECT_NE(text.out.find("choice    exact, signed distance, cells x 2"), std::string::npos)
      << text.out;
  EXPECT_NE(text.out.find("light 2   sg, sharpness 15: visibility by signed distances"),
            std::string::npos)
      << text.out;
}

TEST(PlanEndToEnd, TracesPathsWhereNothingElseIsGoodEnough) {
  const Workshop shop;
  store_table(shop, 0.9);
  const Json plan = plan_of(shop, "4e-1", 0);
  EXPECT_EQ(plan.at("choice").at("method"), "path");
  EXPECT_GT(plan_of(shop, "2e-1", 0).at("choice").at("spp"), plan.at("choice").at("spp"));
}

TEST(PlanEndToEnd, AsksForNoTableWhereAFewPathsDo) {
  const Workshop shop;
  const Json plan = plan_of(shop, "5e-1", 0);
  EXPECT_EQ(plan.at("choice").at("method"), "path");
  EXPECT_NE(plan.at("note"), "");
  EXPECT_FALSE(fs::exists(shop / "cache" / "accuracy"));
}

/// What a plan thinks that a way errs by, apart from noise.
double bias_in(const Json& plan, const std::string& name) {
  for (const Json& way : plan.at("considered")) {
    if (way.at("name") == name) return way.at("bias").get<double>();
  }
  ADD_FAILURE() << "no way called " << name;
  return NAN;
}

TEST(PlanEndToEnd, LightFromOtherClothIsMissingFromFastMethods) {
  const Workshop shop;
  store_table(shop, 0.2);
  // A wall of the same cloth beside what the picture shows, lit from the front; then the same one
  // far away.
  const auto plan_with_wall_at = [&](double x) {
    std::ofstream obj(shop / "wall.obj");
    for (const auto& [y, z] : {std::pair{-2, 0}, {2, 0}, {2, 3}, {-2, 3}}) {
      obj << "v " << x << ' ' << y << ' ' << z << "\nvt " << y << ' ' << z << "\nvn 1 0 0\n";
    }
    obj << "f 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/4/4\n";
    obj.close();
    std::ofstream(shop / "scene.toml")
        << kSmallScene
        << "\n[[cloth]]\nmesh = \"wall.obj\"\nmesh_unit = \"mm\"\nuv_size_mm = 1\n"
           "fabric = \"fabric.toml\"\n";
    return plan_of(shop, "4e-1", 0);
  };
  const Json near = plan_with_wall_at(-0.4);
  const Json far = plan_with_wall_at(-400);
  EXPECT_GT(bias_in(near, "exact"), 1.1 * bias_in(far, "exact"));
  EXPECT_GT(bias_in(near, "volume"), bias_in(far, "volume"));
  EXPECT_EQ(bias_in(near, "path"), 0) << "traces light from everywhere";
}

TEST(PlanEndToEnd, LightFromBehindIsMissingFromPrecomputedMethods) {
  const Workshop shop;
  store_table(shop, 0.2);
  const auto plan_lit = [&](bool from_behind) {
    std::string scene = kSmallScene;
    if (from_behind) scene.replace(scene.find("[-0.5, 0.4, 1]"), 14, "[-0.5, 0.4, -1]");
    std::ofstream(shop / "scene.toml") << scene;
    return plan_of(shop, "4e-1", 0);
  };
  const Json front = plan_lit(false);
  const Json behind = plan_lit(true);
  // Errors of two lights are taken as half together and half apart.
  EXPECT_GT(bias_in(front, "exact"), 0.2 * std::sqrt(0.5));
  EXPECT_LT(bias_in(front, "exact"), 0.2 + 1e-6);
  // Through the cloth comes 0.5 of 1 x 1 / |axis|, beside all of 3 x 1 / |direction| on the face:
  // that share of the light is missing, everywhere alike.
  const double through = 0.5 * 1 / std::sqrt(1.41);
  const double missing = through / (through + 3 / std::sqrt(1.13));
  EXPECT_GT(bias_in(behind, "exact"), std::hypot(0.95 * 0.2, missing))
      << "nearly all light that is not missing is of one light";
  // A few pixels see between the fibers; the picture's mean is so much lower than the cloth's.
  const double gaps = 1.02;
  EXPECT_LT(bias_in(behind, "exact"), gaps * std::hypot(0.2, missing));
  EXPECT_EQ(bias_in(behind, "path"), 0) << "traces light from everywhere";
}

TEST(PlanEndToEnd, SaysWhatIsOutOfReach) {
  const Workshop shop;
  store_table(shop, 0.2);
  const Json plan = plan_of(shop, "1e-5", 1);
  EXPECT_TRUE(plan.at("choice").is_null());
  EXPECT_GT(plan.at("best_tolerance"), 0.00001);
  const ProgramResult result =
      shop.run({"render", "scene.toml", "-o", "out.exr", "--tolerance", "1e-5"});
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.error.find("no way meets this tolerance"), std::string::npos) << result.error;
  EXPECT_FALSE(fs::exists(shop / "out.exr"));
  EXPECT_EQ(shop.run({"render", "scene.toml", "-o", "out.exr", "--tolerance", "4e-1", "--spp", "4"})
                .status,
            2);
}

TEST(RenderEndToEnd, WithinTheToleranceFromWhatWasPlanned) {
  const Workshop shop;
  store_table(shop, 0.75);
  // Large enough that rendering, not setting up, is what pictures cost.
  std::string scene = kSmallScene;
  scene.replace(scene.find("[24, 24]"), 8, "[96, 96]");
  std::ofstream(shop / "scene.toml") << scene;
  // Of many pictures, so that no other work on the machine makes paths the cheaper way.
  const Json report = shop.report(
      {"render", "scene.toml", "-o", "out.exr", "--tolerance", "12e-1", "--pictures", "100"});
  ASSERT_TRUE(report.contains("plan"));
  std::set<std::string> built;
  for (const Json& stage : report.at("stages")) {
    if (stage.at("built")) built.insert(stage.at("stage").get<std::string>());
  }
  if (report.at("plan").at("choice").at("method") != "path") {
    // What the choice needs, and nothing else: no volume, sums of Gaussians only for a light that
    // takes them.
    std::set<std::string> needed = {"maps", "ssdf", "transfer", "pack"};
    for (const Json& light : report.at("plan").at("choice").at("lights")) {
      if (light.at("visibility") != "signed distances") needed.insert("sg");
    }
    EXPECT_EQ(built, needed);
  } else {
    ADD_FAILURE() << "the table says that paths are dear: " << report.at("plan").dump(1);
  }
  ASSERT_EQ(shop.run({"render", "scene.toml", "-o", "reference.exr", "--method", "path", "--spp",
                      "32", "--seed", "77"})
                .status,
            0);
  const Json error = shop.report({"compare", "out.exr", "reference.exr"});
  EXPECT_LE(error.at("relative_rmse"), 1.2);
  EXPECT_LE(report.at("expected_error"), 1.2);
}

TEST(RenderEndToEnd, MoreSamplesMakeThePictureOfAll) {
  const Workshop shop;
  std::ostringstream silent;
  Console console(silent, false, true);
  StageContext context{.cache = Cache(shop / "cache"),
                       .console = &console,
                       .fabric_seed = {},
                       .picture_seed = {},
                       .results = {}};
  SceneJob job(shop / "scene.toml", context);
  for (const RenderMethod method : {RenderMethod::kPath, RenderMethod::kExact}) {
    PictureRequest request = job.request(find_view(job.config(), ""));
    request.method = method;
    request.spp = 10;
    const PictureResult whole = job.render(request, "whole");
    request.spp = 4;
    request.more = [](const FrameBuffers& frame) { return std::vector{frame.spp < 10 ? 2 : 0}; };
    const PictureResult grown = job.render(request, "grown");
    EXPECT_EQ(grown.image.metadata, whole.image.metadata) << "its key among them";
    write_exr(shop / "whole.exr", whole.image);
    write_exr(shop / "grown.exr", grown.image);
    EXPECT_EQ(text_of(shop / "grown.exr"), text_of(shop / "whole.exr"));
  }
}

TEST(RunEndToEnd, ReferenceHasRandomNumbersOfItsOwn) {
  const Workshop shop;
  shop.report({"run", "scene.toml", "-o", "out.d"});
  const auto seed_of = [&](const char* name) {
    return read_exr(shop / (std::string("out.d/") + name)).metadata.at("heddle.seed");
  };
  EXPECT_NE(seed_of("scene.exr"), seed_of("scene-reference.exr"));
}

}  // namespace
}  // namespace heddle
