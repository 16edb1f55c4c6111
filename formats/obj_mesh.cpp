#include "formats/obj_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "formats/atomic_file.h"
#include "formats/input_error.h"

namespace heddle {

namespace {

constexpr std::size_t kMaxTriangles = 50'000'000;
constexpr std::int64_t kAbsent = -1;
constexpr float kSharpest = 10;  // OpenSubdiv's infinity

/// Indices of one corner from 0, kAbsent if not given.
struct Corner {
  std::int64_t position = kAbsent;
  std::int64_t uv = kAbsent;
  std::int64_t normal = kAbsent;
  auto operator<=>(const Corner&) const = default;
};

class Parser {
 public:
  Parser(const std::filesystem::path& path, const ObjUnits& units) : path_(path), units_(units) {}

  ObjMesh parse(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      ++line_;
      parse_line(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    line_ = 0;
    if (mesh_.triangles.empty()) fail("no faces");
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    const std::string place = line_ == 0 ? "" : fmt::format(":{}", line_);
    throw FileError(fmt::format("{}{}: {}", path_.string(), place, reason));
  }

  static std::string_view next_word(std::string_view& rest) {
    constexpr std::string_view kBlank = " \t\r";
    rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
    const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
    rest.remove_prefix(word.size());
    return word;
  }

  void parse_line(std::string_view rest) {
    rest = rest.substr(0, rest.find('#'));
    const std::string_view keyword = next_word(rest);
    if (keyword == "v") {
      positions_.push_back(numbers<3>(rest, "vertex"));
      check_place("vertex", positions_, units_.mm_per_unit);
    } else if (keyword == "vt") {
      uvs_.push_back(numbers<2>(rest, "texture coordinate"));
      check_place("texture coordinate", uvs_, units_.mm_per_uv);
    } else if (keyword == "vn") {
      normals_.push_back(unit_vector(numbers<3>(rest, "normal")));
    } else if (keyword == "f") {
      add_face(rest);
    } else if (keyword == "g") {
      groups_.clear();
      for (std::string_view name = next_word(rest); !name.empty(); name = next_word(rest))
        groups_.emplace_back(name);
      is_new_part_ = true;
    } else if (keyword == "o") {
      object_ = std::string(trimmed(rest));
      is_new_part_ = true;
    } else if (keyword == "t") {
      add_tag(rest);
    }
    // Everything else (materials, lines, ...) has no meaning here; files named by it are never
    // opened.
  }

  static std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlank = " \t\r";
    text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
    return text.substr(0, text.find_last_not_of(kBlank) + 1);
  }

  /// The part that the next face belongs to.
  std::uint32_t current_part() {
    if (!is_new_part_) return part_;
    std::vector<std::string> names = groups_;
    if (!object_.empty()) names.push_back(object_);
    const auto [place, is_new] =
        parts_.try_emplace(names, static_cast<std::uint32_t>(mesh_.parts.size()));
    if (is_new) mesh_.parts.push_back(std::move(names));
    is_new_part_ = false;
    return part_ = place->second;
  }

  /// A whole number of a tag, not negative.
  std::size_t count_in(std::string_view text) const {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
      fail(fmt::format("'{}' is no whole number of a tag", text));
    return value;
  }

  /// "NAME integers/numbers/strings" and so many of each; only creases and corners have a meaning.
  void add_tag(std::string_view rest) {
    const std::string_view name = next_word(rest);
    if (name != "crease" && name != "corner") return;
    std::string_view counts = next_word(rest);
    std::array<std::size_t, 3> count = {};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t slash = std::min(counts.find('/'), counts.size());
      count[k] = count_in(counts.substr(0, slash));
      counts.remove_prefix(std::min(slash + 1, counts.size()));
    }
    std::vector<std::size_t> vertices;
    for (std::size_t k = 0; k < count[0]; ++k) {
      const std::size_t vertex = count_in(next_word(rest));
      if (vertex >= positions_.size())
        fail(fmt::format("tag {}: vertex {} of {}, from 0", name, vertex, positions_.size()));
      vertices.push_back(vertex);
    }
    std::vector<float> sharpness;
    for (std::size_t k = 0; k < count[1]; ++k) {
      const std::string_view word = next_word(rest);
      sharpness.push_back(numbers<1>(word, "sharpness")[0]);
      if (sharpness.back() < 0) fail(fmt::format("tag {}: a sharpness below 0", name));
      sharpness.back() = std::min(sharpness.back(), kSharpest);
    }
    const std::size_t each = name == "crease" ? 2 : 1;
    const std::size_t places = vertices.size() / each;
    if (vertices.size() % each != 0 || (sharpness.size() != 1 && sharpness.size() != places))
      fail(fmt::format("tag {}: expected {}, and one sharpness or one for each", name,
                       each == 2 ? "pairs of vertices" : "vertices"));
    for (std::size_t k = 0; k < places; ++k) {
      const float here = sharpness[sharpness.size() == 1 ? 0 : k];
      if (each == 2) {
        mesh_.sharp_edges.push_back(
            {{positions_[vertices[2 * k]], positions_[vertices[2 * k + 1]]}, here, line_});
      } else {
        mesh_.sharp_vertices.push_back({positions_[vertices[k]], here});
      }
    }
  }

  /// The first N numbers of a line; more may follow (weights, vertex colours).
  template <std::size_t N>
  std::array<float, N> numbers(std::string_view rest, const char* what) const {
    std::array<float, N> result;
    for (float& value : result) {
      std::string_view word = next_word(rest);
      if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
      double number = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (word.empty() || error != std::errc() || end != word.data() + word.size() ||
          !(std::abs(number) <= std::numeric_limits<float>::max())) {
        fail(fmt::format("a {} needs {} finite numbers", what, N));
      }
      value = static_cast<float>(number);
    }
    return result;
  }

  /// The last of the places read so far.
  template <std::size_t N>
  void check_place(const char* what, const std::vector<std::array<float, N>>& places,
                   double mm_per_unit) const {
    for (const float coordinate : places.back()) {
      const double mm = coordinate * mm_per_unit;
      if (std::abs(mm) <= kMaxCoordinateMm) continue;
      fail(fmt::format("{} {}: a coordinate of {:g} mm; at most {:g} mm (1 km) either way", what,
                       places.size(), mm, kMaxCoordinateMm));
    }
  }

  std::array<float, 3> unit_vector(const std::array<float, 3>& v) const {
    const double length = std::hypot(double{v[0]}, double{v[1]}, double{v[2]});
    if (length == 0) fail("a normal of length 0");
    return {static_cast<float>(v[0] / length), static_cast<float>(v[1] / length),
            static_cast<float>(v[2] / length)};
  }

  /// An index as written (from 1; negative: counted back from the last one read) to an index from
  /// 0.
  std::int64_t index(std::string_view text, std::size_t count, const char* what) const {
    std::int64_t written = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), written);
    const auto limit = static_cast<std::int64_t>(count);
    const bool is_number =
        !text.empty() && error != std::errc::invalid_argument && end == text.data() + text.size();
    if (!is_number) fail(fmt::format("face {}: '{}' is no index", faces_, text));
    if (error != std::errc() || written == 0 || written > limit || written < -limit) {
      fail(fmt::format("face {}: {} {} of {}", faces_, what, text, count));
    }
    return written > 0 ? written - 1 : limit + written;
  }

  /// "position", "position/uv", "position//normal" or "position/uv/normal".
  Corner corner(std::string_view word) const {
    Corner result;
    std::string_view fields[3];
    for (int i = 0; i < 3; ++i) {
      const std::size_t slash = word.find('/');
      fields[i] = word.substr(0, slash);
      if (slash == std::string_view::npos) {
        word = {};
        break;
      }
      word.remove_prefix(slash + 1);
      if (i == 2) fail(fmt::format("face {}: more than three indices in a corner", faces_));
    }
    result.position = index(fields[0], positions_.size(), "vertex");
    if (!fields[1].empty()) result.uv = index(fields[1], uvs_.size(), "texture coordinate");
    if (!fields[2].empty()) result.normal = index(fields[2], normals_.size(), "normal");
    return result;
  }

  std::uint32_t vertex_of(const Corner& corner) {
    const auto [it, is_new] =
        vertices_.try_emplace(corner, static_cast<std::uint32_t>(mesh_.positions.size()));
    if (is_new) {
      mesh_.positions.push_back(positions_[static_cast<std::size_t>(corner.position)]);
      if (corner.uv != kAbsent) mesh_.uvs.push_back(uvs_[static_cast<std::size_t>(corner.uv)]);
      if (corner.normal != kAbsent)
        mesh_.normals.push_back(normals_[static_cast<std::size_t>(corner.normal)]);
    }
    return it->second;
  }

  void add_face(std::string_view rest) {
    ++faces_;
    std::uint32_t first = 0;
    std::uint32_t previous = 0;
    std::uint32_t corners = 0;
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
      const Corner parsed = corner(word);
      if (mesh_.positions.empty()) {
        has_uvs_ = parsed.uv != kAbsent;
        has_normals_ = parsed.normal != kAbsent;
      }
      if (has_uvs_ != (parsed.uv != kAbsent))
        fail(fmt::format("face {}: only some corners have UVs", faces_));
      if (has_normals_ != (parsed.normal != kAbsent)) {
        fail(fmt::format("face {}: only some corners have normals", faces_));
      }
      const std::uint32_t vertex = vertex_of(parsed);
      if (corners == 0) first = vertex;
      if (corners >= 2) {
        if (mesh_.triangles.size() == kMaxTriangles)
          fail(fmt::format("more than {} triangles", kMaxTriangles));
        mesh_.triangles.push_back({first, previous, vertex});
      }
      previous = vertex;
      ++corners;
    }
    if (corners < 3) fail(fmt::format("face {} has {} corners", faces_, corners));
    mesh_.face_corners.push_back(corners);
    mesh_.face_part.push_back(current_part());
  }

  std::filesystem::path path_;
  ObjUnits units_;
  std::size_t line_ = 0;
  std::size_t faces_ = 0;
  bool has_uvs_ = false;
  bool has_normals_ = false;
  std::vector<std::array<float, 3>> positions_;  // as in the file
  std::vector<std::array<float, 2>> uvs_;
  std::vector<std::array<float, 3>> normals_;
  std::map<Corner, std::uint32_t> vertices_;
  std::vector<std::string> groups_;  // of the faces that follow
  std::string object_;
  bool is_new_part_ = true;
  std::uint32_t part_ = 0;
  std::map<std::vector<std::string>, std::uint32_t> parts_;
  ObjMesh mesh_;
};

}  // namespace

ObjMesh read_obj(const std::filesystem::path& path, const ObjUnits& units) {
  const std::vector<std::byte> bytes = read_whole_file(path);
  return Parser(path, units).parse({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::vector<std::string> group_names(const ObjMesh& mesh) {
  std::set<std::string> names;
  for (const std::vector<std::string>& part : mesh.parts) names.insert(part.begin(), part.end());
  return {names.begin(), names.end()};
}

std::vector<std::uint8_t> triangles_of_group(const ObjMesh& mesh, const std::string& name) {
  std::vector<std::uint8_t> result;
  for (std::size_t face = 0; face < mesh.face_corners.size(); ++face) {
    const std::vector<std::string>& names = mesh.parts[mesh.face_part[face]];
    const bool is_in = std::find(names.begin(), names.end(), name) != names.end();
    result.insert(result.end(), mesh.face_corners[face] - 2, is_in ? 1 : 0);
  }
  return result;
}

}  // namespace heddle
