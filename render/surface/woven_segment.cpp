#include "render/surface/woven_segment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/surface/fresnel.h"

namespace heddle {
namespace {

double cross(const Vec2d& a, const Vec2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Signed area of the unit disc's sector between two directions.
double sector(const Vec2d& p, const Vec2d& q) {
  return 0.5 * std::atan2(cross(p, q), p.dot(q));
}

// Signed area of the unit disc inside the triangle (0, p, q).
double disc_in_triangle(const Vec2d& p, const Vec2d& q) {
  const Vec2d edge = q - p;
  const double squared_length = edge.squaredNorm();
  // |edge|^2 times (1 - squared distance of the edge's line from the centre), without cancellation
  // on long edges.
  const double distance = cross(p, edge);
  const double discriminant = squared_length - distance * distance;
  if (!(discriminant > 0.0)) return sector(p, q);
  const double root = std::sqrt(discriminant);
  const double along = p.dot(edge);
  const double enter = (-along - root) / squared_length;
  const double leave = (-along + root) / squared_length;
  if (enter >= 1.0 || leave <= 0.0) return sector(p, q);
  const Vec2d first = enter > 0.0 ? Vec2d(p + enter * edge) : p;
  const Vec2d last = leave < 1.0 ? Vec2d(p + leave * edge) : q;
  double area = 0.5 * cross(first, last);
  if (enter > 0.0) area += sector(p, first);
  if (leave < 1.0) area += sector(last, q);
  return area;
}

}  // namespace

double WovenSegment::semiminor() const {
  return semimajor * std::sqrt(std::max(0.0, 1.0 - eccentricity * eccentricity));
}

Vec2d WovenSegment::half_extent() const {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {std::hypot(semimajor * c, semiminor() * s), std::hypot(semimajor * s, semiminor() * c)};
}

Vec2d highlight_centre(const WovenSegment& segment, const Vec2d& half) {
  return 0.5 * segment.size.cwiseProduct(segment.k.cwiseProduct(half) + Vec2d::Ones()) +
         segment.shift;
}

bool is_in_highlight(const WovenSegment& segment, const Vec2d& point, const Vec2d& half) {
  const Vec2d focus = segment.semimajor * segment.eccentricity *
                      Vec2d(std::cos(segment.angle), std::sin(segment.angle));
  const Vec2d from_centre = point - highlight_centre(segment, half);
  return (from_centre - focus).norm() + (from_centre + focus).norm() <= 2.0 * segment.semimajor;
}

double highlight_area(const WovenSegment& segment, const Vec2d& half, const Rectangle& rectangle) {
  const double major = segment.semimajor;
  const double minor = segment.semiminor();
  const double window = rectangle.area();
  if (!(minor > 1e-12 * (rectangle.max - rectangle.min).norm()) || window <= 0.0) return 0.0;
  const double whole = kPi * major * minor;

  const Vec2d centre = highlight_centre(segment, half);
  const Vec2d low = rectangle.min - centre;
  const Vec2d high = rectangle.max - centre;
  const double c = std::cos(segment.angle);
  const double s = std::sin(segment.angle);
  const Vec2d extent(std::hypot(major * c, minor * s), std::hypot(major * s, minor * c));
  if ((low.array() >= extent.array()).any() || (high.array() <= -extent.array()).any()) return 0.0;
  if ((low.array() <= -extent.array()).all() && (high.array() >= extent.array()).all())
    return whole;

  // The rectangle where the ellipse is the unit disc: the inverse of the matrix of equation 6.
  const auto to_disc = [&](double x, double y) {
    return Vec2d((c * x + s * y) / major, (c * y - s * x) / minor);
  };
  const std::array<Vec2d, 4> corner = {to_disc(low.x(), low.y()), to_disc(high.x(), low.y()),
                                       to_disc(high.x(), high.y()), to_disc(low.x(), high.y())};
  if (std::all_of(corner.begin(), corner.end(),
                  [](const Vec2d& p) { return p.squaredNorm() <= 1.0; }))
    return window;
  double area = 0.0;
  for (std::size_t i = 0; i < 4; ++i) area += disc_in_triangle(corner[i], corner[(i + 1) % 4]);
  return std::clamp(major * minor * area, 0.0, std::min(whole, window));
}

double highlight_share(const WovenSegment& segment, const Vec2d& half) {
  const Rectangle window = {Vec2d::Zero(), segment.size};
  return highlight_area(segment, half, window) / window.area();
}

double highlight_reflectance(const Vec3d& wi, const Vec3d& wo, double ior) {
  if (!(wi.z() > 0.0) || !(wo.z() > 0.0)) return 0.0;
  const double sum = (wi + wo).norm();
  if (!(sum > kShortestSum)) return 0.0;
  const double cos_d = std::min(1.0, 0.5 * sum);
  // 2 (n . h) / (wo . h) = 4 (n . wi + n . wo) / |wi + wo|^2; (n . wi) and (n . wo) of G cancel
  // those of the quotient.
  const double facet = 4.0 * (wi.z() + wo.z()) / (sum * sum);
  const double shadowing = std::min({1.0 / wo.z(), facet, facet * (wi.z() / wo.z())});
  return fresnel_dielectric(cos_d, ior) * shadowing;
}

Vec2d half_vector(const Vec3d& wi, const Vec3d& wo) {
  const Vec3d sum = wi + wo;
  const double length = sum.norm();
  return length > kShortestSum ? Vec2d(sum.head<2>() / length) : Vec2d::Zero();
}

Vec3d cosine_direction(double a, double b) {
  const double azimuth = 2.0 * kPi * b;
  return {std::sqrt(a) * std::cos(azimuth), std::sqrt(a) * std::sin(azimuth), std::sqrt(1.0 - a)};
}

}  // namespace heddle
