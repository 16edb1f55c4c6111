#include "render/surface/tangent_curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>

namespace heddle {

std::vector<TangentPiece> tangent_distribution(const std::vector<double>& offsets,
                                               const std::vector<double>& lengths) {
  const double total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  assert(offsets.size() == lengths.size() + 1 && total > 0 && "a curve has a length");
  std::map<double, double> atoms;
  std::vector<TangentPiece> ramps;
  std::vector<double> ends;
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    if (lengths[k] == 0) continue;
    const double share = lengths[k] / total;
    if (offsets[k] == offsets[k + 1]) {
      atoms[offsets[k]] += share;
    } else {
      ramps.push_back(
          {std::min(offsets[k], offsets[k + 1]), std::max(offsets[k], offsets[k + 1]), share});
      ends.insert(ends.end(), {offsets[k], offsets[k + 1]});
    }
  }
  std::vector<TangentPiece> pieces;
  for (const auto& [offset, share] : atoms) pieces.push_back({offset, offset, share});
  // Between neighbouring ends the densities of all ramps add.
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    double share = 0;
    for (const TangentPiece& ramp : ramps) {
      if (ramp.begin <= ends[k] && ramp.end >= ends[k + 1]) {
        share += ramp.share * (ends[k + 1] - ends[k]) / (ramp.end - ramp.begin);
      }
    }
    if (share > 0) pieces.push_back({ends[k], ends[k + 1], share});
  }
  // Neighbouring ramps of one density (the two halves of a slope, a slope and its way back) are
  // one.
  for (std::size_t k = atoms.size(); k + 1 < pieces.size();) {
    TangentPiece& here = pieces[k];
    const TangentPiece& next = pieces[k + 1];
    const double density = here.share / (here.end - here.begin);
    const double next_density = next.share / (next.end - next.begin);
    if (here.end == next.begin && std::abs(density - next_density) < 1e-12 * density) {
      here = {here.begin, next.end, here.share + next.share};
      pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    } else {
      ++k;
    }
  }
  return pieces;
}

}  // namespace heddle
