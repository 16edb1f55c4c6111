#ifndef HEDDLE_TESTS_SUPPORT_WEAVE_OF_EXEMPLAR_H_
#define HEDDLE_TESTS_SUPPORT_WEAVE_OF_EXEMPLAR_H_
// The drawdown back from the fibers of a tile: which yarn lies over which, from mean heights.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/weave.h"

namespace heddle::test {

/// The weave of a tile whose yarns are `ends` warp yarns and then `picks` weft yarns. A crossing is
/// where a yarn meets the mean place of the other. A yarn's height there is the mean of its
/// fibers'.
inline Weave weave_of_exemplar(const Exemplar& exemplar, int ends, int picks) {
  const std::size_t yarns = static_cast<std::size_t>(ends) + static_cast<std::size_t>(picks);
  const auto is_warp = [&](std::size_t yarn) { return yarn < static_cast<std::size_t>(ends); };
  // Mean place of each yarn across its own direction.
  std::vector<double> place(yarns, 0);
  std::vector<double> points(yarns, 0);
  for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
    const std::size_t yarn = exemplar.yarn.at(f);
    if (yarn >= yarns) throw std::runtime_error("a yarn beyond ends and picks");
    for (std::uint32_t p = exemplar.first_point[f]; p < exemplar.first_point[f + 1]; ++p) {
      place[yarn] += is_warp(yarn) ? exemplar.points[p].x() : exemplar.points[p].y();
      points[yarn] += 1;
    }
  }
  for (std::size_t yarn = 0; yarn < yarns; ++yarn) {
    if (points[yarn] == 0) throw std::runtime_error("a yarn without fibers");
    place[yarn] /= points[yarn];
  }
  // [yarn][crossing] sums of heights where fibers pass the places of the other system.
  std::vector<std::vector<double>> height(yarns);
  std::vector<std::vector<double>> passes(yarns);
  for (std::size_t yarn = 0; yarn < yarns; ++yarn) {
    height[yarn].assign(static_cast<std::size_t>(is_warp(yarn) ? picks : ends), 0);
    passes[yarn] = height[yarn];
  }
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    const std::size_t yarn = exemplar.yarn[exemplar.segment_fiber[s]];
    const int axis = is_warp(yarn) ? 1 : 0;
    const double period = is_warp(yarn) ? exemplar.height_mm : exemplar.width_mm;
    const std::size_t first = is_warp(yarn) ? static_cast<std::size_t>(ends) : 0;
    Vec3 a = exemplar.points[exemplar.segment_point[s]];
    Vec3 b = exemplar.points[exemplar.segment_point[s] + 1];
    if (a[axis] > b[axis]) std::swap(a, b);
    for (std::size_t k = 0; k < height[yarn].size(); ++k) {
      // Copies of the place in the periods around.
      for (double at = place[first + k] + period * std::ceil((a[axis] - place[first + k]) / period);
           at < b[axis]; at += period) {
        const double t = (at - a[axis]) / (static_cast<double>(b[axis]) - a[axis]);
        height[yarn][k] += a.z() + t * (b.z() - a.z());
        passes[yarn][k] += 1;
      }
    }
  }
  Weave weave;
  weave.notation = "drawn back";
  weave.ends = ends;
  weave.picks = picks;
  for (int pick = 0; pick < picks; ++pick) {
    for (int end = 0; end < ends; ++end) {
      const auto e = static_cast<std::size_t>(end);
      const auto p = static_cast<std::size_t>(pick);
      const auto w = static_cast<std::size_t>(ends) + p;
      if (passes[e][p] == 0 || passes[w][e] == 0) throw std::runtime_error("yarns that never meet");
      weave.warp_up.push_back(height[e][p] / passes[e][p] > height[w][e] / passes[w][e] ? 1 : 0);
    }
  }
  find_face(weave);
  return weave;
}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_SUPPORT_WEAVE_OF_EXEMPLAR_H_
