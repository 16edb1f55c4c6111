#include "fibers/cloth/yarn_paths.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace heddle {
namespace {

// Points per crossing and axis on which the crest height is found; smallest_clearance() on a finer grid judges it.
constexpr int kSolveSamples = 65;
// What the grid can miss of the tightest place between its points (measured: 2e-4 of the touching height).
constexpr double kGridAllowance = 1.001;
// Crests taller than this many times the touching height mean that the yarns leave no room to pass.
constexpr double kLargestCrestFactor = 3;

// Half height of an elliptic section at a distance from its axis, relative to its half height.
double section(double distance, double half_width) {
  const double u = distance / half_width;
  return std::sqrt(std::max(0.0, 1 - u * u));
}

// Calls f(gap between the two axes, gap that the two sections need), vertical, mm, on a grid over every crossing of the tile.
// The gap is negative where the yarns lie the wrong way round.
template <class F>
void for_each_crossing_point(const FabricConfig& config, const YarnPaths& paths, int samples, F&& f) {
  const double a_warp = 0.5 * config.warp.width_mm;
  const double a_weft = 0.5 * config.weft.width_mm;
  for (std::size_t pick = 0; pick < paths.weft.size(); ++pick) {
    for (std::size_t end = 0; end < paths.warp.size(); ++end) {
      const double sign = config.weave.is_warp_up(static_cast<int>(end), static_cast<int>(pick)) ? 1 : -1;
      for (int iy = 0; iy < samples; ++iy) {
        const double dy = a_weft * (2.0 * iy / (samples - 1) - 1);
        for (int ix = 0; ix < samples; ++ix) {
          const double dx = a_warp * (2.0 * ix / (samples - 1) - 1);
          const double gap = sign * (paths.warp[end].height_at(paths.weft[pick].across_mm + dy) -
                                     paths.weft[pick].height_at(paths.warp[end].across_mm + dx));
          f(gap, 0.5 * (config.warp.height_mm * section(dx, a_warp) + config.weft.height_mm * section(dy, a_weft)));
        }
      }
    }
  }
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

YarnPaths lay_yarns(const FabricConfig& config) {
  const int ends = config.weave.ends * config.repeats_x;
  const int picks = config.weave.picks * config.repeats_y;
  YarnPaths paths;
  paths.width_mm = ends * config.warp.spacing_mm;
  paths.height_mm = picks * config.weft.spacing_mm;
  const double touching = 0.5 * (config.warp.height_mm + config.weft.height_mm);
  for (int end = 0; end < ends; ++end) {
    YarnPath yarn{true, (end + 0.5) * config.warp.spacing_mm, config.weft.spacing_mm, {}};
    for (int pick = 0; pick < picks; ++pick) {
      yarn.crest_mm.push_back((config.weave.is_warp_up(end, pick) ? 1 : -1) * config.crimp_warp * touching);
    }
    paths.warp.push_back(std::move(yarn));
  }
  for (int pick = 0; pick < picks; ++pick) {
    YarnPath yarn{false, (pick + 0.5) * config.weft.spacing_mm, config.warp.spacing_mm, {}};
    for (int end = 0; end < ends; ++end) {
      yarn.crest_mm.push_back((config.weave.is_warp_up(end, pick) ? -1 : 1) * (1 - config.crimp_warp) * touching);
    }
    paths.weft.push_back(std::move(yarn));
  }

  // Heights scale with the crests, so each point asks for a smallest factor: needed gap / gap at factor 1.
  double factor = 1;
  for_each_crossing_point(config, paths, kSolveSamples, [&](double gap, double needed) {
    if (needed <= 1e-9) return;
    factor = gap > 0 ? std::max(factor, needed / gap) : 2 * kLargestCrestFactor;
  });
  if (factor > kLargestCrestFactor) {
    throw std::invalid_argument(
        "warp and weft cannot pass each other without overlapping: make width_mm smaller against spacing_mm");
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
  for_each_crossing_point(config, paths, samples,
                          [&](double gap, double needed) { smallest = std::min(smallest, gap - needed); });
  return smallest;
}

}  // namespace heddle
