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

/// Weak lobes are left out; all of them together carry less than this share of the light. The
/// visibility of the lobes is itself good to some per cent.
constexpr float kLobesLeftOut = 3e-3F;

/// A lobe of light whose deviation in azimuth is below this (radians of arc) is looked up once.
constexpr float kNarrow = 0.1F;

/// Share of a Gaussian of light about a direction at this signed distance from the edge of
/// visibility that comes through.
float share_within(float distance, float precision) {
  return 0.5F * (1 + std::erf(std::sqrt(0.5F * precision) * distance));
}

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

Rgb SingleScattering::soft(const ShadingPoint& point, const DirectionPair& axis,
                           float sharpness) const {
  assert(lobes_ != nullptr && lobes_->lobes() <= kMaxLobes);
  if (lobes_->sees_nothing[point.segment] != 0) return Rgb::Zero();
  const int lobes = lobes_->lobes();
  const float own = lobes_->sharpness;
  const float angle = float_from_half(lobes_->rotation[point.segment]);
  // lobe axes to fabric space
  const Mat3 turn = Eigen::AngleAxisf(angle, Vec3::UnitZ()).toRotationMatrix();
  const Vec3 light = turn.transpose() * axis.fabric;
  const Half* weights = &lobes_->weights[static_cast<std::size_t>(point.segment) * lobes];

  // Each lobe times the light is again a Gaussian: its sharpness n and the light that it carries.
  std::array<float, kMaxLobes> product_sharpness;
  std::array<float, kMaxLobes> carried;
  float total = 0;
  for (int q = 0; q < lobes; ++q) {
    const float n = (own * lobes_->axes[q] + sharpness * light).norm();
    // n - own - sharpness, without cancellation
    const float exponent =
        -own * sharpness * (lobes_->axes[q] - light).squaredNorm() / (own + sharpness + n);
    product_sharpness[q] = n;
    carried[q] = float_from_half(weights[q]) * std::exp(exponent);
    total += carried[q];
  }

  const BcsdfTable& bcsdf = materials_[point.material];
  const Mat3 to_fiber = frame_about(point.tangent.fabric).transpose();
  const Mat3 lobe_to_fiber = to_fiber * turn;
  const Vec3 wo = to_fiber * point.wo.fabric;
  const float weak = kLobesLeftOut * total / static_cast<float>(lobes);
  Rgb sum = Rgb::Zero();
  for (int q = 0; q < lobes; ++q) {
    if (!(carried[q] > weak)) continue;
    const Vec3 mean = (own * lobes_->axes[q] + sharpness * light) / product_sharpness[q];
    sum += carried[q] * scattered(bcsdf, lobe_to_fiber * mean, product_sharpness[q], wo);
  }
  return sum / (sg_mass(own) * sg_mass(sharpness));
}

Rgb SingleScattering::sharp(const ShadingPoint& point, const DirectionPair& axis,
                            float sharpness) const {
  assert(ssdf_ != nullptr);
  if (ssdf_->sees_nothing[point.segment] != 0) return Rgb::Zero();
  const Mat3 to_fiber = frame_about(point.tangent.world).transpose();
  const Vec3 light = to_fiber * axis.world;
  const Vec3 wo = to_fiber * point.wo.world;
  const BcsdfTable& bcsdf = materials_[point.material];
  if (gamma_ == SgMethod::kPrinted) {
    const float distance = ssdf_->signed_distance(point.segment, axis.fabric);
    return share_within(distance, sharpness) / sg_mass(sharpness) *
           scattered(bcsdf, light, sharpness, wo);
  }
  const Mat3 to_fabric = frame_about(point.tangent.fabric);
  const Vec3 local = to_fabric.transpose() * axis.fabric;
  const float theta = std::asin(std::clamp(local.x(), -1.0F, 1.0F));
  const float phi = std::atan2(local.z(), local.y());
  Rgb sum = Rgb::Zero();
  for (const BcsdfTable::LobeResponse& lobe : bcsdf.sg_scatter_by_lobe(light, sharpness, wo)) {
    if (lobe.value.maxCoeff() > 0)
      sum += lobe.value * visible_share(point.segment, to_fabric, theta, phi, lobe);
  }
  return sum / sg_mass(sharpness);
}

float SingleScattering::visible_share(std::uint32_t segment, const Mat3& to_fabric,
                                      float axis_theta, float axis_phi,
                                      const BcsdfTable::LobeResponse& lobe) const {
  const float theta = std::clamp(axis_theta + lobe.theta_shift, -0.5F * kPif, 0.5F * kPif);
  const float phi = axis_phi + lobe.turn;
  const float cosine = std::cos(theta);
  const auto distance_at = [&](float turn) {
    const Vec3 direction(std::sin(theta), cosine * std::cos(phi + turn),
                         cosine * std::sin(phi + turn));
    return ssdf_->signed_distance(segment, to_fabric * direction);
  };
  const float centre = distance_at(0);
  const float deviation = std::min(1 / std::sqrt(lobe.azimuth_precision), kPif / 2);
  const float width = cosine * deviation;
  if (width < kNarrow) {
    const float variance = 0.5F * (1 / lobe.theta_precision + width * width);
    return share_within(centre, 1 / variance);
  }
  // The distance is taken as linear between three azimuths, and looked up at eight between them.
  using Lanes = Eigen::Array<float, 8, 1>;
  static const Lanes deviations{-1.663F, -0.961F, -0.530F, -0.170F, 0.170F, 0.530F, 0.961F, 1.663F};
  const float reach = deviations[7];
  const float before = distance_at(-reach * deviation);
  const float after = distance_at(reach * deviation);
  float share = 0;
  for (const float x : deviations) {
    const float distance = centre + std::abs(x) / reach * ((x < 0 ? before : after) - centre);
    share += share_within(distance, lobe.theta_precision);
  }
  return share / static_cast<float>(deviations.size());
}

Rgb SingleScattering::scattered(const BcsdfTable& bcsdf, const Vec3& axis, float sharpness,
                                const Vec3& wo) const {
  if (gamma_ == SgMethod::kDefault) return bcsdf.sg_scatter(axis, sharpness, wo);
  return sg_scatter(bcsdf.fiber(), {axis.cast<double>().normalized(), sharpness}, wo.cast<double>(),
                    gamma_)
      .cast<float>();
}

}  // namespace heddle
