#include "render/rivals/tsai_shih_scattering.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/fibonacci_axes.h"
#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"
#include "render/rivals/open_maps.h"

namespace heddle {
namespace {

// Lobes that carry less than this share of the light are left out.
constexpr float kTermsLeftOut = 1e-3F;

}  // namespace

TsaiShihScattering::TsaiShihScattering(const SsdfVisibility& ssdf, bool both_sides,
                                       std::span<const BcsdfTable> materials, int terms,
                                       BcsdfFactors::Matrix matrix) {
  for (const BcsdfTable& material : materials)
    factors_.emplace_back(material.fiber(), terms, matrix);
  const int lobes = both_sides ? 2 * kLobesPerHemisphere : kLobesPerHemisphere;
  for (const Vec3d& axis :
       fibonacci_axes(both_sides ? FibonacciSet::kSphere : FibonacciSet::kHemisphere, lobes)) {
    axes_.push_back(axis.cast<float>());
  }

  const OpenMaps maps(ssdf, both_sides);
  const std::size_t cells = maps.directions().size();
  std::vector<std::uint32_t> nearest(cells);
  std::vector<double> area(axes_.size(), 0.0);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const Vec3 w = maps.directions()[cell].cast<float>();
    const auto best =
        std::max_element(axes_.begin(), axes_.end(),
                         [&](const Vec3& a, const Vec3& b) { return a.dot(w) < b.dot(w); });
    nearest[cell] = static_cast<std::uint32_t>(best - axes_.begin());
    area[nearest[cell]] += maps.solid_angles()[cell];
  }
  for (const double a : area) cell_.push_back(static_cast<float>(a) / sg_mass(kSharpness));

  const std::uint32_t segments = maps.segment_count();
  share_.resize(static_cast<std::size_t>(segments) * axes_.size());
  tbb::parallel_for(
      std::uint32_t{0}, (segments + OpenMaps::kBatch - 1) / OpenMaps::kBatch,
      [&](std::uint32_t batch) {
        const std::uint32_t first = batch * OpenMaps::kBatch;
        const std::uint32_t last = std::min(segments, first + OpenMaps::kBatch);
        const Eigen::MatrixXf open = maps.open(first, last);
        std::vector<double> weight(axes_.size());
        for (std::uint32_t s = first; s < last; ++s) {
          std::fill(weight.begin(), weight.end(), 0.0);
          for (std::size_t cell = 0; cell < cells; ++cell) {
            if (open(static_cast<Eigen::Index>(cell), s - first) > 0)
              weight[nearest[cell]] += maps.solid_angles()[cell];
          }
          for (std::size_t q = 0; q < axes_.size(); ++q) {
            share_[s * axes_.size() + q] =
                area[q] > 0 ? static_cast<std::uint8_t>(std::lround(255 * weight[q] / area[q]))
                            : std::uint8_t{0};
          }
        }
      });
}

float TsaiShihScattering::visibility(std::uint32_t segment, const Vec3& direction) const {
  constexpr float kFarthest = 1 - 14 / kSharpness;  // exp(-14)
  const std::uint8_t* share = &share_[segment * axes_.size()];
  float sum = 0;
  for (std::size_t q = 0; q < axes_.size(); ++q) {
    const float cosine = axes_[q].dot(direction);
    if (cosine < kFarthest || share[q] == 0) continue;
    sum += static_cast<float>(share[q]) * cell_[q] * std::exp(kSharpness * (cosine - 1));
  }
  return sum / 255;
}

Rgb TsaiShihScattering::directional(const ShadingPoint& point, const DirectionPair& light) const {
  const Mat3 to_fiber = frame_about(point.tangent.fabric).transpose();
  const float visible = visibility(point.segment, light.fabric);
  return visible *
         factors_[point.material].value(to_fiber * light.fabric, to_fiber * point.wo.fabric);
}

Rgb TsaiShihScattering::spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                                           float sharpness) const {
  const std::uint8_t* share = &share_[point.segment * axes_.size()];
  std::vector<float> carried(axes_.size());
  float most = 0;
  for (std::size_t q = 0; q < axes_.size(); ++q) {
    const float n = (kSharpness * axes_[q] + sharpness * axis.fabric).norm();
    const float exponent = -kSharpness * sharpness * (axes_[q] - axis.fabric).squaredNorm() /
                           (kSharpness + sharpness + n);
    carried[q] = static_cast<float>(share[q]) / 255 * cell_[q] * std::exp(exponent);
    most = std::max(most, carried[q]);
  }
  const Mat3 to_fiber = frame_about(point.tangent.fabric).transpose();
  const Vec3 wo = to_fiber * point.wo.fabric;
  Rgb sum = Rgb::Zero();
  for (std::size_t q = 0; q < axes_.size(); ++q) {
    if (!(carried[q] > kTermsLeftOut * most)) continue;
    const Vec3 product = kSharpness * axes_[q] + sharpness * axis.fabric;
    const float n = product.norm();
    sum += carried[q] * factors_[point.material].response(to_fiber * (product / n), n, wo);
  }
  return sum / sg_mass(sharpness);
}

}  // namespace heddle
