#ifndef HEDDLE_FIBERS_CLOTH_KNIT_H_
#define HEDDLE_FIBERS_CLOTH_KNIT_H_
// Weft knits: jersey and 1x1 rib. A yarn runs along x through all loops of its course. Courses
// follow each other along y, and wales, the columns of loops, along x. +z is the face, on which the
// legs of a jersey's loops lie.
//
// The centre line of a loop has the simple form of Crane ("A Simple Parametric Model of Plain-Knit
// Yarns", 2023): with t from 0 to 2 pi over a wale of width w,
//   x = w (t + a sin 2t) / 2 pi,   y = -h cos t,   z = -b cos 2t.
// A rib's wales lie on either side of the middle plane: z = +-b (1 - cos 2t) in turn. There they
// have one tangent where they meet.
//
// Width a, height h and depth b follow from the yarn: the thinnest cloth in which no two places of
// yarn come closer than the yarn is thick. That is searched over a and h, with b the least depth
// for which neighbouring courses clear each other. With four to five diameters to a wale the length
// of yarn in a loop then follows Munden's sqrt(21.6 w c) (1959) within a few percent. Tested in
// tests/fibers/cloth/knit_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/cloth/centre_line.h"
#include "fibers/math/vector.h"
#include "formats/toml_table.h"

namespace heddle {

enum class KnitStructure : std::uint8_t { kJersey, kRib1x1 };

struct KnitConfig {
  KnitStructure structure = KnitStructure::kJersey;
  double wales_per_mm = 0;  // of a rib: on both sides together
  double courses_per_mm = 0;
  int wales = 1;              // in the tile; even in a rib
  int courses = 2;            // in the tile
  std::vector<int> sequence;  // index into FabricConfig::yarns per course, repeated over the tile

  double width_mm() const { return wales / wales_per_mm; }
  double height_mm() const { return courses / courses_per_mm; }
  int yarn_of(int course) const {
    return sequence[static_cast<std::size_t>(course) % sequence.size()];
  }
};

/// Reads [knit] but for the yarns of its courses.
KnitConfig read_knit(const TomlTable& table);

/// The form of all loops of a knit. Lengths in mm.
struct LoopForm {
  KnitStructure structure = KnitStructure::kJersey;
  double wale_mm = 0;
  double course_mm = 0;
  double widening = 0;   // a
  double height_mm = 0;  // h; a loop is twice as high
  double depth_mm = 0;   // b

  /// t: 2 pi per wale; y from the middle of the course.
  Vec3d at(double t) const;
  int wales_of_repeat() const { return structure == KnitStructure::kRib1x1 ? 2 : 1; }
};

/// Smallest distance (mm) between the centre lines of a course and of all others; between places of
/// one yarn that are further apart along it than it takes to turn back (pi / 2 diameters).
/// `samples` points per wale.
double distance_of_courses(const LoopForm& loop, int samples);
double distance_within_course(const LoopForm& loop, double diameter_mm, int samples);

/// Length of yarn in a loop of a relaxed plain knit (mm), after Munden 1959.
double usual_loop_length(const KnitConfig& knit);

/// Length of yarn in one loop, mm.
double loop_length(const LoopForm& loop);

/// The form for yarns of this diameter (mm, the thickest of the knit). Throws
/// std::invalid_argument, with the numbers that would do, where the yarn is too thick for its wales
/// and courses.
LoopForm solve_loop(const KnitConfig& knit, double diameter_mm);

/// The yarn of one course of the tile.
CentreLine centre_line_of_course(const LoopForm& loop, const KnitConfig& knit, int course,
                                 double width_mm, double height_mm);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_KNIT_H_
