#include "fibers/cloth/knit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "fibers/cloth/sampled_line.h"

namespace heddle {
namespace {

constexpr double kWaleTurn = 2 * kPi;  // of t

// Points per wale: of the search, of its last step, and of the centre line.
constexpr int kSearchSamples = 72;
constexpr int kSolveSamples = 360;
constexpr int kLineSamples = 384;

// The search goes over this much of widening and of height in courses. Loops that are wider than
// this run into their neighbours, lower ones no longer reach the next course.
constexpr double kLeastWidening = 0.5;
constexpr double kMostWidening = 1.9;
constexpr double kLeastHeight = 0.6;
constexpr double kMostHeight = 1.3;
constexpr int kSearchSteps = 15;

// Deepest loops looked at, in diameters.
constexpr double kMostDepth = 1.5;

// Yarn turns back on itself within half the circumference of a circle of its diameter.
constexpr double kTurningBack = kPi / 2;

std::vector<Vec3d> loop_points(const LoopForm& loop, int samples, int wales) {
  std::vector<Vec3d> points;
  for (int k = 0; k < samples * wales; ++k) points.push_back(loop.at(kWaleTurn * k / samples));
  return points;
}

// Least depth at which the courses clear each other, or none.
std::optional<double> least_depth(LoopForm loop, double diameter, int samples) {
  double low = 0;
  double high = kMostDepth * diameter;
  loop.depth_mm = high;
  if (distance_of_courses(loop, samples) < diameter) return {};
  for (int step = 0; step < 16; ++step) {
    loop.depth_mm = 0.5 * (low + high);
    (distance_of_courses(loop, samples) < diameter ? low : high) = loop.depth_mm;
  }
  return high;
}

// The shallowest loop on a grid of widenings and heights.
std::optional<LoopForm> search_loop(const LoopForm& start, double diameter) {
  std::optional<LoopForm> best;
  for (int i = 0; i < kSearchSteps; ++i) {
    for (int j = 0; j < kSearchSteps; ++j) {
      LoopForm loop = start;
      const auto between = [](double from, double to, int k) {
        return from + (to - from) * k / (kSearchSteps - 1);
      };
      loop.widening = between(kLeastWidening, kMostWidening, i);
      loop.height_mm = loop.course_mm * between(kLeastHeight, kMostHeight, j);
      // Courses that pass each other without interlocking come close nowhere: two loops must
      // reach over each other by a yarn's thickness on either side.
      if (2 * loop.height_mm < loop.course_mm + diameter) continue;
      const auto depth = least_depth(loop, diameter, kSearchSamples);
      if (!depth || (best && *depth >= best->depth_mm)) continue;
      loop.depth_mm = *depth;
      if (distance_within_course(loop, diameter, kSearchSamples) < diameter) continue;
      best = loop;
    }
  }
  return best;
}

}  // namespace

KnitConfig read_knit(const TomlTable& table) {
  constexpr double kCmPerMm = 0.1;
  KnitConfig knit;
  const bool is_rib = table.choice("structure", {"jersey", "rib 1x1"}) == "rib 1x1";
  knit.structure = is_rib ? KnitStructure::kRib1x1 : KnitStructure::kJersey;
  const NumberRange per_cm{.min = 0.1, .max = 500};
  knit.wales_per_mm = kCmPerMm * table.number("wales_per_cm", per_cm);
  knit.courses_per_mm = kCmPerMm * table.number("courses_per_cm", per_cm);
  knit.wales = static_cast<int>(table.integer("wales", 1, 1000));
  if (is_rib && knit.wales % 2 != 0)
    table.fail("wales", "expected an even number: a rib has wales on either side in turn");
  knit.courses = static_cast<int>(table.integer("courses", 2, 1000));
  return knit;
}

Vec3d LoopForm::at(double t) const {
  const double x = wale_mm * (t + widening * std::sin(2 * t)) / kWaleTurn;
  const double y = -height_mm * std::cos(t);
  if (structure == KnitStructure::kJersey) return {x, y, -depth_mm * std::cos(2 * t)};
  const double wale = std::floor(t / kWaleTurn);
  const double side = wale - 2 * std::floor(wale / 2) == 0 ? 1 : -1;
  return {x, y, side * depth_mm * (1 - std::cos(2 * t))};
}

double distance_of_courses(const LoopForm& loop, int samples) {
  const int repeat = loop.wales_of_repeat();
  const std::vector<Vec3d> points = loop_points(loop, samples, repeat);
  double least = std::numeric_limits<double>::infinity();
  for (int course = 1; course <= 2; ++course) {
    for (int copy = -1; copy <= 1; ++copy) {
      const Vec3d shift(copy * repeat * loop.wale_mm, course * loop.course_mm, 0);
      for (const Vec3d& a : points) {
        for (const Vec3d& b : points) least = std::min(least, (a - b - shift).squaredNorm());
      }
    }
  }
  return std::sqrt(least);
}

double distance_within_course(const LoopForm& loop, double diameter_mm, int samples) {
  const int repeat = loop.wales_of_repeat();
  const std::vector<Vec3d> points = loop_points(loop, samples, repeat + 2);
  std::vector<double> along = {0};
  for (std::size_t k = 1; k < points.size(); ++k)
    along.push_back(along.back() + (points[k] - points[k - 1]).norm());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = static_cast<std::size_t>(samples);
       i < static_cast<std::size_t>(samples * (repeat + 1)); ++i) {
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (std::abs(along[i] - along[j]) < kTurningBack * diameter_mm) continue;
      least = std::min(least, (points[i] - points[j]).squaredNorm());
    }
  }
  return std::sqrt(least);
}

double usual_loop_length(const KnitConfig& knit) {
  constexpr double kMunden = 21.6;
  return std::sqrt(kMunden / (knit.wales_per_mm * knit.courses_per_mm));
}

double loop_length(const LoopForm& loop) {
  double length = 0;
  for (int k = 0; k < kLineSamples; ++k) {
    length += (loop.at(kWaleTurn * (k + 1) / kLineSamples) - loop.at(kWaleTurn * k / kLineSamples))
                  .norm();
  }
  return length;
}

LoopForm solve_loop(const KnitConfig& knit, double diameter_mm) {
  LoopForm start;
  start.structure = knit.structure;
  start.wale_mm = 1 / knit.wales_per_mm;
  start.course_mm = 1 / knit.courses_per_mm;
  auto loop = search_loop(start, diameter_mm);
  // The search's coarse points can miss the tightest place by a little.
  if (loop) {
    const auto depth = least_depth(*loop, diameter_mm, kSolveSamples);
    if (depth) {
      loop->depth_mm = *depth;
      return *loop;
    }
  }
  double fits = 0;
  double too_thick = diameter_mm;
  for (int step = 0; step < 8; ++step) {
    const double middle = 0.5 * (fits + too_thick);
    (search_loop(start, middle) ? fits : too_thick) = middle;
  }
  throw std::invalid_argument(fmt::format(
      "a yarn {:.3g} mm thick cannot be knitted with {:.3g} wales and {:.3g} courses per cm "
      "without "
      "overlapping: make it at most {:.3g} mm thick, or take at most {:.3g} wales and {:.3g} "
      "courses "
      "per cm",
      diameter_mm, 10 * knit.wales_per_mm, 10 * knit.courses_per_mm, fits,
      10 * knit.wales_per_mm * fits / diameter_mm, 10 * knit.courses_per_mm * fits / diameter_mm));
}

CentreLine centre_line_of_course(const LoopForm& loop, const KnitConfig& knit, int course,
                                 double width_mm, double height_mm) {
  std::vector<Vec3d> points;
  for (int k = 0; k <= kLineSamples * knit.wales; ++k) {
    points.push_back(loop.at(kWaleTurn * k / kLineSamples) +
                     Vec3d(0, (course + 0.5) * loop.course_mm, 0));
  }
  return sampled_line(std::move(points), {}, width_mm, height_mm, false);
}

}  // namespace heddle
