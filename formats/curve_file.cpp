#include "formats/curve_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "formats/atomic_file.h"
#include "formats/file_ending.h"
#include "formats/input_error.h"
#include "formats/utf8_text.h"

namespace heddle {
namespace {

constexpr std::size_t kBccHeader = 64;
constexpr std::size_t kBccInfo = 40;
constexpr std::size_t kHairHeader = 128;
constexpr std::size_t kHairInfo = 88;
constexpr std::size_t kPointBytes = sizeof(CurvePoint);
constexpr std::uint64_t kMostHairPoints = 65536;  // of a curve: segments are counted by 16 bits
constexpr std::uint32_t kHairSegments = 1;
constexpr std::uint32_t kHairPoints = 2;
constexpr std::uint32_t kHairThickness = 4;
constexpr std::uint32_t kHairTransparency = 8;
constexpr std::uint32_t kHairColors = 16;

static_assert(std::numeric_limits<float>::is_iec559 && sizeof(CurvePoint) == 12);

/// The bytes of a file, read from the start on.
class CurveBytes {
 public:
  CurveBytes(std::span<const std::byte> bytes, std::string name)
      : bytes_(bytes), name_(std::move(name)) {}

  [[noreturn]] void fail(const std::string& reason) const {
    throw FileError(fmt::format("{}: {}", name_, reason));
  }
  std::uint64_t size() const { return bytes_.size(); }
  std::uint64_t left() const { return bytes_.size() - at_; }
  std::uint64_t position() const { return at_; }

  template <class Value>
  Value take() {
    Value value;
    read(&value, sizeof(value));
    return value;
  }
  void read(void* to, std::size_t size) {
    if (size > left()) fail(fmt::format("ends after {} bytes", bytes_.size()));
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  void skip(std::uint64_t size) { at_ += std::min(size, left()); }
  /// Up to the first zero byte; uninitialised memory gives no text.
  std::string text(std::size_t size) {
    std::string chars(size, '\0');
    read(chars.data(), size);
    chars.resize(std::min(chars.find('\0'), size));
    const bool printable = std::all_of(chars.begin(), chars.end(), [](char c) {
      const auto code = static_cast<unsigned char>(c);
      return code >= 0x20 && code != 0x7f;
    });
    return printable ? utf8_of(chars) : "";
  }

 private:
  std::span<const std::byte> bytes_;
  std::string name_;
  std::uint64_t at_ = 0;
};

void check_finite(const CurveBytes& file, const CurveSet& curves, std::size_t first) {
  for (std::size_t p = first; p < curves.points.size(); ++p) {
    for (const float coordinate : curves.points[p]) {
      if (!std::isfinite(coordinate)) {
        file.fail(fmt::format("curve {}, point {}: expected finite coordinates",
                              curves.curve_count(), p - first + 1));
      }
    }
  }
}

/// What is wrong with a curve of so many points; empty if nothing is.
std::string length_error(CurveKind kind, std::uint64_t points, bool closed) {
  if (kind == CurveKind::kBezier) {
    const bool fits = closed ? points % 3 == 0 : points % 3 == 1;
    if (points >= (closed ? 3U : 4U) && fits) return "";
    return fmt::format("{} Bezier curve of {} points; expected {}", closed ? "a closed" : "an open",
                       points, closed ? "3, 6, 9, ..." : "4, 7, 10, ...");
  }
  if (points >= (closed ? 3U : 2U)) return "";
  return fmt::format("{} curve of {} points; expected at least {}", closed ? "a closed" : "an open",
                     points, closed ? 3 : 2);
}

std::optional<CurveKind> bcc_kind(std::string_view type) {
  if (type == "C0") return CurveKind::kCatmullRom;
  if (type == "BS") return CurveKind::kBSpline;
  if (type == "BZ") return CurveKind::kBezier;
  if (type == "PL") return CurveKind::kPolyline;
  return {};
}

}  // namespace

void CurveSet::add(std::span<const CurvePoint> curve, bool is_closed) {
  if (first_point.empty()) first_point.push_back(0);
  points.insert(points.end(), curve.begin(), curve.end());
  first_point.push_back(points.size());
  closed.push_back(is_closed);
}

CurveSet parse_bcc(std::span<const std::byte> bytes, const std::string& name) {
  CurveBytes file(bytes, name);
  if (file.size() < kBccHeader)
    file.fail(fmt::format("{} bytes; a BCC file has at least {}", file.size(), kBccHeader));
  char magic[3];
  file.read(magic, 3);
  if (std::string_view(magic, 3) != "BCC") file.fail("expected a file that begins with BCC");
  const auto widths = file.take<std::uint8_t>();
  if (widths != 0x44)
    file.fail(fmt::format("byte 3: expected 0x44 (integers and floats of 4 bytes), found {:#04x}",
                          widths));
  char type[2];
  file.read(type, 2);
  CurveSet curves;
  const std::optional<CurveKind> kind = bcc_kind({type, 2});
  if (!kind) file.fail("bytes 4 and 5: expected a curve type C0, BS, BZ or PL");
  curves.kind = *kind;
  const auto dimensions = file.take<std::uint8_t>();
  if (dimensions != 3) file.fail(fmt::format("expected 3 dimensions, found {}", dimensions));
  const auto up = file.take<std::uint8_t>();
  if (up > 2) file.fail(fmt::format("expected an up axis from 0 to 2, found {}", up));
  curves.up = static_cast<UpAxis>(up);
  const auto curve_count = file.take<std::uint64_t>();
  const auto point_count = file.take<std::uint64_t>();
  curves.info = file.text(kBccInfo);
  const std::uint64_t room = file.left();
  if (curve_count == 0) file.fail("expected at least one curve");
  if (curve_count > room / 4 || point_count > room / kPointBytes ||
      4 * curve_count + kPointBytes * point_count != room) {
    file.fail(fmt::format(
        "{} curves of {} points in all do not make a file of {} bytes: expected 64 + 4 per curve + "
        "12 per point",
        curve_count, point_count, file.size()));
  }
  curves.points.reserve(point_count);
  for (std::uint64_t c = 0; c < curve_count; ++c) {
    const std::int64_t count = file.take<std::int32_t>();
    const auto points = static_cast<std::uint64_t>(std::abs(count));
    const std::string error = length_error(curves.kind, points, count < 0);
    if (!error.empty()) file.fail(fmt::format("curve {}: {}", c + 1, error));
    if (points > point_count - curves.points.size()) {
      file.fail(fmt::format("curve {}: {} points, of {} in all {} are left", c + 1, points,
                            point_count, point_count - curves.points.size()));
    }
    std::vector<CurvePoint> curve(points);
    file.read(curve.data(), points * kPointBytes);
    const std::size_t first = curves.points.size();
    curves.add(curve, count < 0);
    check_finite(file, curves, first);
  }
  if (curves.points.size() != point_count) {
    file.fail(fmt::format("the curves have {} points, not the {} of the header",
                          curves.points.size(), point_count));
  }
  return curves;
}

namespace {

/// What the header of a cyHair file says.
struct HairHeader {
  std::uint32_t curves;
  std::uint32_t points;
  std::uint32_t arrays;
  std::uint32_t segments;  // of each curve, unless told for each
  float thickness;         // of each point, unless told for each
};

HairHeader read_hair_header(CurveBytes& file) {
  char magic[4];
  file.read(magic, 4);
  if (std::string_view(magic, 4) != "HAIR") file.fail("expected a file that begins with HAIR");
  HairHeader header{};
  header.curves = file.take<std::uint32_t>();
  header.points = file.take<std::uint32_t>();
  header.arrays = file.take<std::uint32_t>();
  header.segments = file.take<std::uint32_t>();
  header.thickness = file.take<float>();
  file.skip(16);  // transparency and colour
  if (header.arrays >= 32 || (header.arrays & kHairPoints) == 0) {
    file.fail(
        fmt::format("byte 12: expected the bits of arrays up to 31, that of points (2) among "
                    "them; found {}",
                    header.arrays));
  }
  const std::uint64_t per_point = kPointBytes + (header.arrays & kHairThickness ? 4 : 0) +
                                  (header.arrays & kHairTransparency ? 4 : 0) +
                                  (header.arrays & kHairColors ? 12 : 0);
  const std::uint64_t per_curve = header.arrays & kHairSegments ? 2 : 0;
  const std::uint64_t expected =
      kHairHeader + per_curve * header.curves + per_point * header.points;
  if (file.size() != expected) {
    file.fail(fmt::format("{} curves and {} points with arrays {} make {} bytes; found {}",
                          header.curves, header.points, header.arrays, expected, file.size()));
  }
  if (header.curves == 0) file.fail("expected at least one curve");
  return header;
}

}  // namespace

CurveSet parse_hair(std::span<const std::byte> bytes, const std::string& name) {
  CurveBytes file(bytes, name);
  if (file.size() < kHairHeader)
    file.fail(fmt::format("{} bytes; a cyHair file has at least {}", file.size(), kHairHeader));
  const HairHeader header = read_hair_header(file);
  CurveSet curves;
  curves.info = file.text(kHairInfo);
  // A curve has at least one point, so that the points, which are there, bound the curves.
  if (header.curves > header.points)
    file.fail(fmt::format("{} curves of {} points in all", header.curves, header.points));
  curves.first_point = {0};
  curves.first_point.reserve(header.curves + std::size_t{1});
  for (std::uint32_t c = 0; c < header.curves; ++c) {
    const std::uint64_t points =
        std::uint64_t{1} +
        (header.arrays & kHairSegments ? file.take<std::uint16_t>() : header.segments);
    const std::string error = length_error(CurveKind::kPolyline, points, false);
    if (!error.empty()) file.fail(fmt::format("curve {}: {}", c + 1, error));
    if (points > header.points - curves.first_point.back()) {
      file.fail(fmt::format("curve {}: {} points, of {} in all {} are left", c + 1, points,
                            header.points, header.points - curves.first_point.back()));
    }
    curves.first_point.push_back(curves.first_point.back() + points);
  }
  if (curves.first_point.back() != header.points) {
    file.fail(fmt::format("the curves have {} points, not the {} of the header",
                          curves.first_point.back(), header.points));
  }
  curves.closed.assign(header.curves, false);
  curves.points.resize(header.points);
  file.read(curves.points.data(), kPointBytes * curves.points.size());
  for (std::size_t p = 0; p < curves.points.size(); ++p) {
    for (const float coordinate : curves.points[p]) {
      if (!std::isfinite(coordinate))
        file.fail(fmt::format("point {}: expected finite coordinates", p + 1));
    }
  }
  if ((header.arrays & kHairThickness) != 0) {
    curves.thickness.resize(header.points);
    file.read(curves.thickness.data(), sizeof(float) * curves.thickness.size());
    for (std::size_t p = 0; p < curves.thickness.size(); ++p) {
      if (!(curves.thickness[p] >= 0) || !std::isfinite(curves.thickness[p]))
        file.fail(fmt::format("point {}: expected a thickness of 0 or more", p + 1));
    }
  } else if (std::isfinite(header.thickness) && header.thickness > 0) {
    curves.thickness.assign(header.points, header.thickness);
  }
  return curves;
}

namespace {

class ObjLines {
 public:
  explicit ObjLines(const std::string& name) : name_(name) {}

  CurveSet parse(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = line_end(text);
      const std::string_view line = text.substr(0, end);
      ++line_;
      parse_line(line.substr(0, line.find('#')));
      line_ += static_cast<std::size_t>(std::count(line.begin(), line.end(), '\n'));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    finish_line();
    line_ = 0;
    if (curves_.curve_count() == 0) fail("no lines (elements \"l\")");
    return std::move(curves_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    const std::string place = line_ == 0 ? "" : fmt::format(":{}", line_);
    throw FileError(fmt::format("{}{}: {}", name_, place, reason));
  }

  // A backslash at the end of a line joins it to the next.
  static std::size_t line_end(std::string_view text) {
    std::size_t end = 0;
    for (;;) {
      end = std::min(text.find('\n', end), text.size());
      const std::size_t last = text.substr(0, end).find_last_not_of('\r');
      if (end == text.size() || last == std::string_view::npos || text[last] != '\\') return end;
      ++end;
    }
  }

  static std::string_view next_word(std::string_view& rest) {
    constexpr std::string_view kBlank = " \t\r\n\\";
    rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
    const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
    rest.remove_prefix(word.size());
    return word;
  }

  void parse_line(std::string_view rest) {
    const std::string_view keyword = next_word(rest);
    if (keyword == "v") add_vertex(rest);
    if (keyword == "l") add_line(rest);
  }

  void add_vertex(std::string_view rest) {
    CurvePoint point;
    for (float& value : point) {
      std::string_view word = next_word(rest);
      if (word.starts_with('+')) word.remove_prefix(1);
      double number = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (word.empty() || error != std::errc() || end != word.data() + word.size() ||
          !(std::abs(number) <= std::numeric_limits<float>::max()))
        fail("a vertex needs 3 finite numbers");
      value = static_cast<float>(number);
    }
    vertices_.push_back(point);
  }

  /// An index from 1, or from the end where negative; a texture's index may follow.
  std::size_t index(std::string_view word) const {
    word = word.substr(0, word.find('/'));
    std::int64_t written = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), written);
    const auto count = static_cast<std::int64_t>(vertices_.size());
    if (word.empty() || error != std::errc() || end != word.data() + word.size() || written == 0 ||
        written > count || written < -count)
      fail(fmt::format("a line's vertex: expected a number from 1 to {}, or -1 to -{}, found {}",
                       count, count, quoted_excerpt(word)));
    return static_cast<std::size_t>(written > 0 ? written - 1 : count + written);
  }

  void add_line(std::string_view rest) {
    std::vector<std::size_t> line;
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest))
      line.push_back(index(word));
    if (line.size() < 2)
      fail(fmt::format("a line of {} vertices; expected at least 2", line.size()));
    if (line.size() == 2 && !open_.empty() && open_.back() == line.front()) {
      open_.push_back(line.back());
      return;
    }
    finish_line();
    open_ = std::move(line);
  }

  void finish_line() {
    if (open_.empty()) return;
    const bool is_closed = open_.size() > 3 && open_.front() == open_.back();
    if (is_closed) open_.pop_back();
    std::vector<CurvePoint> points;
    for (const std::size_t vertex : open_) points.push_back(vertices_[vertex]);
    curves_.add(points, is_closed);
    open_.clear();
  }

  std::string name_;
  std::size_t line_ = 0;
  std::vector<CurvePoint> vertices_;
  std::vector<std::size_t> open_;  // vertices of the line that may go on
  CurveSet curves_;
};

}  // namespace

CurveSet parse_obj_lines(std::string_view text, const std::string& name) {
  return ObjLines(name).parse(text);
}

CurveSet read_curves(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending != ".bcc" && ending != ".hair" && ending != ".obj")
    throw FileError(path.string() + ": expected curves in a file .bcc, .hair or .obj");
  const std::vector<std::byte> bytes = read_whole_file(path);
  if (ending == ".bcc") return parse_bcc(bytes, path.string());
  if (ending == ".hair") return parse_hair(bytes, path.string());
  return parse_obj_lines({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                         path.string());
}

namespace {

/// Weights of four control points at t in [0, 1].
using CurveWeights = std::array<double, 4>;

CurveWeights catmull_rom_weights(double t) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {0.5 * (-t + 2 * t2 - t3), 0.5 * (2 - 5 * t2 + 3 * t3), 0.5 * (t + 4 * t2 - 3 * t3),
          0.5 * (t3 - t2)};
}

CurveWeights b_spline_weights(double t) {
  const double u = 1 - t;
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {u * u * u / 6, (3 * t3 - 6 * t2 + 4) / 6, (-3 * t3 + 3 * t2 + 3 * t + 1) / 6, t3 / 6};
}

CurveWeights bezier_weights(double t) {
  const double u = 1 - t;
  return {u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t};
}

}  // namespace

std::vector<CurvePoint> sample_curve(const CurveSet& curves, std::size_t c, int pieces) {
  assert(pieces >= 1);
  const std::span<const CurvePoint> points = curves.curve(c);
  const bool is_closed = curves.closed[c];
  const auto n = static_cast<std::int64_t>(points.size());
  // Control point i, wherever it lies.
  const auto at = [&](std::int64_t i) -> std::array<double, 3> {
    const auto place = [&](std::int64_t k) { return points[static_cast<std::size_t>(k)]; };
    if (is_closed) i = ((i % n) + n) % n;
    const std::int64_t inside = std::clamp<std::int64_t>(i, 0, n - 1);
    CurvePoint p = place(inside);
    if (i == inside || curves.kind != CurveKind::kCatmullRom) return {p[0], p[1], p[2]};
    const CurvePoint q = place(i < 0 ? 1 : n - 2);
    return {2.0 * p[0] - q[0], 2.0 * p[1] - q[1], 2.0 * p[2] - q[2]};
  };
  std::int64_t first = 0;  // control point before the first segment
  std::int64_t last = is_closed ? n : n - 1;
  std::int64_t stride = 1;
  std::int64_t before = 1;  // control points of a segment before that one
  CurveWeights (*weights)(double) = nullptr;
  switch (curves.kind) {
    case CurveKind::kPolyline:
      before = 0;
      weights = [](double t) { return CurveWeights{1 - t, t, 0, 0}; };
      break;
    case CurveKind::kCatmullRom:
      weights = catmull_rom_weights;
      break;
    case CurveKind::kBSpline:
      weights = b_spline_weights;
      if (!is_closed) {
        first = -1;
        last = n;
      }
      break;
    case CurveKind::kBezier:
      before = 0;
      stride = 3;
      weights = bezier_weights;
      break;
  }
  std::vector<CurvePoint> result;
  const auto add = [&](std::int64_t segment, double t) {
    const CurveWeights w = weights(t);
    std::array<double, 3> sum{};
    for (std::int64_t k = 0; k < 4; ++k) {
      const double weight = w[static_cast<std::size_t>(k)];
      if (weight == 0) continue;
      const std::array<double, 3> p = at(segment - before + k);
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weight * p[axis];
    }
    result.push_back(
        {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])});
  };
  for (std::int64_t segment = first; segment < last; segment += stride) {
    for (int piece = 0; piece < pieces; ++piece) add(segment, static_cast<double>(piece) / pieces);
  }
  if (is_closed) {
    result.push_back(result.front());
  } else {
    add(last - stride, 1.0);
  }
  return result;
}

namespace {

template <class Value>
void put(AtomicFile& file, const Value& value) {
  file.write(std::as_bytes(std::span(&value, 1)));
}

void put_text(AtomicFile& file, const std::string& text, std::size_t size) {
  std::string padded = text.substr(0, size);
  padded.resize(size, '\0');
  file.write(std::as_bytes(std::span(padded)));
}

void write_bcc(const std::filesystem::path& path, const CurveSet& curves) {
  for (std::size_t c = 0; c < curves.curve_count(); ++c) {
    if (curves.curve(c).size() > std::numeric_limits<std::int32_t>::max())
      throw FileError(
          fmt::format("{}: curve {} has too many points for BCC", path.string(), c + 1));
  }
  AtomicFile file(path);
  put_text(file, "BCC", 3);
  put(file, std::uint8_t{0x44});
  put_text(file, "PL", 2);
  put(file, std::uint8_t{3});
  put(file, static_cast<std::uint8_t>(curves.up == UpAxis::kUnknown ? UpAxis::kZ : curves.up));
  put(file, std::uint64_t{curves.curve_count()});
  put(file, std::uint64_t{curves.points.size()});
  put_text(file, curves.info, kBccInfo);
  for (std::size_t c = 0; c < curves.curve_count(); ++c) {
    const auto count = static_cast<std::int32_t>(curves.curve(c).size());
    put(file, curves.closed[c] ? -count : count);
    file.write(std::as_bytes(curves.curve(c)));
  }
  file.commit();
}

void write_hair(const std::filesystem::path& path, const CurveSet& curves) {
  std::uint64_t points = 0;
  for (std::size_t c = 0; c < curves.curve_count(); ++c) {
    const std::uint64_t count = curves.curve(c).size() + (curves.closed[c] ? 1 : 0);
    points += count;
    if (count > kMostHairPoints || points > std::numeric_limits<std::uint32_t>::max()) {
      throw FileError(fmt::format(
          "{}: curve {}: cyHair has at most {} points per curve and {} in "
          "all; .bcc and .obj have room for more",
          path.string(), c + 1, kMostHairPoints, std::numeric_limits<std::uint32_t>::max()));
    }
  }
  const bool has_thickness = !curves.thickness.empty();
  AtomicFile file(path);
  put_text(file, "HAIR", 4);
  put(file, static_cast<std::uint32_t>(curves.curve_count()));
  put(file, static_cast<std::uint32_t>(points));
  put(file, kHairSegments | kHairPoints | (has_thickness ? kHairThickness : 0U));
  put(file, std::uint32_t{0});
  put(file, has_thickness ? curves.thickness.front() : 0.0F);
  for (const float value : {0.0F, 1.0F, 1.0F, 1.0F}) put(file, value);  // transparency, colour
  put_text(file, curves.info, kHairInfo);
  for (std::size_t c = 0; c < curves.curve_count(); ++c)
    put(file, static_cast<std::uint16_t>(curves.curve(c).size() - (curves.closed[c] ? 0 : 1)));
  for (std::size_t c = 0; c < curves.curve_count(); ++c) {
    file.write(std::as_bytes(curves.curve(c)));
    if (curves.closed[c]) put(file, curves.curve(c).front());
  }
  for (std::size_t c = 0; has_thickness && c < curves.curve_count(); ++c) {
    const auto thickness =
        std::span(curves.thickness).subspan(curves.first_point[c], curves.curve(c).size());
    file.write(std::as_bytes(thickness));
    if (curves.closed[c]) put(file, thickness.front());
  }
  file.commit();
}

void write_obj_lines(const std::filesystem::path& path, const CurveSet& curves) {
  AtomicFile file(path);
  const auto write = [&file](const std::string& text) {
    file.write(std::as_bytes(std::span(text)));
  };
  if (!curves.info.empty()) write("# " + curves.info + "\n");
  for (const CurvePoint& point : curves.points)
    write(fmt::format("v {} {} {}\n", point[0], point[1], point[2]));
  for (std::size_t c = 0; c < curves.curve_count(); ++c) {
    std::string line = "l";
    for (std::uint64_t p = curves.first_point[c]; p < curves.first_point[c + 1]; ++p)
      line += fmt::format(" {}", p + 1);
    if (curves.closed[c]) line += fmt::format(" {}", curves.first_point[c] + 1);
    write(line + "\n");
  }
  file.commit();
}

}  // namespace

void write_curves(const std::filesystem::path& path, const CurveSet& curves) {
  assert(curves.kind == CurveKind::kPolyline && curves.curve_count() > 0);
  const std::string ending = lower_case_ending(path);
  if (ending == ".bcc") return write_bcc(path, curves);
  if (ending == ".hair") return write_hair(path, curves);
  if (ending == ".obj") return write_obj_lines(path, curves);
  throw FileError(path.string() + ": expected a name that ends in .bcc, .hair or .obj");
}

}  // namespace heddle
