#ifndef HEDDLE_FIBERS_CLOTH_CURVE_EXEMPLAR_H_
#define HEDDLE_FIBERS_CLOTH_CURVE_EXEMPLAR_H_
// A tile of cloth from a file of curves: yarns, which get their fibers by the yarn model, or fibers
// themselves.
//
// A rectangle of the curves becomes the tile. Curves of a periodic set are kept whole, and each
// must end exactly one period on from where it starts. Otherwise curves are cut where they leave
// the rectangle, and every piece inside becomes an open yarn or fiber: it ends at the tile's
// border, where nothing need go on with it. CurveCut says how much was cut. Closed curves that lie
// inside stay whole; both of their ends are one place. The curves' middle height becomes z = 0.
// Tested in tests/fibers/cloth/curve_exemplar_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "fibers/cloth/centre_line.h"
#include "formats/curve_file.h"
#include "formats/toml_table.h"

namespace heddle {

/// What the thicknesses of the file are.
enum class CurveThickness : std::uint8_t { kNone, kRadius, kDiameter };

/// A curve or a piece of one, on the tile [0, width) x [0, height).
struct TileCurve {
  std::size_t curve = 0;  // of the file
  std::vector<Vec3d> points;
  bool is_open = true;
  double thickness = 0;  // mean of its curve's, in the file's unit; 0 without
};

struct CurvesConfig {
  std::filesystem::path file;
  double unit_mm = 0;                      // of the file's coordinates
  UpAxis normal = UpAxis::kZ;              // the file's axis that points out of the face
  std::array<double, 2> from_mm = {0, 0};  // corner of the rectangle, x and y, least values
  std::array<double, 2> size_mm = {0, 0};
  bool periodic = false;
  bool as_yarns = false;
  std::vector<int> sequence;  // as yarns: index into FabricConfig::yarns per curve, repeated
  int fiber = 0;              // as fibers: index into FabricConfig::fibers
  CurveThickness thickness = CurveThickness::kNone;  // as fibers; kNone: that of the fiber

  int yarn_of(std::size_t curve) const { return sequence[curve % sequence.size()]; }
  /// Of a fiber; `own`: that of its [fiber.NAME].
  double radius_mm(const TileCurve& curve, double own) const;
};

double length_of(const TileCurve& curve);

/// Reads [curves] but for the yarns or the fiber.
CurvesConfig read_curves_config(const TomlTable& table);

/// What the rectangle does to the curves.
struct CurveCut {
  double whole_mm = 0;   // length of all curves that reach into the rectangle
  double kept_mm = 0;    // of it, inside
  std::size_t ends = 0;  // ends at the tile's border, which nothing need go on with
};

/// The curves on the tile, in pieces of about segment_mm or less. Errors: FileError as
/// read_curves(), and where a set said to be periodic is not, or no curve reaches into the
/// rectangle.
std::vector<TileCurve> curves_on_tile(const CurvesConfig& config, double segment_mm, CurveCut* cut);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_CURVE_EXEMPLAR_H_
