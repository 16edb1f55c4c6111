#include "fibers/cloth/flyaways.h"

#include <algorithm>
#include <cmath>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

// Draws of a length that must be positive, before its mean is taken instead.
constexpr int kMostDraws = 100;

// A hair that rises by less lies on its ply.
constexpr double kLeastRiseMm = 1e-3;

MeanAndDeviation read_distribution(const TomlTable& table, std::string_view key,
                                   const NumberRange& range) {
  const auto [mean, deviation] = table.number2(key, range);
  if (deviation < 0) table.fail(key, "expected [mean, deviation], a deviation of at least 0");
  return {mean, deviation};
}

double read_rate_per_m(const TomlTable& table) {
  constexpr double kMetresPerMm = 1e-3;
  return kMetresPerMm * table.number("per_m", {.min = 0, .max = 1e5});
}

double draw_above(const MeanAndDeviation& distribution, double least, RandomStream& random) {
  for (int k = 0; k < kMostDraws; ++k) {
    const double value = distribution.draw(random);
    if (value > least) return value;
  }
  return std::max(least, distribution.mean);
}

// 1 in the middle of a place, 0 at its ends and beyond.
double bump(double distance, double half) {
  if (distance >= half) return 0;
  const double c = std::cos(kHalfPi * distance / half);
  return c * c;
}

}  // namespace

double MeanAndDeviation::draw(RandomStream& random) const {
  const double radius = std::sqrt(-2 * std::log(1 - random.uniform_double()));
  return mean + deviation * radius * std::cos(2 * kPi * random.uniform_double());
}

Hairs read_hairs(const TomlTable& table) {
  Hairs hairs;
  hairs.per_mm = read_rate_per_m(table);
  hairs.start_mm = read_distribution(table, "start_mm", {.min = 0, .max = 100});
  hairs.rise_mm = read_distribution(table, "rise_mm", {.min = 0, .max = 100});
  if (hairs.rise_mm.mean < kLeastRiseMm) table.fail("rise_mm", "expected a mean of at least 0.001");
  hairs.along_mm = read_distribution(table, "along_mm", {.min = -100, .max = 100});
  const MeanAndDeviation around = read_distribution(table, "around_deg", {.min = -720, .max = 720});
  hairs.around = {radians(around.mean), radians(around.deviation)};
  return hairs;
}

Loops read_loops(const TomlTable& table) {
  Loops loops;
  loops.per_mm = read_rate_per_m(table);
  loops.height_mm = read_distribution(table, "height_mm", {.min = 0, .max = 100});
  return loops;
}

Slubs read_slubs(const TomlTable& table) {
  Slubs slubs;
  slubs.per_mm = read_rate_per_m(table);
  slubs.length_mm = read_distribution(table, "length_mm", {.min = 0, .max = 1e4});
  slubs.thickness = read_distribution(table, "thickness", {.min = 0, .max = 4});
  return slubs;
}

Neps read_neps(const TomlTable& table) {
  Neps neps;
  neps.per_mm = read_rate_per_m(table);
  neps.diameter_mm = read_distribution(table, "diameter_mm", {.min = 0, .max = 10});
  neps.fibers = static_cast<int>(table.integer("fibers", 1, 200));
  return neps;
}

int draw_count(double expected, RandomStream& random) {
  return static_cast<int>(std::floor(expected + random.uniform_double()));
}

HairArc draw_hair(const Hairs& hairs, double period_mm, RandomStream& random) {
  HairArc arc{};
  arc.start_share = random.uniform_double();
  arc.start_angle = 2 * kPi * random.uniform_double();
  arc.start_mm = draw_above(hairs.start_mm, 0, random);
  arc.rise_mm = draw_above(hairs.rise_mm, kLeastRiseMm, random);
  arc.around = hairs.around.draw(random);
  arc.buried = std::min(1.0, arc.start_mm / arc.rise_mm);
  arc.along = hairs.along_mm.draw(random) / period_mm;
  const double most = 1 / (1 + arc.buried);
  arc.along = std::clamp(arc.along, -most, most);
  return arc;
}

ThicknessProfile::ThicknessProfile(const std::vector<Slubs>& slubs, double period_mm,
                                   RandomStream& random) {
  constexpr double kThinnest = 0.3;
  for (const Slubs& kind : slubs) {
    const int count = draw_count(kind.per_mm * period_mm, random);
    for (int k = 0; k < count; ++k) {
      const double centre = random.uniform_double();
      const double length = draw_above(kind.length_mm, 0, random);
      places_.push_back({centre, std::min(0.5, 0.5 * length / period_mm),
                         draw_above(kind.thickness, kThinnest, random)});
    }
  }
}

double ThicknessProfile::at(double share) const {
  double thickness = 1;
  for (const Place& place : places_) {
    const double apart = share - place.centre_share;
    const double distance = std::abs(apart - std::round(apart));
    thickness *= 1 + (place.thickness - 1) * bump(distance, place.half_share);
  }
  return thickness;
}

}  // namespace heddle
