#ifndef HEDDLE_RENDER_SURFACE_WOVEN_SEGMENT_H_
#define HEDDLE_RENDER_SURFACE_WOVEN_SEGMENT_H_
// The highlight on one visible thread segment: an ellipse that slides with the half vector behind a
// rectangular window.
//
// Frame of a segment, for warp and weft alike: origin at the window's lower left corner, x along
// the weft, y along the warp. `half` is the xy part of the unit half vector. Lengths are in any one
// unit. Irawan and Marschner 2006, equations 2-10. The paper finds the area by five cases, which
// need an ellipse that fits the window. Here it is found edge by edge, for any ellipse and any
// rectangle. If the ellipse fits, both agree to rounding. Tested in
// tests/render/surface/woven_segment_test.cpp, where the five cases are the oracle.

#include "fibers/math/vector.h"

namespace heddle {

using Vec2d = Eigen::Vector2d;

struct WovenSegment {
  Vec2d size;                 // of the window, each > 0
  double semimajor = 0.0;     // >= 0
  double eccentricity = 0.0;  // [0, 1]; 1: the ellipse is a line, its area 0
  double angle = 0.0;         // of the major axis against x, counterclockwise
  // how far the ellipse slides: k = 1 takes a half vector of x = 1 to the window's edge
  Vec2d k = Vec2d::Zero();
  Vec2d shift = Vec2d::Zero();  // of the ellipse against equation 2 (irregular cloth)

  double semiminor() const;
  /// Half the sides of the box around the ellipse.
  Vec2d half_extent() const;
};

struct Rectangle {
  Vec2d min;
  Vec2d max;

  double area() const { return (max - min).prod(); }
};

/// Equation 2.
Vec2d highlight_centre(const WovenSegment& segment, const Vec2d& half);

/// Equations 3-5: is the point in the highlight, its edge included? A step in `point` and in
/// `half`.
bool is_in_highlight(const WovenSegment& segment, const Vec2d& point, const Vec2d& half);

/// Area of the highlight inside a rectangle (min <= max) of the segment's frame; exact, from 0 to
/// the smaller area of the two. A semiminor axis below 1e-12 of the rectangle's diagonal counts as
/// 0. About 0.1 microseconds.
double highlight_area(const WovenSegment& segment, const Vec2d& half, const Rectangle& rectangle);

/// Equation 10: share of the window that the highlight fills.
double highlight_share(const WovenSegment& segment, const Vec2d& half);

/// Two directions of the upper side whose sum is shorter than this look along the cloth from
/// opposite sides. There the models reflect nothing and are not sampled by half vectors, so that
/// nothing overflows.
inline constexpr double kShortestSum = 1e-30;

/// Of the draws of the woven models' sample(), the share that follows the cosine; the rest draw
/// half vectors.
inline constexpr double kCosineShare = 0.5;

/// Direction of the upper side with density cos / pi from two deviates in [0, 1).
Vec3d cosine_direction(double a, double b);

/// F(theta_d) G(wi, wo) / (n . wo): what the highlight reflects, (n . wi) included. F is
/// fresnel_dielectric with the angle between wi and the half vector, G the shadowing of Torrance
/// and Sparrow. 0 unless wi.z > 0 and wo.z > 0.
double highlight_reflectance(const Vec3d& wi, const Vec3d& wo, double ior);

/// xy part of the unit half vector of two directions of the upper side.
Vec2d half_vector(const Vec3d& wi, const Vec3d& wo);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_WOVEN_SEGMENT_H_
