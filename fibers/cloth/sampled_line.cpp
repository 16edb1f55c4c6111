#include "fibers/cloth/sampled_line.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <utility>

namespace heddle {
namespace {

struct LineSamples {
  std::vector<Vec3d> points;
  std::vector<Vec3d> tangents;
  std::vector<Vec3d> ups;
  std::vector<double> length;  // [point] along the line, mm
  double half_width, half_height;

  YarnPlace at(double share) const {
    const double along = share * length.back();
    const auto above = std::upper_bound(length.begin() + 1, length.end() - 1, along);
    const auto k = static_cast<std::size_t>(above - length.begin());
    const double t = (along - length[k - 1]) / (length[k] - length[k - 1]);
    const auto mixed = [&](const std::vector<Vec3d>& values) {
      return Vec3d((1 - t) * values[k - 1] + t * values[k]);
    };
    const Vec3d tangent = mixed(tangents).normalized();
    const Vec3d side = mixed(ups).cross(tangent).normalized();
    return {mixed(points), side, tangent.cross(side), half_width, half_height};
  }
};

Vec3d without(const Vec3d& v, const Vec3d& direction) {
  return v - v.dot(direction) * direction;
}

}  // namespace

std::vector<Vec3d> tangents_of(std::span<const Vec3d> points, bool is_open) {
  const std::size_t last = points.size() - 1;
  std::vector<Vec3d> tangents;
  for (std::size_t k = 0; k <= last; ++k) {
    Vec3d before = points[k] - points[k > 0 ? k - 1 : 0];
    Vec3d after = points[std::min(k + 1, last)] - points[k];
    if (!is_open && k == 0) before = points[last] - points[last - 1];
    if (!is_open && k == last) after = points[1] - points[0];
    // Each piece's direction counts as much as the other piece is long (exact for a circle).
    const double b = before.norm();
    const double a = after.norm();
    Vec3d mean = (a > 0 ? Vec3d(b * after / a) : before) + (b > 0 ? Vec3d(a * before / b) : after);
    if (mean.norm() < 1e-9 * (a + b)) mean = a > 0 ? after : before;  // it turns right back
    tangents.push_back(mean.normalized());
  }
  return tangents;
}

std::vector<Vec3d> steady_ups(std::span<const Vec3d> points, bool is_open) {
  const std::vector<Vec3d> tangents = tangents_of(points, is_open);
  Vec3d start = without(Vec3d(0, 0, 1), tangents[0]);
  if (start.norm() < 1e-3) start = without(Vec3d(0, 1, 0), tangents[0]);
  std::vector<Vec3d> ups = {start.normalized()};
  std::vector<double> length = {0};
  for (std::size_t k = 1; k < points.size(); ++k) {
    // Reflected in the plane half way to the next point, and then in the one between the tangents.
    const Vec3d step = points[k] - points[k - 1];
    const auto reflected = [](const Vec3d& v, const Vec3d& normal) {
      const double square = normal.squaredNorm();
      return square > 0 ? Vec3d(v - 2 * normal.dot(v) / square * normal) : v;
    };
    const Vec3d up = reflected(ups.back(), step);
    const Vec3d tangent = reflected(tangents[k - 1], step);
    ups.push_back(without(reflected(up, tangents[k] - tangent), tangents[k]).normalized());
    length.push_back(length.back() + step.norm());
  }
  if (is_open) return ups;
  const Vec3d& axis = tangents.back();
  const double turn =
      std::atan2(axis.dot(ups.back().cross(ups.front())), ups.back().dot(ups.front()));
  for (std::size_t k = 0; k < ups.size(); ++k) {
    ups[k] = Eigen::AngleAxisd(turn * length[k] / length.back(), tangents[k]) * ups[k];
  }
  return ups;
}

CentreLine sampled_line(std::vector<Vec3d> points, std::vector<Vec3d> ups, double width_mm,
                        double height_mm, bool is_open) {
  assert(points.size() >= 2 && (ups.empty() || ups.size() == points.size()));
  auto samples = std::make_shared<LineSamples>();
  samples->tangents = tangents_of(points, is_open);
  samples->length.push_back(0);
  for (std::size_t k = 1; k < points.size(); ++k)
    samples->length.push_back(samples->length.back() + (points[k] - points[k - 1]).norm());
  if (ups.empty()) ups.assign(points.size(), Vec3d(0, 0, 1));
  samples->points = std::move(points);
  samples->ups = std::move(ups);
  samples->half_width = 0.5 * width_mm;
  samples->half_height = 0.5 * height_mm;
  const double length = samples->length.back();
  return {[samples](double share) { return samples->at(share); }, length, is_open};
}

}  // namespace heddle
