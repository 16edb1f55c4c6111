// Reads every #include of the tree and holds it against the arrows of docs/architecture.md.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;  // that includes, from the root of the tree
  std::string target;
  bool quoted;
};

const fs::path kSources = HEDDLE_SOURCE_DIR;

/// What a module may include besides itself.
const std::map<std::string, std::set<std::string>> kArrows = {
    {"formats", {}},
    {"fibers/math", {}},
    {"fibers", {"formats", "fibers/math"}},
    {"precompute", {"formats", "fibers/math", "fibers"}},
    {"render", {"formats", "fibers/math", "fibers"}},
    {"pipeline", {"formats", "fibers/math", "fibers", "precompute", "render"}},
};

/// Within the pipeline: files (regular expression) and what they must not include.
const std::vector<std::pair<std::string, std::string>> kNotWithinPipeline = {
    {R"(pipeline/accuracy/.*)", R"(pipeline/(plan/.*|stages\.h|surface_stages\.h|scene_job\.h))"},
    {R"(pipeline/(stages|surface_stages|scene_job)\..*)", R"(pipeline/plan/.*)"},
};

/// Third-party headers and the files (regular expression) that may include them.
const std::vector<std::pair<std::string, std::string>> kConfined = {
    {R"(embree3?/.*)", R"((fibers|render)/.*\.cpp)"},
    {R"(opensubdiv/.*)", R"(render/limit_surface\.cpp)"},
    {R"(openvdb/.*)", R"(formats/id_volume_file\.cpp)"},
    {R"((OpenEXR/|Imath/|Imf|Imath|Iex|half\.h).*)", R"(formats/image_file\.cpp)"},
    {R"(png\.h)", R"(formats/image_file\.cpp)"},
    {R"((oneapi/)?tbb/.*)", R"(.*\.cpp)"},
    {R"(toml\+\+.*)", R"(formats/toml_table\.cpp)"},
    {R"(xxhash\.h)", R"(formats/content_hash\.cpp)"},
    {R"(CLI/.*)", R"(pipeline/main\.cpp)"},
    {R"(nlohmann/.*)", R"((.*\.cpp|pipeline/.*\.h|formats/seal_json\.h))"},
    {R"(Eigen/.*)", R"((fibers|precompute|render|pipeline)/.*|formats/tensor_file\.cpp)"},
};

std::string module_of(const std::string& path) {
  if (path.starts_with("fibers/math/")) return "fibers/math";
  return path.substr(0, path.find('/'));
}

std::vector<std::string> source_files() {
  std::vector<std::string> files;
  for (const char* folder : {"formats", "fibers", "precompute", "render", "pipeline"}) {
    if (!fs::exists(kSources / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(kSources / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp")
        files.push_back(fs::relative(entry.path(), kSources).string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string text_of(const std::string& file) {
  std::ifstream stream(kSources / file);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<Include> includes_of(const std::string& file, const std::string& text) {
  static const std::regex pattern(R"(^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"])",
                                  std::regex::multiline);
  std::vector<Include> includes;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    includes.push_back({file, (*match)[2], (*match)[1] == "\""});
  }
  return includes;
}

std::string broken_arrow(const Include& include) {
  if (!include.quoted) return "";
  if (!fs::exists(kSources / include.target))
    return include.file + " includes " + include.target + ", not a path from the root";
  const std::string from = module_of(include.file);
  const std::string to = module_of(include.target);
  if (from == to || kArrows.at(from).contains(to)) return "";
  return include.file + " (" + from + ") must not include " + include.target + " (" + to + ")";
}

std::string broken_within_pipeline(const Include& include) {
  for (const auto& [files, targets] : kNotWithinPipeline) {
    if (std::regex_match(include.file, std::regex(files)) &&
        std::regex_match(include.target, std::regex(targets))) {
      return include.file + " must not include " + include.target;
    }
  }
  return "";
}

std::string broken_confinement(const Include& include) {
  for (const auto& [header, files] : kConfined) {
    if (std::regex_match(include.target, std::regex(header)) &&
        !std::regex_match(include.file, std::regex(files))) {
      return include.file + " must not include " + include.target + " (allowed in " + files + ")";
    }
  }
  return "";
}

std::string expected_guard(const std::string& file) {
  std::string guard = "HEDDLE_";
  for (const char c : file)
    guard += std::isalnum(static_cast<unsigned char>(c)) ? static_cast<char>(std::toupper(c)) : '_';
  return guard + "_";
}

TEST(IncludeGraph, ArrowsGoOneWay) {
  const std::vector<std::string> files = source_files();
  ASSERT_GT(files.size(), 20U);
  for (const std::string& file : files) {
    for (const Include& include : includes_of(file, text_of(file)))
      EXPECT_EQ(broken_arrow(include), "");
  }
}

TEST(IncludeGraph, ThirdPartyHeadersStayInFewFiles) {
  for (const std::string& file : source_files()) {
    for (const Include& include : includes_of(file, text_of(file)))
      EXPECT_EQ(broken_confinement(include), "");
  }
}

TEST(IncludeGraph, StagesLieAboveAccuracyAndBelowPlans) {
  std::size_t of_accuracy = 0;
  for (const std::string& file : source_files()) {
    if (file.starts_with("pipeline/accuracy/")) ++of_accuracy;
    for (const Include& include : includes_of(file, text_of(file)))
      EXPECT_EQ(broken_within_pipeline(include), "");
  }
  EXPECT_GT(of_accuracy, 0U);
}

TEST(IncludeGraph, GuardsMatchPaths) {
  for (const std::string& file : source_files()) {
    if (!file.ends_with(".h")) continue;
    const std::string guard = expected_guard(file);
    EXPECT_EQ(text_of(file).rfind("#ifndef " + guard + "\n#define " + guard + "\n", 0), 0U)
        << file << " wants " << guard;
  }
}

TEST(IncludeGraph, WouldSeeAWrongInclude) {
  const auto parsed =
      includes_of("formats/x.cpp", "#include <map>\n  #  include \"fibers/math/vector.h\"\n");
  ASSERT_EQ(parsed.size(), 2U);
  EXPECT_EQ(broken_arrow(parsed[0]), "");
  EXPECT_NE(broken_arrow(parsed[1]), "");
  EXPECT_EQ(broken_arrow({"fibers/cloth/x.cpp", "fibers/math/vector.h", true}), "");
  EXPECT_NE(broken_arrow({"fibers/math/x.h", "fibers/cloth/exemplar.h", true}), "");
  EXPECT_NE(broken_arrow({"fibers/cloth/x.cpp", "vector.h", true}), "");
  EXPECT_NE(broken_confinement({"fibers/tracing/x.h", "embree3/rtcore.h", false}), "");
  EXPECT_EQ(broken_confinement({"fibers/tracing/x.cpp", "embree3/rtcore.h", false}), "");
  EXPECT_NE(broken_confinement({"render/x.h", "tbb/parallel_for.h", false}), "");
  EXPECT_NE(broken_confinement({"formats/x.h", "Eigen/Core", false}), "");
  EXPECT_NE(broken_within_pipeline({"pipeline/stages.cpp", "pipeline/plan/x.h", true}), "");
  EXPECT_NE(broken_within_pipeline({"pipeline/accuracy/x.cpp", "pipeline/stages.h", true}), "");
  EXPECT_EQ(broken_within_pipeline({"pipeline/stages.h", "pipeline/accuracy/x.h", true}), "");
  EXPECT_EQ(broken_within_pipeline({"pipeline/plan/x.cpp", "pipeline/stages.h", true}), "");
  EXPECT_EQ(expected_guard("formats/x_y.h"), "HEDDLE_FORMATS_X_Y_H_");
}

}  // namespace
