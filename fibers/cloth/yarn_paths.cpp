#include "fibers/cloth/yarn_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace heddle {
namespace {

// Points per crossing and axis on which the crest height is found; smallest_clearance() on a finer
// grid judges it.
constexpr int kSolveSamples = 65;
// What the grid can miss of the tightest place between its points (measured: 2e-4 of the touching
// height).
constexpr double kGridAllowance = 1.001;
// Crests taller than this many times the touching height mean that the yarns leave no room to pass.
constexpr double kLargestCrestFactor = 3;

// Half height of an elliptic section at a distance from its axis, relative to its half height.
double section(double distance, double half_width) {
  const double u = distance / half_width;
  return std::sqrt(std::max(0.0, 1 - u * u));
}

// The heights at a crossing depend on which yarn lies over there and at the four crossings beside
// it. Yarns are at most as wide as their spacing, so nothing else can matter.
unsigned kind_of_crossing(const Weave& weave, int end, int pick) {
  const auto bit = [&](int e, int p, unsigned value) {
    return weave.is_warp_up(e, p) ? value : 0U;
  };
  return bit(end, pick, 1) | bit(end - 1, pick, 2) | bit(end + 1, pick, 4) | bit(end, pick - 1, 8) |
         bit(end, pick + 1, 16);
}

struct CrossingPoint {
  unsigned kind;  // of the crossing
  double dx, dy;  // from the crossing
  double gap;     // between the two axes; negative where the yarns lie the wrong way round
  double needed;  // by the two sections
};

// Calls f(CrossingPoint) on a grid over one crossing of each kind, all in vertical mm. There are at
// most 2^5 kinds, and all crossings of the tile are copies of these.
template <class F>
void for_each_crossing_point(const FabricConfig& config, const YarnPaths& paths, int samples,
                             F&& f) {
  const double a_warp = 0.5 * config.warp_yarn(0).width_mm;
  const double a_weft = 0.5 * config.weft_yarn(0).width_mm;
  const auto over_crossing = [&](int end, int pick, unsigned kind) {
    const YarnPath& warp = paths.warp[static_cast<std::size_t>(end)];
    const YarnPath& weft = paths.weft[static_cast<std::size_t>(pick)];
    const double sign = config.weave.is_warp_up(end, pick) ? 1 : -1;
    for (int iy = 0; iy < samples; ++iy) {
      const double dy = a_weft * (2.0 * iy / (samples - 1) - 1);
      for (int ix = 0; ix < samples; ++ix) {
        const double dx = a_warp * (2.0 * ix / (samples - 1) - 1);
        f(CrossingPoint{
            kind, dx, dy,
            sign * (warp.height_at(weft.across_mm + dy) - weft.height_at(warp.across_mm + dx)),
            0.5 * (config.warp_yarn(0).height_mm * section(dx, a_warp) +
                   config.weft_yarn(0).height_mm * section(dy, a_weft))});
      }
    }
  };
  std::set<unsigned> known;
  for (int pick = 0; pick < config.weave.picks; ++pick) {
    for (int end = 0; end < config.weave.ends; ++end) {
      const unsigned kind = kind_of_crossing(config.weave, end, pick);
      if (known.insert(kind).second) over_crossing(end, pick, kind);
    }
  }
}

// Smallest gap, to the last bit, at this place of a crossing among all its copies in the tile.
// Rounding is monotonic, so the copies along x and along y need not be paired.
double smallest_gap_of_copies(const FabricConfig& config, const YarnPaths& paths, int end, int pick,
                              const CrossingPoint& point) {
  const double sign = config.weave.is_warp_up(end, pick) ? 1 : -1;
  const auto step_x = static_cast<std::size_t>(config.weave.ends);
  const auto step_y = static_cast<std::size_t>(config.weave.picks);
  double upper = std::numeric_limits<double>::infinity();
  double lower = -upper;
  for (std::size_t p = static_cast<std::size_t>(pick); p < paths.weft.size(); p += step_y) {
    upper = std::min(upper, sign * paths.warp[static_cast<std::size_t>(end)].height_at(
                                       paths.weft[p].across_mm + point.dy));
  }
  for (std::size_t e = static_cast<std::size_t>(end); e < paths.warp.size(); e += step_x) {
    lower = std::max(lower, sign * paths.weft[static_cast<std::size_t>(pick)].height_at(
                                       paths.warp[e].across_mm + point.dx));
  }
  return upper - lower;
}

// By how much crests must be taller than `paths` has them. Heights scale with the crests, so each
// point asks for a smallest factor: needed gap / gap at factor 1. Copies of a crossing ask for the
// same but for their last bits; the largest counts.
double crest_factor(const FabricConfig& config, const YarnPaths& paths) {
  constexpr double kLeastNeed = 1e-9;         // mm
  constexpr double kMoreThanRounding = 1e-9;  // relative
  double factor = 1;
  std::vector<CrossingPoint> points;
  for_each_crossing_point(config, paths, kSolveSamples, [&](const CrossingPoint& point) {
    if (point.needed <= kLeastNeed) return;
    factor = point.gap > 0 ? std::max(factor, point.needed / point.gap) : 2 * kLargestCrestFactor;
    points.push_back(point);
  });
  if (factor > kLargestCrestFactor) return factor;
  std::erase_if(points, [least = factor * (1 - kMoreThanRounding)](const CrossingPoint& point) {
    return point.needed / point.gap < least;
  });
  for (int pick = 0; pick < config.weave.picks; ++pick) {
    for (int end = 0; end < config.weave.ends; ++end) {
      const unsigned kind = kind_of_crossing(config.weave, end, pick);
      for (const CrossingPoint& point : points) {
        if (point.kind != kind) continue;
        factor = std::max(factor,
                          point.needed / smallest_gap_of_copies(config, paths, end, pick, point));
      }
    }
  }
  return factor;
}

}  // namespace

double YarnPath::height_at(double along_mm) const {
  const auto n = static_cast<std::ptrdiff_t>(crest_mm.size());
  const double u = along_mm / crossing_spacing_mm - 0.5;
  const double cell = std::floor(u);
  const auto k = static_cast<std::ptrdiff_t>(cell);
  const double a = crest_mm[static_cast<std::size_t>(((k % n) + n) % n)];
  const double b = crest_mm[static_cast<std::size_t>((((k + 1) % n) + n) % n)];
  return a + (b - a) * 0.5 * (1 - std::cos(kPi * (u - cell)));
}

CentreLine centre_line(const YarnPath& path, double width_mm, double height_mm) {
  // side x up is the direction of the yarn.
  const Vec3d along = path.is_warp ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0);
  const Vec3d across = path.is_warp ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d side = path.is_warp ? Vec3d(-1, 0, 0) : across;
  const double length = path.length_mm();
  return {[=](double share) {
            const Vec3d position = path.across_mm * across + share * length * along +
                                   path.height_at(share * length) * Vec3d(0, 0, 1);
            return YarnPlace{position, side, Vec3d(0, 0, 1), 0.5 * width_mm, 0.5 * height_mm};
          },
          length};
}

YarnPaths lay_yarns(const FabricConfig& config) {
  const int ends = config.weave.ends * config.repeats_x;
  const int picks = config.weave.picks * config.repeats_y;
  YarnPaths paths;
  paths.width_mm = ends * config.warp.spacing_mm;
  paths.height_mm = picks * config.weft.spacing_mm;
  const double touching = 0.5 * (config.warp_yarn(0).height_mm + config.weft_yarn(0).height_mm);
  for (int end = 0; end < ends; ++end) {
    YarnPath yarn{true, (end + 0.5) * config.warp.spacing_mm, config.weft.spacing_mm, picks, {}};
    for (int pick = 0; pick < config.weave.picks; ++pick) {
      yarn.crest_mm.push_back((config.weave.is_warp_up(end, pick) ? 1 : -1) * config.crimp_warp *
                              touching);
    }
    paths.warp.push_back(std::move(yarn));
  }
  for (int pick = 0; pick < picks; ++pick) {
    YarnPath yarn{false, (pick + 0.5) * config.weft.spacing_mm, config.warp.spacing_mm, ends, {}};
    for (int end = 0; end < config.weave.ends; ++end) {
      yarn.crest_mm.push_back((config.weave.is_warp_up(end, pick) ? -1 : 1) *
                              (1 - config.crimp_warp) * touching);
    }
    paths.weft.push_back(std::move(yarn));
  }

  double factor = crest_factor(config, paths);
  if (factor > kLargestCrestFactor) {
    throw std::invalid_argument(
        "warp and weft cannot pass each other without overlapping: make width_mm smaller against "
        "spacing_mm");
  }
  factor *= kGridAllowance;
  for (auto* system : {&paths.warp, &paths.weft}) {
    for (YarnPath& yarn : *system) {
      for (double& crest : yarn.crest_mm) crest *= factor;
    }
  }
  return paths;
}

double smallest_clearance(const FabricConfig& config, const YarnPaths& paths, int samples) {
  double smallest = std::numeric_limits<double>::infinity();
  for_each_crossing_point(config, paths, samples, [&](const CrossingPoint& point) {
    smallest = std::min(smallest, point.gap - point.needed);
  });
  return smallest;
}

}  // namespace heddle
