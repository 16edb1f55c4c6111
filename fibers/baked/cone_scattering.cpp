#include "fibers/baked/cone_scattering.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fibers/scattering/wo_space.h"

namespace heddle {
namespace {

using ConeLanes = BcsdfTable::Lanes;
constexpr int kConeLanes = ConeLanes::SizeAtCompileTime;
constexpr int kAzimuthNodes = 2 * kConeLanes;

// Points on the circle, and the Fourier series there.
struct Circle {
  std::array<float, kAzimuthNodes> cosine;
  std::array<float, kAzimuthNodes> sine;
  Eigen::Matrix<float, kAzimuthNodes, ConeTransfer::kAzimuths> harmonics;

  Circle() {
    for (int n = 0; n < kAzimuthNodes; ++n) {
      const auto at = static_cast<std::size_t>(n);
      const float azimuth = 2 * kPif * (static_cast<float>(n) + 0.5F) / kAzimuthNodes;
      cosine[at] = std::cos(azimuth);
      sine[at] = std::sin(azimuth);
      const auto values = azimuth_harmonics(cosine[at], sine[at]);
      for (int m = 0; m < ConeTransfer::kAzimuths; ++m)
        harmonics(n, m) = values[static_cast<std::size_t>(m)];
    }
  }
};

const Circle& circle() {
  static const Circle points;
  return points;
}

/// Directions on a cone about the bundle, as the fiber sees them.
struct ConeNodes {
  std::array<ConeLanes, 2> theta_i;
  std::array<ConeLanes, 2> cos_turn;
  float theta_o;
};

/// along, across: cosine and sine of the cone's angle to the bundle.
ConeNodes nodes_on(float along, float across, const ConeView& view) {
  const Mat3 turn = wo_space(view.tangent, view.wo) * cone_frame(view.bundle_tangent).transpose();
  const Circle& points = circle();
  ConeNodes nodes;
  for (int n = 0; n < kAzimuthNodes; ++n) {
    const auto at = static_cast<std::size_t>(n);
    const Vec3 w = turn * Vec3(along, across * points.cosine[at], across * points.sine[at]);
    const float from_tangent = std::hypot(w.y(), w.z());
    nodes.theta_i[at / kConeLanes][n % kConeLanes] = std::atan2(w.x(), from_tangent);
    nodes.cos_turn[at / kConeLanes][n % kConeLanes] =
        from_tangent > 0 ? w.y() / from_tangent : 1.0F;
  }
  nodes.theta_o = std::asin(std::clamp(view.wo.dot(view.tangent), -1.0F, 1.0F));
  return nodes;
}

}  // namespace

Rgb scattered_from_cones(const float* cones, const Vec3& axis, float variance, const ConeView& view,
                         const BcsdfTable& bcsdf) {
  const float along = std::clamp(axis.dot(view.bundle_tangent), -1.0F, 1.0F);
  const ConeNodes nodes = nodes_on(along, std::sqrt(1 - along * along), view);
  using Moments = Eigen::Matrix<float, ConeTransfer::kAzimuths, 3, Eigen::RowMajor>;
  Rgb sum = Rgb::Zero();
  for (int width = 0; width < ConeTransfer::kWidths; ++width) {
    const Eigen::Map<const Moments> moments(cones + width * ConeTransfer::kAzimuths * 3);
    const Eigen::Matrix<float, kAzimuthNodes, 3> arriving = circle().harmonics * moments;
    const float total = ConeTransfer::variance_of(width) + variance;
    for (int half = 0; half < 2; ++half) {
      const BcsdfTable::RgbLanes lanes = arriving.middleRows<kConeLanes>(half * kConeLanes).array();
      const auto at = static_cast<std::size_t>(half);
      sum +=
          bcsdf.blurred_scatter(nodes.theta_i[at], nodes.cos_turn[at], nodes.theta_o, total, lanes);
    }
  }
  return (2 * kPif / kAzimuthNodes) * sum;
}

ConeResponse cone_response(float theta, float variance, const ConeView& view,
                           const BcsdfTable& bcsdf) {
  const ConeNodes nodes = nodes_on(std::sin(theta), std::cos(theta), view);
  ConeResponse response;
  for (int width = 0; width < ConeTransfer::kWidths; ++width) {
    const float total = ConeTransfer::variance_of(width) + variance;
    Eigen::Matrix<float, kAzimuthNodes, 3> at_nodes;
    for (int half = 0; half < 2; ++half) {
      const auto at = static_cast<std::size_t>(half);
      at_nodes.middleRows<kConeLanes>(half * kConeLanes) =
          bcsdf.blurred_response(nodes.theta_i[at], nodes.cos_turn[at], nodes.theta_o, total)
              .matrix();
    }
    using Moments = Eigen::Matrix<float, ConeTransfer::kAzimuths, 3, Eigen::RowMajor>;
    Eigen::Map<Moments>(response.data() + width * ConeTransfer::kAzimuths * 3) =
        (2 * kPif / kAzimuthNodes) * circle().harmonics.transpose() * at_nodes;
  }
  return response;
}

}  // namespace heddle
