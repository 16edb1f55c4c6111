#include "render/rivals/prt_scattering.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_harmonics.h"
#include "render/multiple_scattering.h"
#include "render/rivals/open_maps.h"

namespace heddle {
namespace {

constexpr int kProductOrder = 2 * PrtScattering::kOrder;
// V, light and incoming harmonic together have degree 20: Gauss's rule needs 11 heights, the
// azimuth 21 steps.
constexpr int kHeights = kProductOrder + 1;
constexpr int kProductAzimuths = 2 * kProductOrder + 1;

/// [coefficient, direction]
Eigen::MatrixXf harmonics_at(int order, const std::vector<Vec3d>& directions) {
  Eigen::MatrixXf values(sh_count(order), static_cast<Eigen::Index>(directions.size()));
  std::vector<double> y(static_cast<std::size_t>(sh_count(order)));
  for (std::size_t k = 0; k < directions.size(); ++k) {
    evaluate_sh(order, directions[k], y.data());
    for (int j = 0; j < sh_count(order); ++j) {
      values(j, static_cast<Eigen::Index>(k)) = static_cast<float>(y[static_cast<std::size_t>(j)]);
    }
  }
  return values;
}

}  // namespace

PrtScattering::PrtScattering(const SsdfVisibility& ssdf, bool both_sides,
                             std::span<const BcsdfTable> materials)
    : materials_(materials) {
  const QuadratureRule heights = gauss_legendre(kHeights, -1, 1);
  std::vector<Vec3d> nodes;
  std::vector<double> node_weights;
  for (std::size_t i = 0; i < heights.nodes.size(); ++i) {
    const double z = heights.nodes[i];
    const double radius = std::sqrt(1 - z * z);
    for (int k = 0; k < kProductAzimuths; ++k) {
      const double azimuth = 2 * kPi * k / kProductAzimuths;
      nodes.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
      node_weights.push_back(heights.weights[i] * 2 * kPi / kProductAzimuths);
    }
  }
  harmonics_ = harmonics_at(kOrder, nodes);

  const OpenMaps maps(ssdf, both_sides);
  // [coefficient, cell]
  Eigen::MatrixXf projection = harmonics_at(kProductOrder, maps.directions());
  for (Eigen::Index cell = 0; cell < projection.cols(); ++cell) {
    projection.col(cell) *= static_cast<float>(maps.solid_angles()[static_cast<std::size_t>(cell)]);
  }
  Eigen::MatrixXf at_nodes = harmonics_at(kProductOrder, nodes);
  for (Eigen::Index node = 0; node < at_nodes.cols(); ++node) {
    at_nodes.col(node) *= static_cast<float>(node_weights[static_cast<std::size_t>(node)]);
  }

  const std::uint32_t segments = maps.segment_count();
  visibility_.resize(static_cast<Eigen::Index>(nodes.size()), segments);
  tbb::parallel_for(std::uint32_t{0}, (segments + OpenMaps::kBatch - 1) / OpenMaps::kBatch,
                    [&](std::uint32_t batch) {
                      const std::uint32_t first = batch * OpenMaps::kBatch;
                      const std::uint32_t last = std::min(segments, first + OpenMaps::kBatch);
                      const Eigen::MatrixXf coefficients = projection * maps.open(first, last);
                      visibility_.middleCols(first, last - first) =
                          at_nodes.transpose() * coefficients;
                    });
}

Eigen::VectorXf PrtScattering::transferred(std::uint32_t segment,
                                           const Eigen::VectorXf& light) const {
  const Eigen::VectorXf at_nodes =
      (harmonics_.transpose() * light).array() * visibility_.col(segment).array();
  return harmonics_ * at_nodes;
}

Rgb PrtScattering::scattered(const ShadingPoint& point, const Eigen::VectorXf& light) const {
  const Eigen::VectorXf incoming = transferred(point.segment, light);
  IncomingField field;
  for (int j = 0; j < sh_count(kOrder); ++j) {
    for (int c = 0; c < 3; ++c) field[static_cast<std::size_t>(3 * j + c)] = incoming[j];
  }
  return outgoing_from_field(kOrder, field, materials_[point.material], point.tangent.fabric,
                             point.wo.fabric);
}

Rgb PrtScattering::directional(const ShadingPoint& point, const DirectionPair& light) const {
  Eigen::VectorXf coefficients(sh_count(kOrder));
  evaluate_sh(kOrder, light.fabric, coefficients.data());
  return scattered(point, coefficients);
}

Rgb PrtScattering::spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                                      float sharpness) const {
  Eigen::VectorXf coefficients(sh_count(kOrder));
  evaluate_sh(kOrder, axis.fabric, coefficients.data());
  const std::vector<double> band = spherical_bessel_ratios(kOrder, sharpness);
  for (int l = 0; l <= kOrder; ++l) {
    coefficients.segment(l * l, 2 * l + 1) *= static_cast<float>(band[static_cast<std::size_t>(l)]);
  }
  return scattered(point, coefficients);
}

}  // namespace heddle
