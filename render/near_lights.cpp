#include "render/near_lights.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "render/radiance_picture.h"

namespace heddle {
namespace {

constexpr double kMmPerMetre = 1000;

/// Sharpest Gaussian that stands for a near light; that of configs.
constexpr double kSharpestNearLight = 1e6;

/// Rectangles of a smaller solid angle are sampled by area: nearly the same there, and the
/// spherical rectangle loses digits.
constexpr double kSmallSolidAngle = 1e-3;

/// Below this half diagonal over distance the mean cosine of a rectangle is that of its second
/// moments, with a relative error of the square.
constexpr double kSmallAngle = 0.01;

SeenLight gaussian_seen(const Vec3d& axis, double mean_depth, const Rgb& irradiance) {
  const double sharpness =
      std::min(sg_sharpness_of_mean_depth(std::max(mean_depth, 1e-12)), kSharpestNearLight);
  return {axis.cast<float>(), static_cast<float>(sharpness), irradiance, false};
}

SeenLight dark_seen(const Vec3d& axis) {
  return {axis.cast<float>(), static_cast<float>(kSharpestNearLight), Rgb::Zero(), false};
}

// ---- Spheres

/// The cone in which a point outside sees a sphere.
struct SphereCone {
  Vec3d axis;
  double distance;  // of the centre, mm
  double depth;     // 1 - cosine of its half angle; 0 within the sphere

  double solid_angle() const { return 2 * kPi * depth; }
};

SphereCone cone_of(const Light& sphere, const Vec3d& point) {
  const Vec3d way = sphere.position_mm - point;
  const double distance = way.norm();
  if (distance <= sphere.radius_mm)
    return {distance > 0 ? Vec3d(way / distance) : Vec3d(0, 0, 1), distance, 0};
  const double sine = sphere.radius_mm / distance;
  return {way / distance, distance, sine * sine / (1 + std::sqrt(1 - sine * sine))};
}

/// Distance to the sphere along a direction at 1 - cosine `depth` from the cone's axis.
double distance_at(const SphereCone& cone, double depth, double radius) {
  const double across = cone.distance * std::sqrt(depth * (2 - depth));
  return cone.distance * (1 - depth) - std::sqrt(std::max(0.0, radius * radius - across * across));
}

LightSample sample_sphere_light(const Light& light, const Vec3d& point, RandomStream& random) {
  const SphereCone cone = cone_of(light, point);
  const double depth = cone.depth * random.uniform_double();
  const double azimuth = 2 * kPi * random.uniform_double();
  if (!(cone.depth > 0)) return {cone.axis.cast<float>(), Rgb::Zero(), 1, cone.distance};
  const Mat3d frame = frame_about(cone.axis.cast<float>()).cast<double>();
  const double sine = std::sqrt(depth * (2 - depth));
  const Vec3d direction = (1 - depth) * cone.axis + sine * (std::cos(azimuth) * frame.col(1) +
                                                            std::sin(azimuth) * frame.col(2));
  const double solid_angle = cone.solid_angle();
  return {direction.cast<float>(), static_cast<float>(solid_angle) * light.irradiance,
          static_cast<float>(1 / solid_angle), distance_at(cone, depth, light.radius_mm)};
}

std::optional<MetLight> meet_sphere(const Light& light, const Vec3d& point, const Vec3d& w) {
  const SphereCone cone = cone_of(light, point);
  const double depth = 0.5 * (w - cone.axis).squaredNorm();
  if (!(depth < cone.depth)) return {};
  return MetLight{light.irradiance, static_cast<float>(1 / cone.solid_angle()),
                  distance_at(cone, depth, light.radius_mm)};
}

// ---- Rectangles

/// A rectangle as a point sees it: x along its right, y along its up, z away from the point.
struct SeenRectangle {
  Vec3d right, up;     // unit
  double x0, x1;       // mm, of the sides from the point
  double y0, y1;       // mm
  double height;       // mm, of the point above the rectangle's plane; <= 0: on the dark side
  double solid_angle;  // 0 on the dark side

  std::array<Vec3d, 4> corners() const {
    return {Vec3d(x0, y0, height), Vec3d(x1, y0, height), Vec3d(x1, y1, height),
            Vec3d(x0, y1, height)};
  }
  double area() const { return (x1 - x0) * (y1 - y0); }
  /// Density of sampling of a direction towards a point of it, 1/sr.
  double pdf(double square_distance) const {
    if (solid_angle >= kSmallSolidAngle) return 1 / solid_angle;
    return square_distance * std::sqrt(square_distance) / (area() * height);
  }
};

/// Solid angle of a triangle seen from the origin (van Oosterom and Strackee 1983), from its
/// determinant.
double solid_angle_of(const Vec3d& a, const Vec3d& b, const Vec3d& c, double determinant) {
  const double la = a.norm();
  const double lb = b.norm();
  const double lc = c.norm();
  return 2 * std::atan2(determinant, la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

SeenRectangle seen_rectangle(const Light& light, const Vec3d& point) {
  SeenRectangle seen;
  const double half_width = light.half_right_mm.norm();
  const double half_height = light.half_up_mm.norm();
  seen.right = light.half_right_mm / half_width;
  seen.up = light.half_up_mm / half_height;
  const Vec3d way = light.position_mm - point;
  seen.x0 = way.dot(seen.right) - half_width;
  seen.x1 = way.dot(seen.right) + half_width;
  seen.y0 = way.dot(seen.up) - half_height;
  seen.y1 = way.dot(seen.up) + half_height;
  // right x up is the normal of the side that shines.
  seen.height = -way.dot(seen.right.cross(seen.up));
  seen.solid_angle = 0;
  if (seen.height > 0) {
    const std::array<Vec3d, 4> c = seen.corners();
    const double determinant = seen.height * seen.area();
    seen.solid_angle = solid_angle_of(c[0], c[1], c[2], determinant) +
                       solid_angle_of(c[0], c[2], c[3], determinant);
  }
  return seen;
}

/// World direction (not of unit length) to a place (x, y) of the rectangle.
Vec3d way_to(const SeenRectangle& seen, double x, double y) {
  return x * seen.right + y * seen.up - seen.height * seen.right.cross(seen.up);
}

Rgb radiance_at(const Light& light, const SeenRectangle& seen, double x, double y) {
  if (!light.texture) return light.irradiance;
  return light.irradiance * light.texture->at((x - seen.x0) / (seen.x1 - seen.x0),
                                              (y - seen.y0) / (seen.y1 - seen.y0));
}

/// A place of the rectangle, uniform in solid angle (Urena, Fajardo and King 2013, section 4; z is
/// positive here).
Eigen::Vector2d uniform_in_solid_angle(const SeenRectangle& seen, double u, double v) {
  const double z = seen.height;
  // z of the unit normals of the planes through the point and a side.
  const double below = -seen.y0 / std::hypot(seen.y0, z);
  const double above = seen.y1 / std::hypot(seen.y1, z);
  const double left = -seen.x0 / std::hypot(seen.x0, z);
  const double right = seen.x1 / std::hypot(seen.x1, z);
  // The solid angle is the sum of the four angles between neighbouring planes, less 2 pi. A cut at
  // x keeps the two angles on the left.
  const auto angle = [](double cosine) { return std::acos(std::clamp(-cosine, -1.0, 1.0)); };
  const double on_left = angle(below * left) + angle(above * left);
  const double whole = on_left + angle(below * right) + angle(above * right) - 2 * kPi;
  const double turn = u * whole + 2 * kPi - on_left;
  // The cut at s = x / hypot(x, z) where the two angles on its right sum to `turn`.
  const double f = (std::cos(turn) * below - above) / std::sin(turn);
  const double s = std::clamp(std::copysign(1 / std::sqrt(f * f + below * below), f), -1.0, 1.0);
  const double x = std::clamp(s * z / std::sqrt(std::max(1e-30, 1 - s * s)), seen.x0, seen.x1);
  const double away = std::hypot(x, z);
  const double low = seen.y0 / std::hypot(away, seen.y0);
  const double high = seen.y1 / std::hypot(away, seen.y1);
  const double sine = low + v * (high - low);
  const double y = sine * away / std::sqrt(std::max(1e-30, 1 - sine * sine));
  return {x, std::clamp(y, seen.y0, seen.y1)};
}

LightSample sample_rectangle(const Light& light, const Vec3d& point, RandomStream& random) {
  const SeenRectangle seen = seen_rectangle(light, point);
  const double u = random.uniform_double();
  const double v = random.uniform_double();
  const Eigen::Vector2d place =
      seen.solid_angle >= kSmallSolidAngle
          ? uniform_in_solid_angle(seen, u, v)
          : Eigen::Vector2d(std::lerp(seen.x0, seen.x1, u), std::lerp(seen.y0, seen.y1, v));
  const Vec3d way = way_to(seen, place.x(), place.y());
  const double distance = way.norm();
  const Vec3 direction = (way / std::max(distance, 1e-30)).cast<float>();
  if (!(seen.solid_angle > 0)) return {direction, Rgb::Zero(), 1, distance};
  const double pdf = seen.pdf(way.squaredNorm());
  return {direction, static_cast<float>(1 / pdf) * radiance_at(light, seen, place.x(), place.y()),
          static_cast<float>(pdf), distance};
}

std::optional<MetLight> meet_rectangle(const Light& light, const Vec3d& point, const Vec3d& w) {
  const SeenRectangle seen = seen_rectangle(light, point);
  const double falls = -w.dot(seen.right.cross(seen.up));
  if (!(seen.solid_angle > 0) || !(falls > 0)) return {};
  const double distance = seen.height / falls;
  const double x = distance * w.dot(seen.right);
  const double y = distance * w.dot(seen.up);
  if (x < seen.x0 || x > seen.x1 || y < seen.y0 || y > seen.y1) return {};
  return MetLight{radiance_at(light, seen, x, y), static_cast<float>(seen.pdf(distance * distance)),
                  distance};
}

SeenLight rectangle_from(const Light& light, const Vec3d& point) {
  const SeenRectangle seen = seen_rectangle(light, point);
  const Vec3d way = light.position_mm - point;
  const double square = way.squaredNorm();
  if (!(seen.solid_angle > 0)) return dark_seen(way.normalized());
  Rgb radiance = light.irradiance;
  if (light.texture) radiance *= light.texture->mean(0, 1, 0, 1);
  const Rgb irradiance = static_cast<float>(seen.solid_angle) * radiance;
  const double half_width = 0.5 * (seen.x1 - seen.x0);
  const double half_height = 0.5 * (seen.y1 - seen.y0);
  if (half_width * half_width + half_height * half_height < kSmallAngle * kSmallAngle * square) {
    // Half the variances across the axis, of places spread evenly.
    const Vec3d axis = way / std::sqrt(square);
    const double along_right = axis.dot(seen.right);
    const double along_up = axis.dot(seen.up);
    const double depth = (half_width * half_width * (1 - along_right * along_right) +
                          half_height * half_height * (1 - along_up * along_up)) /
                         (6 * square);
    return gaussian_seen(axis, depth, irradiance);
  }
  // The integral of direction over solid angle: half the sum over the edges of their angles times
  // the unit normals of their planes (Lambert).
  const std::array<Vec3d, 4> c = seen.corners();
  Vec3d moment = Vec3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3d normal = c[k].cross(c[(k + 1) % 4]);
    const double length = normal.norm();
    if (length > 0) moment += 0.5 * std::atan2(length, c[k].dot(c[(k + 1) % 4])) / length * normal;
  }
  const Vec3d axis =
      (moment.x() * seen.right + moment.y() * seen.up - moment.z() * seen.right.cross(seen.up))
          .normalized();
  return gaussian_seen(axis, 1 - moment.norm() / seen.solid_angle, irradiance);
}

}  // namespace

LightSample sample_near_light(const Light& light, const Vec3d& point, RandomStream& random) {
  if (light.type == LightType::kSphere) return sample_sphere_light(light, point, random);
  if (light.type == LightType::kRectangle) return sample_rectangle(light, point, random);
  const SeenLight seen = near_light_from(light, point);
  return {seen.axis, seen.irradiance, 0, (light.position_mm - point).norm()};
}

std::optional<MetLight> meet_near_light(const Light& light, const Vec3d& point,
                                        const Vec3& direction) {
  const Vec3d w = direction.cast<double>();
  if (light.type == LightType::kSphere) return meet_sphere(light, point, w);
  if (light.type == LightType::kRectangle) return meet_rectangle(light, point, w);
  return {};
}

SeenLight near_light_from(const Light& light, const Vec3d& point) {
  if (light.type == LightType::kRectangle) return rectangle_from(light, point);
  if (light.type == LightType::kSphere) {
    const SphereCone cone = cone_of(light, point);
    if (!(cone.depth > 0)) return dark_seen(cone.axis);
    return gaussian_seen(cone.axis, 0.5 * cone.depth,
                         static_cast<float>(cone.solid_angle()) * light.irradiance);
  }
  const Vec3d way = light.position_mm - point;
  const double metres = std::max(way.norm(), 1e-6) / kMmPerMetre;
  return {way.normalized().cast<float>(), 0, light.irradiance / static_cast<float>(metres * metres),
          true};
}

std::vector<Light> split_rectangle(const Light& light,
                                   const std::function<double(const Vec3d&)>& nearest_mm) {
  // A part, by the share of the rectangle that it takes, and the mean depth (as above) under which
  // its wider side is seen at most.
  struct Part {
    double u0, u1, v0, v1;
    bool is_wide;
    double depth;
  };
  const double width = 2 * light.half_right_mm.norm();
  const double height = 2 * light.half_up_mm.norm();
  const auto middle = [&](const Part& part) {
    return Vec3d(light.position_mm + (part.u0 + part.u1 - 1) * light.half_right_mm +
                 (part.v0 + part.v1 - 1) * light.half_up_mm);
  };
  const auto make = [&](double u0, double u1, double v0, double v1) {
    Part part{u0, u1, v0, v1, (u1 - u0) * width >= (v1 - v0) * height, 0};
    const double x = 0.5 * (u1 - u0) * width;
    const double y = 0.5 * (v1 - v0) * height;
    const double distance = std::max(nearest_mm(middle(part)), 1e-6);
    part.depth = (x * x + y * y) / (6 * distance * distance);
    return part;
  };
  std::vector<Part> parts = {make(0, 1, 0, 1)};
  while (static_cast<int>(parts.size()) < light.gaussians) {
    const auto widest = std::max_element(
        parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.depth < b.depth; });
    if (!light.texture && widest->depth * kPartSharpness <= 1) break;
    const Part part = *widest;
    const double u = 0.5 * (part.u0 + part.u1);
    const double v = 0.5 * (part.v0 + part.v1);
    *widest =
        part.is_wide ? make(part.u0, u, part.v0, part.v1) : make(part.u0, part.u1, part.v0, v);
    parts.push_back(part.is_wide ? make(u, part.u1, part.v0, part.v1)
                                 : make(part.u0, part.u1, v, part.v1));
  }
  std::vector<Light> lights;
  for (const Part& part : parts) {
    Light own = light;
    own.position_mm = middle(part);
    own.half_right_mm *= part.u1 - part.u0;
    own.half_up_mm *= part.v1 - part.v0;
    if (light.texture) own.irradiance *= light.texture->mean(part.u0, part.u1, part.v0, part.v1);
    own.texture = nullptr;
    own.gaussians = 1;
    lights.push_back(own);
  }
  return lights;
}

double distance_to_light(const Light& light, const Vec3d& point) {
  const Vec3d way = point - light.position_mm;
  if (light.type == LightType::kSphere) return std::max(0.0, way.norm() - light.radius_mm);
  Vec3d rest = way;
  if (light.type == LightType::kRectangle) {
    for (const Vec3d& half : {light.half_right_mm, light.half_up_mm})
      rest -= std::clamp(way.dot(half) / half.squaredNorm(), -1.0, 1.0) * half;
  }
  return rest.norm();
}

}  // namespace heddle
