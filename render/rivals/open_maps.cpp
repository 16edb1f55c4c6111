#include "render/rivals/open_maps.h"

#include <cmath>

namespace heddle {

OpenMaps::OpenMaps(const SsdfVisibility& ssdf, bool both_sides) : ssdf_(&ssdf) {
  const int n = ssdf.resolution;
  const int rows = both_sides ? n : n / 2;
  for (int row = 0; row < rows; ++row) {
    const double polar = kPi * (row + 0.5) / n;
    const double band = std::cos(kPi * row / n) - std::cos(kPi * (row + 1) / n);
    for (int column = 0; column < n; ++column) {
      const double azimuth = 2 * kPi * (column + 0.5) / n;
      directions_.emplace_back(std::sin(polar) * std::cos(azimuth),
                               std::sin(polar) * std::sin(azimuth), std::cos(polar));
      solid_angles_.push_back(band * 2 * kPi / n);
    }
  }
}

Eigen::MatrixXf OpenMaps::open(std::uint32_t first, std::uint32_t last) const {
  const auto cells = static_cast<Eigen::Index>(directions_.size());
  const Eigen::Index components = ssdf_->components;
  Eigen::MatrixXf coefficients(components, last - first);
  for (std::uint32_t s = first; s < last; ++s) {
    for (Eigen::Index k = 0; k < components; ++k) {
      coefficients(k, s - first) =
          float_from_half(ssdf_->coefficients[s * static_cast<std::size_t>(components) +
                                              static_cast<std::size_t>(k)]);
    }
  }
  // The basis is stored [cell][component]: column by column, a matrix [component, cell].
  const Eigen::Map<const Eigen::MatrixXf> basis(ssdf_->basis.data(), components, cells);
  const Eigen::Map<const Eigen::VectorXf> mean(ssdf_->mean.data(), cells);
  Eigen::MatrixXf distance = basis.transpose() * coefficients;
  distance.colwise() += mean;
  Eigen::MatrixXf open = (distance.array() > 0).cast<float>();
  for (std::uint32_t s = first; s < last; ++s) {
    if (ssdf_->sees_nothing[s] != 0) open.col(s - first).setZero();
  }
  return open;
}

}  // namespace heddle
