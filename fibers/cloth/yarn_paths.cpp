#include "fibers/cloth/yarn_paths.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "fibers/math/taut_string.h"
#include "fibers/math/wrapped.h"

namespace heddle {
namespace {

// Samples along a yarn between two crossings, on the mean.
constexpr int kSamplesPerCrossing = 24;
// Sections are laid this much larger, so that what the curve between samples cuts off leaves a gap.
constexpr double kSectionAllowance = 1.01;
// The planes of the crossings are balanced until the largest imbalance of forces falls to this
// share of the largest force, or so many times.
constexpr double kBalance = 2e-3;
constexpr int kMostRounds = 400;
constexpr double kRelaxation = 0.7;
// Yarns that must lie above and below one place by more than this share of their half height jam.
constexpr double kLargestConflict = 0.05;
// Sections are flattened by the forces that were found, and laid again, so many times.
constexpr int kFlatteningRounds = 3;
// Between widened neighbours so much room is left, in half heights of the yarn that passes there.
constexpr double kPassage = 1;
// Places across a yarn at which the yarn that it crosses is measured.
constexpr std::size_t kPlacesAcross = 5;
// A section changes over at least this share of the way from one crossing to the next.
constexpr double kShortestChange = 0.5;
constexpr double kNothing = std::numeric_limits<double>::infinity();

double section(double distance, double half_width, double half_height) {
  const double u = distance / half_width;
  return half_height * std::sqrt(std::max(0.0, 1 - u * u));
}

YarnPlaces places(const FabricConfig& config, const ThreadSystem& system, int count) {
  YarnPlaces result;
  for (int k = 0; k < count; ++k) {
    const double spacing = config.room_mm(system, k);
    result.centre_mm.push_back(result.period_mm + 0.5 * spacing);
    result.spacing_mm.push_back(spacing);
    result.period_mm += spacing;
  }
  return result;
}

/// A yarn's section at one crossing.
struct Section {
  double half_width = 0;
  double half_height = 0;
  double shift = 0;  // of its middle, across the yarn
};

/// How thick the crossed yarn is where a yarn meets it, at the yarn's samples.
struct Bump {
  std::ptrdiff_t first = 0;   // sample; may lie before the repeat or behind it
  std::vector<double> thick;  // [sample from there on]
};

/// The yarns of one system over one repeat, and what is known of them so far.
struct System {
  std::vector<double> centre;  // [yarn] across it
  std::vector<double> room;    // [yarn] its spacing
  std::vector<double> width;   // [yarn] half of the section, as long as nothing changes it
  std::vector<double> height;  // [yarn]
  std::vector<double> yield;   // [yarn] how far contact flattens it
  std::vector<double> spread;  // [yarn] share of the free room beside it that it takes
  double period = 0;           // across all yarns of the repeat
  double tension = 0;
  std::vector<std::vector<double>> heights;    // [yarn][sample]
  std::vector<std::vector<Section>> sections;  // [yarn][crossing]
  std::vector<std::vector<Bump>> bumps;        // [yarn][crossing]
  std::vector<std::vector<double>> force;  // [yarn][crossing] away from the yarn that it crosses
  std::vector<double> conflict;            // [yarn] mm

  std::size_t count() const { return centre.size(); }
};

/// Widens a floor (sign 1) or ceiling (-1) of a periodic line so that nothing steeper is needed to
/// stay clear of it.
void limit_slope(std::vector<double>& bound, double sign, double most_per_sample) {
  const std::size_t n = bound.size();
  const auto follow = [&](std::size_t from, std::size_t to) {
    const double least = sign * bound[from] - most_per_sample;
    if (sign * bound[to] < least) bound[to] = sign * least;
  };
  // Twice around, for what reaches over the seam.
  for (std::size_t k = 0; k < 2 * n; ++k) follow(k % n, (k + 1) % n);
  for (std::size_t k = 2 * n; k > 0; --k) follow(k % n, (k - 1) % n);
}

class Loom {
 public:
  explicit Loom(const FabricConfig& config)
      : weave_(config.weave),
        warp_(system(config, config.warp, weave_.ends)),
        weft_(system(config, config.weft, weave_.picks)) {
    warp_.tension = 1 - config.crimp_warp;
    weft_.tension = config.crimp_warp;
    for (System* own : {&warp_, &weft_}) {
      const System& other = crossed_by(*own);
      own->sections.assign(own->count(), std::vector<Section>(other.count()));
      own->bumps.assign(own->count(), std::vector<Bump>(other.count()));
      own->force.assign(own->count(), std::vector<double>(other.count(), 0.0));
      own->heights.resize(own->count());
      own->conflict.assign(own->count(), 0);
    }
    shape_sections();
    plane_.assign(warp_.count() * weft_.count(), 0);
  }

  void lay() {
    bool yields = false;
    for (const System* own : {&warp_, &weft_}) {
      for (const double yield : own->yield) yields = yields || yield > 0;
    }
    balance();
    for (int round = 0; yields && round < kFlatteningRounds; ++round) {
      shape_sections();
      balance();
    }
  }

  /// By how much some yarn is asked to lie above a place that it must lie below, relative to the
  /// thinnest yarn's half height.
  double conflict() const {
    double largest = 0;
    double thinnest = kNothing;
    for (const System* own : {&warp_, &weft_}) {
      largest = std::max(largest, *std::max_element(own->conflict.begin(), own->conflict.end()));
      thinnest = std::min(thinnest, *std::min_element(own->height.begin(), own->height.end()));
    }
    return largest / thinnest;
  }

  std::vector<std::shared_ptr<const YarnShape>> shapes(bool is_warp) const {
    const System& own = is_warp ? warp_ : weft_;
    std::vector<std::shared_ptr<const YarnShape>> shapes;
    for (std::size_t yarn = 0; yarn < own.count(); ++yarn) {
      YarnShape shape;
      shape.step_mm = step_of(own);
      shape.height_mm = own.heights[yarn];
      for (std::size_t i = 0; i < shape.height_mm.size(); ++i) {
        const Section at = section_at(own, yarn, shape.step_mm * static_cast<double>(i));
        shape.shift_mm.push_back(at.shift);
        shape.half_width_mm.push_back(at.half_width);
        shape.half_height_mm.push_back(at.half_height);
      }
      shapes.push_back(std::make_shared<const YarnShape>(std::move(shape)));
    }
    return shapes;
  }

 private:
  System system(const FabricConfig& config, const ThreadSystem& threads, int of_weave) const {
    const int count = std::lcm(of_weave, static_cast<int>(threads.sequence.size()));
    const YarnPlaces where = places(config, threads, count);
    System result;
    result.centre = where.centre_mm;
    result.room = where.spacing_mm;
    result.period = where.period_mm;
    for (int k = 0; k < count; ++k) {
      const YarnConfig& yarn = config.yarn(threads.yarn_at(k));
      result.width.push_back(0.5 * yarn.width_mm);
      result.height.push_back(0.5 * yarn.height_mm);
      result.yield.push_back(yarn.contact_flattening);
      result.spread.push_back(yarn.spread);
    }
    return result;
  }

  const System& crossed_by(const System& own) const { return &own == &warp_ ? weft_ : warp_; }
  std::size_t samples_of(const System& own) const {
    return kSamplesPerCrossing * crossed_by(own).count();
  }
  double step_of(const System& own) const {
    return crossed_by(own).period / static_cast<double>(samples_of(own));
  }
  bool lies_above(const System& own, std::size_t yarn, std::size_t crossing) const {
    const bool is_warp = &own == &warp_;
    return weave_.is_warp_up(static_cast<int>(is_warp ? yarn : crossing),
                             static_cast<int>(is_warp ? crossing : yarn)) == is_warp;
  }
  double& plane(const System& own, std::size_t yarn, std::size_t crossing) {
    return &own == &warp_ ? plane_[yarn * weft_.count() + crossing]
                          : plane_[crossing * weft_.count() + yarn];
  }

  /// Calls visit(sample, thickness of the crossed yarn) for the samples of a yarn that lie over or
  /// under the yarn of a crossing.
  template <class Visit>
  void for_each_sample(const System& own, std::size_t yarn, std::size_t crossing,
                       Visit&& visit) const {
    const auto samples = static_cast<std::ptrdiff_t>(samples_of(own));
    const Bump& bump = own.bumps[yarn][crossing];
    for (std::size_t k = 0; k < bump.thick.size(); ++k) {
      const std::ptrdiff_t i = bump.first + static_cast<std::ptrdiff_t>(k);
      visit(static_cast<std::size_t>((i + samples) % samples), bump.thick[k]);
    }
  }

  /// Pulls one yarn tight between the planes of its crossings, and finds its forces there.
  void pull(System& own, std::size_t yarn) {
    const System& other = crossed_by(own);
    const std::size_t samples = samples_of(own);
    std::vector<double> floor(samples, -kNothing);
    std::vector<double> ceiling(samples, kNothing);
    for (std::size_t crossing = 0; crossing < other.count(); ++crossing) {
      const bool above = lies_above(own, yarn, crossing);
      const double level = plane(own, yarn, crossing);
      for_each_sample(own, yarn, crossing, [&](std::size_t i, double thick) {
        if (above) {
          floor[i] = std::max(floor[i], level + thick);
        } else {
          ceiling[i] = std::min(ceiling[i], level - thick);
        }
      });
    }
    limit_slope(floor, 1, kSteepestSlope * step_of(own));
    limit_slope(ceiling, -1, kSteepestSlope * step_of(own));
    own.conflict[yarn] = 0;
    for (std::size_t i = 0; i < samples; ++i) {
      if (!(floor[i] > ceiling[i])) continue;
      own.conflict[yarn] = std::max(own.conflict[yarn], floor[i] - ceiling[i]);
      floor[i] = ceiling[i] = 0.5 * (floor[i] + ceiling[i]);
    }
    std::vector<double>& heights = own.heights[yarn];
    heights = taut_string(floor, ceiling);
    for (std::size_t crossing = 0; crossing < other.count(); ++crossing) {
      double bend = 0;
      for_each_sample(own, yarn, crossing, [&](std::size_t i, double) {
        bend += 2 * heights[i] - heights[(i + 1) % samples] - heights[(i + samples - 1) % samples];
      });
      const double sign = lies_above(own, yarn, crossing) ? 1 : -1;
      own.force[yarn][crossing] = std::max(0.0, sign * own.tension * bend / step_of(own));
    }
  }

  /// Moves the planes until both yarns of every crossing press on each other with the same force.
  void balance() {
    const double stiffness =
        4 * (warp_.tension * static_cast<double>(weft_.count()) / weft_.period +
             weft_.tension * static_cast<double>(warp_.count()) / warp_.period);
    double relaxation = kRelaxation;
    double before = kNothing;
    for (int round = 0; round < kMostRounds; ++round) {
      for (System* own : {&warp_, &weft_}) {
        tbb::parallel_for(std::size_t{0}, own->count(),
                          [&](std::size_t yarn) { pull(*own, yarn); });
      }
      double largest = 0;
      double imbalance = 0;
      double mean = 0;
      for (std::size_t end = 0; end < warp_.count(); ++end) {
        for (std::size_t pick = 0; pick < weft_.count(); ++pick) {
          const double by_warp = warp_.force[end][pick];
          const double by_weft = weft_.force[pick][end];
          largest = std::max({largest, by_warp, by_weft});
          imbalance = std::max(imbalance, std::abs(by_warp - by_weft));
          // The warp pushes down where it lies above.
          const double sign = lies_above(warp_, end, pick) ? -1 : 1;
          double& level = plane(warp_, end, pick);
          level += relaxation * sign * (by_warp - by_weft) / stiffness;
          mean += level / static_cast<double>(plane_.size());
        }
      }
      if (imbalance <= kBalance * largest) return;
      // Where little room is left between yarns, the cloth is stiffer than the estimate.
      relaxation = imbalance > before ? 0.5 * relaxation : std::min(kRelaxation, 1.05 * relaxation);
      before = imbalance;
      for (double& level : plane_) level -= mean;
    }
  }

  void shape_sections() {
    shape_sections(warp_);
    shape_sections(weft_);
    find_bumps(warp_);
    find_bumps(weft_);
  }

  /// Each yarn yields by the share of the largest force that presses on it, and spreads into the
  /// room that is free beside it. What it loses in height it gains in width, if there is room.
  void shape_sections(System& own) {
    double largest = 0;
    for (const std::vector<double>& forces : own.force) {
      for (const double force : forces) largest = std::max(largest, force);
    }
    for (std::size_t yarn = 0; yarn < own.count(); ++yarn) {
      for (std::size_t crossing = 0; crossing < crossed_by(own).count(); ++crossing) {
        const double pressed = largest > 0 ? own.force[yarn][crossing] / largest : 0;
        const double flat = 1 - own.yield[yarn] * std::min(1.0, pressed);
        const double width = own.width[yarn];
        const auto reach = [&](int side) {
          const double most = std::max(width, room_beside(own, yarn, crossing, side));
          return std::min(most, std::max(width / flat, width + own.spread[yarn] * (most - width)));
        };
        const double below = reach(-1);
        const double above = reach(1);
        Section& shape = own.sections[yarn][crossing];
        shape.half_width = 0.5 * (below + above);
        shape.half_height = own.height[yarn] * std::min(flat, width / shape.half_width);
        shape.shift = 0.5 * (above - below);
      }
    }
  }

  /// The crossed yarn changes across the width of its crossing: the thickest that it is there
  /// counts.
  void find_bumps(System& own) const {
    const System& other = crossed_by(own);
    const double step = step_of(own);
    for (std::size_t yarn = 0; yarn < own.count(); ++yarn) {
      for (std::size_t crossing = 0; crossing < other.count(); ++crossing) {
        const Section& shape = own.sections[yarn][crossing];
        std::array<Section, kPlacesAcross> crossed;
        double low = kNothing;
        double high = -kNothing;
        for (std::size_t k = 0; k < kPlacesAcross; ++k) {
          const double across =
              shape.half_width * (2.0 * static_cast<double>(k) / (kPlacesAcross - 1) - 1);
          crossed[k] = section_at(other, crossing, own.centre[yarn] + shape.shift + across);
          low = std::min(low, crossed[k].shift - crossed[k].half_width);
          high = std::max(high, crossed[k].shift + crossed[k].half_width);
        }
        const double centre = other.centre[crossing];
        Bump& bump = own.bumps[yarn][crossing];
        bump.first = static_cast<std::ptrdiff_t>(std::ceil((centre + low) / step));
        bump.thick.clear();
        for (std::ptrdiff_t i = bump.first; static_cast<double>(i) * step <= centre + high; ++i) {
          const double distance = static_cast<double>(i) * step - centre;
          double thick = 0;
          for (const Section& at : crossed)
            thick = std::max(thick, section(distance - at.shift, at.half_width, at.half_height));
          bump.thick.push_back(kSectionAllowance * thick);
        }
      }
    }
  }

  /// How far a section may reach from its yarn's axis to one side (-1 or 1). Neighbours on the same
  /// side of the yarn that they cross may touch; else that yarn passes between them.
  double room_beside(const System& own, std::size_t yarn, std::size_t crossing, int side) const {
    const std::size_t n = own.count();
    const std::size_t next = (yarn + (side > 0 ? 1 : n - 1)) % n;
    const bool passes = lies_above(own, yarn, crossing) != lies_above(own, next, crossing);
    const double passage = passes ? kPassage * crossed_by(own).height[crossing] : 0;
    return 0.5 * (own.room[yarn] - passage);
  }

  /// A yarn's section at a distance along it: over the yarns that it crosses that of the crossing,
  /// between them a blend.
  Section section_at(const System& own, std::size_t yarn, double along) const {
    const System& other = crossed_by(own);
    along -= other.period * std::floor(along / other.period);
    const std::size_t n = other.count();
    const auto after_place = std::upper_bound(other.centre.begin(), other.centre.end(), along);
    const auto after = static_cast<std::size_t>(after_place - other.centre.begin());
    const std::size_t before = (after + n - 1) % n;
    const Section& crossed_before = other.sections[before][yarn];
    const Section& crossed_after = other.sections[after % n][yarn];
    const double from = other.centre[before] - (after == 0 ? other.period : 0);
    const double to = other.centre[after % n] + (after == n ? other.period : 0);
    const double begin = from + crossed_before.shift + crossed_before.half_width;
    const double end = to + crossed_after.shift - crossed_after.half_width;
    const double length = std::max(end - begin, kShortestChange * (to - from));
    const double share = std::clamp((along - 0.5 * (begin + end)) / length + 0.5, 0.0, 1.0);
    const double t = 0.5 - 0.5 * std::cos(kPi * share);
    const Section& a = own.sections[yarn][before];
    const Section& b = own.sections[yarn][after % n];
    const auto blend = [t](double x, double y) { return x + t * (y - x); };
    return {blend(a.half_width, b.half_width), blend(a.half_height, b.half_height),
            blend(a.shift, b.shift)};
  }

  const Weave& weave_;
  System warp_;
  System weft_;
  std::vector<double> plane_;  // [end][pick] height of the plane between the two yarns
};

/// The same cloth with other spacings or thicknesses.
FabricConfig scaled(FabricConfig config, double spacing, double thickness) {
  config.warp.spacing_mm *= spacing;
  config.weft.spacing_mm *= spacing;
  for (YarnConfig& yarn : config.yarns) {
    yarn.spacing_mm *= spacing;
    yarn.height_mm *= thickness;
  }
  return config;
}

bool is_jammed(const FabricConfig& config) {
  Loom loom(config);
  loom.lay();
  return loom.conflict() > kLargestConflict;
}

/// The factor nearest to 1 between it and `limit` at which the yarns pass, to 1 %; nothing where
/// that does not do.
template <class Config>
std::optional<double> cure(double limit, Config&& config) {
  if (is_jammed(config(limit))) return {};
  double bad = 1;
  double good = limit;
  while (std::abs(good - bad) > 0.01) {
    const double middle = 0.5 * (good + bad);
    (is_jammed(config(middle)) ? bad : good) = middle;
  }
  return good;
}

[[noreturn]] void fail_jammed(const FabricConfig& config) {
  std::string message = fmt::format(
      "the yarns jam: they would have to climb at more than {:.0f} degrees between their crossings",
      degrees(std::atan(kSteepestSlope)));
  const auto wider = cure(4, [&](double factor) { return scaled(config, factor, 1); });
  const auto thinner = cure(0.05, [&](double factor) { return scaled(config, 1, factor); });
  if (wider)
    message += fmt::format("; they pass with every spacing_mm {:.2f} times as large", *wider);
  if (thinner)
    message += fmt::format("; they pass with every height_mm {:.2f} times as large", *thinner);
  throw std::invalid_argument(message);
}

double at_sample(const std::vector<double>& values, std::ptrdiff_t i) {
  return values[static_cast<std::size_t>(wrapped(i, static_cast<std::ptrdiff_t>(values.size())))];
}

double linear_at(const std::vector<double>& values, double step, double along) {
  const double u = along / step;
  const double cell = std::floor(u);
  const auto i = static_cast<std::ptrdiff_t>(cell);
  const double a = at_sample(values, i);
  return a + (u - cell) * (at_sample(values, i + 1) - a);
}

}  // namespace

YarnPlaces warp_places(const FabricConfig& config) {
  return places(config, config.warp, config.weave.ends * config.repeats_x);
}

YarnPlaces weft_places(const FabricConfig& config) {
  return places(config, config.weft, config.weave.picks * config.repeats_y);
}

double YarnShape::height_at(double along_mm) const {
  // A cubic through the samples with the slopes of their neighbours (Catmull and Rom).
  const double u = along_mm / step_mm;
  const double cell = std::floor(u);
  const auto i = static_cast<std::ptrdiff_t>(cell);
  const double t = u - cell;
  const double p0 = at_sample(height_mm, i - 1);
  const double p1 = at_sample(height_mm, i);
  const double p2 = at_sample(height_mm, i + 1);
  const double p3 = at_sample(height_mm, i + 2);
  return p1 +
         0.5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)));
}

double YarnShape::shift_at(double along_mm) const {
  return linear_at(shift_mm, step_mm, along_mm);
}

double YarnShape::half_width_at(double along_mm) const {
  return linear_at(half_width_mm, step_mm, along_mm);
}

double YarnShape::half_height_at(double along_mm) const {
  return linear_at(half_height_mm, step_mm, along_mm);
}

double YarnShape::crimp() const {
  double sum = 0;
  for (std::size_t i = 0; i < height_mm.size(); ++i)
    sum += std::hypot(step_mm, height_mm[(i + 1) % height_mm.size()] - height_mm[i]);
  return sum / (step_mm * static_cast<double>(height_mm.size())) - 1;
}

CentreLine centre_line(const YarnPath& path) {
  // side x up is the direction of the yarn.
  const Vec3d along = path.is_warp ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0);
  const Vec3d across = path.is_warp ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d side = path.is_warp ? Vec3d(-1, 0, 0) : across;
  return {[=](double share) {
            const double s = share * path.length_mm;
            const Vec3d position = (path.across_mm + path.shape->shift_at(s)) * across + s * along +
                                   path.shape->height_at(s) * Vec3d(0, 0, 1);
            return YarnPlace{position, side, Vec3d(0, 0, 1), path.shape->half_width_at(s),
                             path.shape->half_height_at(s)};
          },
          path.length_mm};
}

YarnPaths lay_yarns(const FabricConfig& config) {
  const double ends = std::lcm(config.weave.ends, static_cast<int>(config.warp.sequence.size()));
  const double picks = std::lcm(config.weave.picks, static_cast<int>(config.weft.sequence.size()));
  if (ends * picks > kMostCrossings) {
    throw std::invalid_argument(fmt::format(
        "a repeat of {} ends x {} picks has {:.3g} crossings, at most {:.3g} can be laid "
        "as one tile: make the pattern of a few base weaves, one fabric each",
        ends, picks, ends * picks, kMostCrossings));
  }
  Loom loom(config);
  loom.lay();
  if (loom.conflict() > kLargestConflict) fail_jammed(config);

  const YarnPlaces warp = warp_places(config);
  const YarnPlaces weft = weft_places(config);
  YarnPaths paths;
  paths.width_mm = warp.period_mm;
  paths.height_mm = weft.period_mm;
  const auto add = [&](bool is_warp, const YarnPlaces& own, double length_mm,
                       std::vector<YarnPath>& system) {
    const std::vector<std::shared_ptr<const YarnShape>> shapes = loom.shapes(is_warp);
    for (std::size_t k = 0; k < own.centre_mm.size(); ++k)
      system.push_back({is_warp, own.centre_mm[k], length_mm, shapes[k % shapes.size()]});
  };
  add(true, warp, weft.period_mm, paths.warp);
  add(false, weft, warp.period_mm, paths.weft);
  return paths;
}

double smallest_clearance(const FabricConfig& config, const YarnPaths& paths, int samples) {
  const auto ends = static_cast<std::size_t>(config.weave.ends);
  const auto picks = static_cast<std::size_t>(config.weave.picks);
  double smallest = kNothing;
  for (std::size_t end = 0; end < ends; ++end) {
    for (std::size_t pick = 0; pick < picks; ++pick) {
      const YarnPath& warp = paths.warp[end];
      const YarnPath& weft = paths.weft[pick];
      const double sign =
          config.weave.is_warp_up(static_cast<int>(end), static_cast<int>(pick)) ? 1 : -1;
      const double width = warp.shape->half_width_at(weft.across_mm);
      const double depth = weft.shape->half_width_at(warp.across_mm);
      const double middle_x = warp.across_mm + warp.shape->shift_at(weft.across_mm);
      const double middle_y = weft.across_mm + weft.shape->shift_at(warp.across_mm);
      for (int iy = 0; iy < samples; ++iy) {
        const double y = middle_y + depth * (2.0 * iy / (samples - 1) - 1);
        for (int ix = 0; ix < samples; ++ix) {
          const double x = middle_x + width * (2.0 * ix / (samples - 1) - 1);
          const double dx = x - warp.across_mm - warp.shape->shift_at(y);
          const double dy = y - weft.across_mm - weft.shape->shift_at(x);
          const double gap = sign * (warp.shape->height_at(y) - weft.shape->height_at(x));
          const double needed =
              section(dx, warp.shape->half_width_at(y), warp.shape->half_height_at(y)) +
              section(dy, weft.shape->half_width_at(x), weft.shape->half_height_at(x));
          smallest = std::min(smallest, gap - needed);
        }
      }
    }
  }
  return smallest;
}

}  // namespace heddle
