#include "fibers/cloth/coarse_fabric.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace heddle {
namespace {

constexpr double kFewestFibers = 3;          // of a ply
constexpr double kThickestOfHeight = 0.125;  // radius over the yarn's height

int fewer(int fibers, double count) {
  return std::max(1, static_cast<int>(std::lround(fibers / count)));
}

/// How many fibers one of the yarn's may stand for.
double most_in_one(const YarnConfig& yarn, double radius_mm) {
  const double thicker = kThickestOfHeight * std::min(yarn.width_mm, yarn.height_mm) / radius_mm;
  return std::max(1.0, std::min(yarn.fibers_per_ply / kFewestFibers, thicker * thicker));
}

}  // namespace

void make_coarse(FabricConfig& config, int count) {
  assert(count >= 2);
  config.segment_mm *= std::sqrt(count);
  std::vector<double> in_one(config.fibers.size(), count);  // by type of fiber
  for (const YarnConfig& yarn : config.yarns) {
    double& most = in_one[static_cast<std::size_t>(yarn.fiber)];
    most = std::min(most, most_in_one(yarn, config.fiber_of(yarn).radius_mm));
  }
  for (YarnConfig& yarn : config.yarns) {
    const double own = in_one[static_cast<std::size_t>(yarn.fiber)];
    yarn.fibers_per_ply = fewer(yarn.fibers_per_ply, own);
    yarn.hairs.per_mm /= own;
    yarn.loops.per_mm /= own;
    if (yarn.neps.fibers > 0) yarn.neps.fibers = fewer(yarn.neps.fibers, own);
  }
  if (config.pile) config.pile->per_mm2 /= in_one[static_cast<std::size_t>(config.pile->fiber)];
  for (std::size_t k = 0; k < config.fibers.size(); ++k)
    config.fibers[k].radius_mm *= std::sqrt(in_one[k]);
}

}  // namespace heddle
