#ifndef HEDDLE_FORMATS_CURVE_FILE_H_
#define HEDDLE_FORMATS_CURVE_FILE_H_
// Curves of other programs: yarns and fibers as control points of splines.
//   .bcc   Binary Curve Collection (C. Yuksel): uniform Catmull-Rom; with the extensions of A. Qu
//   and
//          D. James cubic B-splines, cubic Bezier curves and polylines
//   .hair  cyHair (C. Yuksel): polylines with thicknesses
//   .obj   lines (elements "l") of Wavefront OBJ
// None of them states a unit. Every count is checked against the file's size before memory is
// taken. Errors: FileError with the place. Tested in tests/formats/curve_file_test.cpp.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace heddle {

using CurvePoint = std::array<float, 3>;

/// How the points of a curve are meant.
enum class CurveKind : std::uint8_t {
  kPolyline,
  // Uniform: from point to point. An open curve starts at its first point and ends at its last: the
  // neighbours beyond are reflected (2 p0 - p1).
  kCatmullRom,
  // Uniform cubic: the curve stays inside its points. An open curve starts at its first point and
  // ends at its last, which count three times.
  kBSpline,
  // Cubic, each piece with its two end points and two handles: 3 n + 1 points, closed 3 n.
  kBezier,
};

enum class UpAxis : std::uint8_t { kX, kY, kZ, kUnknown };

struct CurveSet {
  CurveKind kind = CurveKind::kPolyline;
  UpAxis up = UpAxis::kUnknown;
  std::vector<CurvePoint> points;          // of all curves
  std::vector<std::uint64_t> first_point;  // [curve + 1] curve c owns first_point[c] up to [c + 1]
  std::vector<bool> closed;                // [curve] its last point is followed by its first
  std::vector<float> thickness;            // [point], or empty; a width, if the writer kept to that
  std::string info;                        // free text, UTF-8

  std::size_t curve_count() const { return closed.size(); }
  std::span<const CurvePoint> curve(std::size_t c) const {
    return std::span(points).subspan(first_point[c], first_point[c + 1] - first_point[c]);
  }
  /// Appends a curve.
  void add(std::span<const CurvePoint> curve, bool is_closed);
};

/// Points along curve c, `pieces` per segment between control points (1 for polylines), each of
/// which is hit where the kind goes through it. A closed curve ends with its first point again.
std::vector<CurvePoint> sample_curve(const CurveSet& curves, std::size_t c, int pieces);

/// By the ending of its name: .bcc, .hair or .obj. A curve with too few points for its kind is
/// refused: 2 at least, 3 where it is closed.
CurveSet read_curves(const std::filesystem::path& path);

CurveSet parse_bcc(std::span<const std::byte> bytes, const std::string& name);
CurveSet parse_hair(std::span<const std::byte> bytes, const std::string& name);
/// Lines; all else is left out. A line that ends where it starts is closed. A line of two points
/// that starts where the line before it ended goes on with it.
CurveSet parse_obj_lines(std::string_view text, const std::string& name);

/// Writes atomically by the ending of the name. Polylines only (assert). cyHair has no closed
/// curves and at most 65,536 points per curve: a closed one ends with its first point again, and
/// longer ones are refused. Thicknesses go into cyHair only.
void write_curves(const std::filesystem::path& path, const CurveSet& curves);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_CURVE_FILE_H_
