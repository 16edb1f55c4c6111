#ifndef HEDDLE_FIBERS_CLOTH_SAMPLED_LINE_H_
#define HEDDLE_FIBERS_CLOTH_SAMPLED_LINE_H_
// Centre lines through points close to each other: of knitted loops and of curves from files.
// Tested in tests/fibers/cloth/sampled_line_test.cpp.

#include <span>
#include <vector>

#include "fibers/cloth/centre_line.h"

namespace heddle {

/// Unit tangents of a polyline at its points, by central differences. One that goes on in the next
/// tile (not open) has the same tangent at both ends.
std::vector<Vec3d> tangents_of(std::span<const Vec3d> points, bool is_open);

/// Per point a unit vector across the tangent that turns about it as little as possible (double
/// reflection: Wang, Juettler, Zheng, Liu 2008), starting as close to +z as it can. Of a line that
/// goes on, what it would turn by over the period is taken back evenly, so that both ends agree.
std::vector<Vec3d> steady_ups(std::span<const Vec3d> points, bool is_open);

/// The centre line through at least 2 points, none equal to its neighbour, in shares of its length.
/// `ups`: about across the line, one per point; empty: +z, for lines that nowhere run straight up.
/// The last point of a line that goes on is its first, one period on.
CentreLine sampled_line(std::vector<Vec3d> points, std::vector<Vec3d> ups, double width_mm,
                        double height_mm, bool is_open);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_SAMPLED_LINE_H_
