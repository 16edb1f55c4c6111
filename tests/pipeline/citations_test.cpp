// Reads every file of the tree for the files, folders and sections that its comments and documents
// cite, and looks whether they exist. A path is cited from the root of the tree, or by a file's
// name alone; a section as docs/FILE.md, "Heading"; a Markdown link from its document's folder.

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

const fs::path kRoot = HEDDLE_SOURCE_DIR;

// Everything that is ours; no build or output folder.
const std::vector<std::string> kFolders = {"formats", "fibers",  "precompute", "render", "pipeline",
                                           "tests",   "configs", "docs",       ".ci"};

/// Files that stand for any of their kind, or that the program writes.
const std::set<std::string> kExamples = {
    "configs/fabrics/NAME.toml",       // of a fabric
    "configs/fabrics/{fabric}.toml",   // of a fabric
    "tests/bench/heddle_speed",        // built
    "tests/bench/heddle_flat_swatch",  // built
    "tests/bench/heddle_stability",    // built
    "tests/bench/heddle_transfer_estimators",
};

struct Text {
  std::string file;  // from the root
  std::string text;
};

std::string contents(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

bool is_text(const fs::path& path) {
  static const std::set<std::string> extensions = {".h",  ".cpp",  ".c",     ".md", ".py",
                                                   ".sh", ".toml", ".cmake", ".txt"};
  return extensions.contains(path.extension().string());
}

const std::vector<Text>& tree() {
  static const std::vector<Text> files = [] {
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(kRoot)) {
      if (entry.is_regular_file()) paths.push_back(entry.path());
    }
    for (const std::string& folder : kFolders) {
      for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
        if (entry.is_regular_file()) paths.push_back(entry.path());
      }
    }
    std::vector<Text> texts;
    for (const fs::path& path : paths) {
      // Examples of wrong citations and includes.
      const std::string name = path.filename().string();
      if (name == "citations_test.cpp" || name == "include_graph_test.cpp") continue;
      texts.push_back({fs::relative(path, kRoot).string(), is_text(path) ? contents(path) : ""});
    }
    return texts;
  }();
  return files;
}

/// Comments of C++ without their marks, lines joined; of other files all that they say.
std::string prose_of(const Text& file) {
  const std::string extension = fs::path(file.file).extension().string();
  if (extension != ".h" && extension != ".cpp" && extension != ".c") return file.text;
  std::string prose;
  std::istringstream lines(file.text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t mark = line.find("//");
    if (mark == std::string::npos) {
      prose += "\n";
      continue;
    }
    const std::size_t begin = line.find_first_not_of("/", mark);
    prose += begin == std::string::npos ? "\n" : line.substr(begin) + " ";
  }
  return prose;
}

std::vector<std::smatch> matches(const std::string& text, const std::regex& pattern) {
  return {std::sregex_iterator(text.begin(), text.end(), pattern), std::sregex_iterator()};
}

/// "a/{b,c}.d" -> "a/b.d", "a/c.d"
std::vector<std::string> expanded(const std::string& path) {
  const std::size_t open = path.find('{');
  const std::size_t close = path.find('}');
  if (open == std::string::npos || close == std::string::npos) return {path};
  std::vector<std::string> paths;
  std::istringstream names(path.substr(open + 1, close - open - 1));
  for (std::string name; std::getline(names, name, ',');)
    paths.push_back(path.substr(0, open) + name + path.substr(close + 1));
  return paths;
}

/// Does a path of the tree fit, '*' standing for any letters?
bool exists(const std::string& path) {
  if (path.find('*') == std::string::npos) return fs::exists(kRoot / path);
  std::string pattern;
  for (const char c : path)
    pattern += c == '*' ? std::string("[^/]*") : c == '.' ? std::string("\\.") : std::string(1, c);
  const std::regex fits(pattern);
  return std::any_of(tree().begin(), tree().end(),
                     [&](const Text& file) { return std::regex_match(file.file, fits); });
}

/// The paths that a text cites and the tree lacks. A word that goes on before the path belongs to
/// another one ("../configs/", "x/docs/").
std::vector<std::string> broken_paths(const std::string& prose) {
  static const std::regex pattern(
      R"((^|[^A-Za-z0-9_./-])((?:formats|fibers|precompute|render|pipeline|tests|configs|docs|\.ci)/[A-Za-z0-9_./*-]*(?:\{[A-Za-z0-9_.,-]*\}[A-Za-z0-9_./*-]*)?))");
  std::vector<std::string> broken;
  for (const std::smatch& match : matches(prose, pattern)) {
    std::string cited = match[2];
    while (cited.ends_with('.') || cited.ends_with('-')) cited.pop_back();
    if (kExamples.contains(cited)) continue;
    for (const std::string& path : expanded(cited)) {
      if (!exists(path)) broken.push_back(path);
    }
  }
  return broken;
}

/// The same for sources and documents that are cited by their name.
std::vector<std::string> unknown_names(const std::string& prose) {
  static const std::set<std::string> known = [] {
    std::set<std::string> names = {"citations_test.cpp", "include_graph_test.cpp"};
    for (const Text& file : tree()) names.insert(fs::path(file.file).filename().string());
    return names;
  }();
  static const std::regex pattern(R"((^|[^A-Za-z0-9_./*<-])([a-z][a-z0-9_]*\.(?:h|cpp|md))\b)");
  std::vector<std::string> unknown;
  for (const std::smatch& match : matches(prose, pattern)) {
    if (!known.contains(match[2])) unknown.push_back(match[2]);
  }
  return unknown;
}

std::set<std::string> headings_of(const std::string& document) {
  static const std::regex pattern(R"(^#+ +(.*[^ ]))");
  std::set<std::string> headings;
  std::istringstream lines(document);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, pattern)) headings.insert(match[1]);
  }
  return headings;
}

/// Sections cited as FILE.md, "Heading" that the document does not have.
std::vector<std::string> unknown_sections(const std::string& prose) {
  static const std::regex pattern(R"re(([A-Za-z0-9_./-]+\.md), "([^"]+)")re");
  std::vector<std::string> unknown;
  for (const std::smatch& match : matches(prose, pattern)) {
    const std::set<std::string> headings = headings_of(contents(kRoot / match[1].str()));
    std::string cited = match[2];
    while (cited.ends_with('.') || cited.ends_with(',')) cited.pop_back();
    if (!headings.contains(cited)) unknown.push_back(match[0]);
  }
  return unknown;
}

/// Links of a Markdown document to files that are not there.
std::vector<std::string> broken_links(const std::string& file, const std::string& text) {
  static const std::regex pattern(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  std::vector<std::string> broken;
  for (const std::smatch& match : matches(text, pattern)) {
    if (!fs::exists(kRoot / fs::path(file).parent_path() / match[1].str()))
      broken.push_back(match[1]);
  }
  return broken;
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += "\n  " + name;
  return list;
}

TEST(Citations, PathsThatCommentsAndDocumentsCiteExist) {
  ASSERT_GT(tree().size(), 300U);
  for (const Text& file : tree())
    EXPECT_EQ(listed(broken_paths(prose_of(file))), "") << file.file << " cites what is not there";
}

TEST(Citations, SourcesAndDocumentsCitedByNameExist) {
  for (const Text& file : tree()) {
    EXPECT_EQ(listed(unknown_names(prose_of(file))), "") << file.file << " cites what is not there";
  }
}

TEST(Citations, SectionsThatAreCitedExist) {
  for (const Text& file : tree()) {
    EXPECT_EQ(listed(unknown_sections(prose_of(file))), "")
        << file.file << " cites what is not there";
  }
}

TEST(Citations, LinksOfDocumentsLeadToFiles) {
  for (const Text& file : tree()) {
    if (!file.file.ends_with(".md")) continue;
    EXPECT_EQ(listed(broken_links(file.file, file.text)), "") << file.file;
  }
}

TEST(Citations, WouldSeeAWrongOne) {
  using List = std::vector<std::string>;
  EXPECT_EQ(broken_paths("as in formats/toml_table.h."), List{});
  EXPECT_EQ(broken_paths("as in formats/toml_tables.h."), List{"formats/toml_tables.h"});
  EXPECT_EQ(broken_paths("(tests/render/ and ../x/docs/none.md)"), List{});
  EXPECT_EQ(broken_paths("formats/toml_table.{h,cpp}, formats/{toml_table,none}.h"),
            List{"formats/none.h"});
  EXPECT_EQ(broken_paths("formats/toml_*.cpp, formats/none_*.cpp"), List{"formats/none_*.cpp"});
  EXPECT_EQ(unknown_names("see toml_table.h and toml_tables.h"), List{"toml_tables.h"});
  EXPECT_EQ(unknown_sections("docs/architecture.md, \"Known limits\""), List{});
  EXPECT_EQ(unknown_sections("docs/architecture.md, \"Known faults\"").size(), 1U);
  EXPECT_EQ(unknown_sections("docs/none.md, \"Known limits\"").size(), 1U);
  EXPECT_EQ(broken_links("docs/x.md", "[a](architecture.md) [b](../README.md#x) [c](none.md)"),
            List{"none.md"});
  // A citation that two lines of a comment share.
  EXPECT_EQ(prose_of({"x.h", "int a;  // see docs/none.md,\n  // \"Known limits\"\nint b;\n"}),
            " see docs/none.md,  \"Known limits\" \n");
}

}  // namespace
