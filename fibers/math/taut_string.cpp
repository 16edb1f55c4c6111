#include "fibers/math/taut_string.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <deque>

namespace heddle {
namespace {

struct Knot {
  double x, height;
};

double slope(const Knot& from, const Knot& to) {
  return (to.height - from.height) / (to.x - from.x);
}

/// One side of the funnel: the bound's hull as seen from the apex, nearest point first.
class Hull {
 public:
  /// sign: 1 for the ceiling, whose hull bends upwards; -1 for the floor.
  explicit Hull(double sign) : sign_(sign) {}

  bool empty() const { return points_.empty(); }
  const Knot& front() const { return points_.front(); }
  void clear() { points_.clear(); }
  void pop_front() { points_.pop_front(); }

  /// Adds a point of the bound. Points that it hides from the apex leave.
  void add(const Knot& apex, const Knot& point) {
    while (!points_.empty()) {
      const Knot& before = points_.size() > 1 ? points_[points_.size() - 2] : apex;
      if (sign_ * slope(before, points_.back()) < sign_ * slope(before, point)) break;
      points_.pop_back();
    }
    points_.push_back(point);
  }

 private:
  double sign_;
  std::deque<Knot> points_;
};

/// Fills the heights between two knots of the string; x counts from the pinned point.
void draw(const Knot& from, const Knot& to, std::size_t pin, std::vector<double>& heights) {
  const std::size_t n = heights.size();
  for (auto k = static_cast<std::size_t>(from.x); k <= static_cast<std::size_t>(to.x); ++k) {
    const double t = (static_cast<double>(k) - from.x) / (to.x - from.x);
    heights[(pin + k) % n] = from.height + t * (to.height - from.height);
  }
}

}  // namespace

std::vector<double> taut_string(std::span<const double> floor, std::span<const double> ceiling) {
  assert(floor.size() == ceiling.size() && !floor.empty());
  const std::size_t n = floor.size();
  const auto highest = std::max_element(floor.begin(), floor.end());
  const double lowest = *std::min_element(ceiling.begin(), ceiling.end());
  if (*highest <= lowest) return std::vector<double>(n, std::clamp(0.0, *highest, lowest));

  // The string touches the highest point of the floor: nothing else can hold up its own highest
  // point.
  const auto pin = static_cast<std::size_t>(highest - floor.begin());
  std::vector<double> heights(n);
  Knot apex{0, *highest};
  Hull upper(1);
  Hull lower(-1);
  const auto bend = [&](Hull& hull) {
    draw(apex, hull.front(), pin, heights);
    apex = hull.front();
    hull.pop_front();
  };
  // Adds a point to one hull, and moves the apex along the other where the point lies behind it.
  const auto narrow = [&](Hull& own, Hull& other, double sign, const Knot& point) {
    while (!other.empty() && sign * slope(apex, point) < sign * slope(apex, other.front())) {
      bend(other);
      own.clear();
    }
    own.add(apex, point);
  };
  for (std::size_t k = 1; k <= n; ++k) {
    const double x = static_cast<double>(k);
    const double low = k == n ? *highest : floor[(pin + k) % n];
    const double high = k == n ? *highest : ceiling[(pin + k) % n];
    if (std::isfinite(high)) narrow(upper, lower, 1, {x, high});
    if (std::isfinite(low)) narrow(lower, upper, -1, {x, low});
  }
  // The last point belongs to both bounds; the way to it follows the hull that still bends.
  while (apex.x < static_cast<double>(n)) bend(lower.front().x < upper.front().x ? lower : upper);
  return heights;
}

}  // namespace heddle
