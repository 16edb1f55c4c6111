#include "render/single_scattering.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "fibers/math/sampling.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

constexpr int kMaxLobes = 128;

/// Weak lobes are left out; all of them together carry less than this share of the light. The visibility of
/// the lobes is itself good to some per cent.
constexpr float kLeftOut = 3e-3F;

}  // namespace

Rgb SingleScattering::directional(const ShadingPoint& point, const DirectionPair& light) const {
  assert(ssdf_ != nullptr);
  if (!(ssdf_->signed_distance(point.segment, light.fabric) > 0)) return Rgb::Zero();
  const Mat3 frame = frame_about(point.tangent.world);
  const Vec3 wi = frame.transpose() * light.world;
  const float cosine = std::sqrt(std::max(0.0F, 1 - wi.x() * wi.x()));
  return cosine * materials_[point.material].evaluate(wi, frame.transpose() * point.wo.world);
}

Rgb SingleScattering::spherical_gaussian(const ShadingPoint& point, const DirectionPair& axis,
                                         float sharpness) const {
  const float share = std::clamp((sharpness - blend_.from) / (blend_.to - blend_.from), 0.0F, 1.0F);
  if (share <= 0) return soft(point, axis, sharpness);
  if (share >= 1) return sharp(point, axis, sharpness);
  return (1 - share) * soft(point, axis, sharpness) + share * sharp(point, axis, sharpness);
}

Rgb SingleScattering::soft(const ShadingPoint& point, const DirectionPair& axis, float sharpness) const {
  assert(lobes_ != nullptr && lobes_->lobes() <= kMaxLobes);
  if (lobes_->sees_nothing[point.segment] != 0) return Rgb::Zero();
  const int lobes = lobes_->lobes();
  const float own = lobes_->sharpness;
  const float angle = float_from_half(lobes_->rotation[point.segment]);
  const Mat3 turn = Eigen::AngleAxisf(angle, Vec3::UnitZ()).toRotationMatrix();  // lobe axes to fabric space
  const Vec3 light = turn.transpose() * axis.fabric;
  const Half* weights = &lobes_->weights[static_cast<std::size_t>(point.segment) * lobes];

  // Each lobe times the light is again a Gaussian: its sharpness n and the light that it carries.
  std::array<float, kMaxLobes> product_sharpness;
  std::array<float, kMaxLobes> carried;
  float total = 0;
  for (int q = 0; q < lobes; ++q) {
    const float n = (own * lobes_->axes[q] + sharpness * light).norm();
    // n - own - sharpness, without cancellation
    const float exponent = -own * sharpness * (lobes_->axes[q] - light).squaredNorm() / (own + sharpness + n);
    product_sharpness[q] = n;
    carried[q] = float_from_half(weights[q]) * std::exp(exponent);
    total += carried[q];
  }

  const BcsdfTable& bcsdf = materials_[point.material];
  const Mat3 to_fiber = frame_about(point.tangent.fabric).transpose();
  const Mat3 lobe_to_fiber = to_fiber * turn;
  const Vec3 wo = to_fiber * point.wo.fabric;
  const float weak = kLeftOut * total / static_cast<float>(lobes);
  Rgb sum = Rgb::Zero();
  for (int q = 0; q < lobes; ++q) {
    if (!(carried[q] > weak)) continue;
    const Vec3 mean = (own * lobes_->axes[q] + sharpness * light) / product_sharpness[q];
    sum += carried[q] * scattered(bcsdf, lobe_to_fiber * mean, product_sharpness[q], wo);
  }
  return sum / (sg_mass(own) * sg_mass(sharpness));
}

Rgb SingleScattering::sharp(const ShadingPoint& point, const DirectionPair& axis, float sharpness) const {
  assert(ssdf_ != nullptr);
  const float distance = ssdf_->signed_distance(point.segment, axis.fabric);
  const float visible = 0.5F * (1 + std::erf(std::sqrt(0.5F * sharpness) * distance));
  if (!(visible > 0)) return Rgb::Zero();
  const Mat3 to_fiber = frame_about(point.tangent.world).transpose();
  return visible / sg_mass(sharpness) *
         scattered(materials_[point.material], to_fiber * axis.world, sharpness, to_fiber * point.wo.world);
}

Rgb SingleScattering::scattered(const BcsdfTable& bcsdf, const Vec3& axis, float sharpness, const Vec3& wo) const {
  if (gamma_ == SgMethod::kDefault) return bcsdf.sg_scatter(axis, sharpness, wo);
  return sg_scatter(bcsdf.fiber(), {axis.cast<double>().normalized(), sharpness}, wo.cast<double>(), gamma_)
      .cast<float>();
}

}  // namespace heddle
