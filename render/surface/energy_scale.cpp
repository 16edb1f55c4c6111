#include "render/surface/energy_scale.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace heddle {

Vec3d lattice_point(int n) {
  // Roberts' generalised golden ratio of three dimensions: the root of x^4 = x + 1.
  constexpr double kRatio = 1.2207440846057596;
  const auto coordinate = [n](double step) { return std::fmod((n + 0.5) * step, 1.0); };
  return {coordinate(1 / kRatio), coordinate(1 / (kRatio * kRatio)),
          coordinate(1 / (kRatio * kRatio * kRatio))};
}

EnergyScale::EnergyScale(const std::function<double(const Vec3d& w)>& load)
    : load_(kRows * kColumns) {
  tbb::parallel_for(0, kRows * kColumns, [&](int k) {
    const double share = static_cast<double>(k / kColumns) / (kRows - 1);
    const double elevation = std::max(1e-4, kPi / 2 * share * share);
    const double azimuth = 2 * kPi * (k % kColumns) / kColumns;
    const double level = std::cos(elevation);
    load_[static_cast<std::size_t>(k)] =
        load(Vec3d(level * std::cos(azimuth), level * std::sin(azimuth), std::sin(elevation)));
  });
}

double EnergyScale::operator()(const Vec3d& w) const {
  const double elevation = std::asin(std::clamp(w.z(), 0.0, 1.0));
  const double row = std::sqrt(elevation / (kPi / 2)) * (kRows - 1);
  double column = std::atan2(w.y(), w.x()) / (2 * kPi) * kColumns;
  if (column < 0) column += kColumns;
  const int r = std::min(static_cast<int>(row), kRows - 2);
  const int c = static_cast<int>(column);
  const auto at = [&](int i, int j) {
    return load_[static_cast<std::size_t>(i * kColumns + j % kColumns)];
  };
  const double low = std::lerp(at(r, c), at(r, c + 1), column - c);
  const double high = std::lerp(at(r + 1, c), at(r + 1, c + 1), column - c);
  const double load = std::lerp(low, high, row - r);
  return load > kEnergyMargin ? kEnergyMargin / load : 1;
}

}  // namespace heddle
