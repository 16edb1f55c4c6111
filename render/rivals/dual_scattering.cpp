#include "render/rivals/dual_scattering.h"

#include <algorithm>
#include <cmath>

#include "fibers/math/sampling.h"
#include "fibers/math/special_functions.h"

namespace heddle {
namespace {

// Deviations for which Gn is tabulated: a tenth of a degree to 90 degrees, where a lobe is all but
// even.
constexpr float kLeastDeviation = 0.1F * kPif / 180;
constexpr float kMostDeviation = kPif / 2;

// A ray that still carries less than this share is not followed on.
constexpr float kTooLittle = 1e-5F;
constexpr float kLeastStep = 1e-3F;  // radii between two surfaces on a ray

// cos^2(theta) in f_back, near the tangent: keeps the quotient with cos(theta_d) finite.
constexpr float kLeastCos2 = 1e-4F;

float inclination(const Vec3& tangent, const Vec3& w) {
  return std::asin(std::clamp(tangent.dot(w), -1.0F, 1.0F));
}

/// Integrals of the normalised TT azimuth, from -pi to pi around straight on, on a fine grid: [0] =
/// 0, last 1.
std::vector<double> azimuth_distribution(double gamma, int steps) {
  const double k = 1 / (gamma * gamma);
  std::vector<double> sum(static_cast<std::size_t>(steps) + 1, 0.0);
  for (int i = 0; i < steps; ++i) {
    const double x = -kPi + 2 * kPi * (i + 0.5) / steps;
    const double s = std::sin(0.5 * x);
    sum[static_cast<std::size_t>(i) + 1] =
        sum[static_cast<std::size_t>(i)] + std::exp(-2 * k * s * s);
  }
  for (double& value : sum) value /= sum.back();
  return sum;
}

Rgb gaussian(float x, const Rgb& variance) {
  return (-0.5F * x * x / variance).exp() / (2 * kPif * variance).sqrt();
}

}  // namespace

Rgb DualScattering::Material::fresnel(float theta) const {
  return color_r +
         (1 - color_r) * static_cast<float>(schlick_weight(std::cos(static_cast<double>(theta))));
}

DualScattering::DualScattering(const TileScene& tile, std::span<const BcsdfTable> materials)
    : tile_(&tile), tables_(materials) {
  for (const BcsdfTable& table : materials) {
    const FiberScattering& fiber = table.fiber();
    Material material;
    material.color_r = fiber.isotropic_white ? Rgb::Ones() : Rgb(fiber.color_r.cast<float>());
    material.color_tt = fiber.isotropic_white ? Rgb::Zero() : Rgb(fiber.color_tt.cast<float>());
    material.beta_r = fiber.isotropic_white ? kMostDeviation : static_cast<float>(fiber.beta_r);
    material.beta_tt = fiber.isotropic_white ? kMostDeviation : static_cast<float>(fiber.beta_tt);
    // Steps of 0.05 degrees; a front half is a quarter of them to each side.
    constexpr int kFine = 7200;
    const std::vector<double> share =
        azimuth_distribution(fiber.isotropic_white ? 1.0 : fiber.gamma_tt, kFine);
    material.straight_on = static_cast<float>(share[3 * kFine / 4] - share[kFine / 4]);
    for (int i = 0; i <= kAzimuthSteps; ++i) {
      // Light comes from phi_d - pi/2 .. phi_d + pi/2; straight on is pi further.
      // of phi_o - phi_i at phi_i = phi_d, from -pi
      const int centre = kFine / 2 + i * (kFine / 2) / kAzimuthSteps;
      double inside = 0;
      // phi_o - phi_i - pi over the window, wrapped to the grid of the distribution.
      const int low = centre - kFine / 2 - kFine / 4;
      const int high = centre - kFine / 2 + kFine / 4;
      const auto cumulative = [&](int step) {
        const int turns = static_cast<int>(std::floor(static_cast<double>(step) / kFine));
        return turns + share[static_cast<std::size_t>(step - turns * kFine)];
      };
      inside = cumulative(high) - cumulative(low);
      material.mean_azimuth[static_cast<std::size_t>(i)] = static_cast<float>(inside / kPi);
    }
    materials_.push_back(material);
  }
  const double ratio = std::log(static_cast<double>(kMostDeviation / kLeastDeviation));
  for (int t = 0; t <= kThetaSteps; ++t) {
    for (int d = 0; d <= kDeviationSteps; ++d) {
      const double deviation = kLeastDeviation * std::exp(ratio * d / kDeviationSteps);
      cos2_mean_.push_back(
          static_cast<float>(gaussian_cos2_mean(0.5 * kPi * t / kThetaSteps, deviation)));
    }
  }
}

float DualScattering::longitudinal(float theta_i, float theta_o, float variance) const {
  const float deviation = std::clamp(std::sqrt(variance), kLeastDeviation, kMostDeviation);
  const float row =
      std::min(std::abs(theta_i) * (2 * kThetaSteps / kPif), static_cast<float>(kThetaSteps));
  const float column = std::log(deviation / kLeastDeviation) *
                       (kDeviationSteps / std::log(kMostDeviation / kLeastDeviation));
  const int r = std::min(static_cast<int>(row), kThetaSteps - 1);
  const int c = std::clamp(static_cast<int>(column), 0, kDeviationSteps - 1);
  const float u = row - static_cast<float>(r);
  const float v = column - static_cast<float>(c);
  const float* at = &cos2_mean_[static_cast<std::size_t>(r * (kDeviationSteps + 1) + c)];
  const float mean = (1 - u) * ((1 - v) * at[0] + v * at[1]) +
                     u * ((1 - v) * at[kDeviationSteps + 1] + v * at[kDeviationSteps + 2]);
  const float x = (theta_i + theta_o) / deviation;
  return std::exp(-0.5F * x * x) / (std::sqrt(2 * kPif) * deviation * mean);
}

DualScattering::Averages DualScattering::averages(std::uint16_t index, float theta) const {
  const Material& material = materials_[index];
  const Rgb fresnel = material.fresnel(theta);
  const Rgb half_r = 0.5F * fresnel;
  const Rgb tt = (1 - fresnel) * material.color_tt;
  const Rgb forward_tt = material.straight_on * tt;
  const Rgb backward_tt = (1 - material.straight_on) * tt;
  const float variance_r = material.beta_r * material.beta_r;
  const float variance_tt = material.beta_tt * material.beta_tt;
  const auto mean_variance = [&](const Rgb& r, const Rgb& t) -> Rgb {
    const Rgb sum = r + t;
    // Near the tangent plane a channel without colour reflects next to nothing; quotients of such
    // numbers are no mean.
    constexpr float kNothing = 1e-30F;
    return (sum > kNothing)
        .select((variance_r * r + variance_tt * t) / sum.max(kNothing), variance_r);
  };
  return {half_r + forward_tt, half_r + backward_tt, mean_variance(half_r, forward_tt),
          mean_variance(half_r, backward_tt)};
}

DualScattering::Backscattering DualScattering::backscattering(const Averages& averages) {
  const Rgb& a_b = averages.backward;
  const Rgb a_f2 = averages.forward.square();
  const Rgb lost = (1 - a_f2).max(1e-7F);
  const Rgb a_b3 = a_b.cube();
  Backscattering result;
  result.attenuation = a_b * a_f2 / lost + a_b3 * a_f2 / lost.cube();
  const Rgb beta_f = averages.forward_variance.sqrt();
  const Rgb beta_b = averages.backward_variance.sqrt();
  // Divided by a_b, so that nothing is 0 / 0 where nothing comes back.
  const Rgb a_b2 = a_b.square();
  result.deviation = (1 + a_f2) *
                     ((2 * beta_f.square() + beta_b.square()).sqrt() +
                      a_b2 * (2 * beta_f.square() + 3 * beta_b.square()).sqrt()) /
                     (1 + a_b2 * (2 * beta_f + 3 * beta_b));
  return result;
}

DualScattering::Passage DualScattering::passage(const Vec3& position, std::uint32_t segment,
                                                const Vec3& direction) const {
  const Exemplar& exemplar = tile_->exemplar();
  Passage result;
  Vec3 origin = position;
  std::uint32_t own = exemplar.segment_fiber[segment];
  while (result.transmittance.maxCoeff() > kTooLittle) {
    const std::optional<FiberHit> hit = tile_->intersect({origin, direction}, own);
    if (!hit) break;
    own = exemplar.segment_fiber[hit->segment];
    // At least a little: where two fibers cross each other's surface, each would be met from the
    // other's for ever.
    origin += std::max(hit->t, kLeastStep * exemplar.radius_mm[own]) * direction;
    // Where fibers overlap, the ray meets one from inside: it has been counted already.
    const Vec3 tangent = exemplar.segment_tangent(hit->segment);
    Vec3 from_axis = origin - exemplar.segment_midpoint(hit->segment);
    from_axis.x() -= exemplar.width_mm * std::round(from_axis.x() / exemplar.width_mm);
    from_axis.y() -= exemplar.height_mm * std::round(from_axis.y() / exemplar.height_mm);
    from_axis -= from_axis.dot(tangent) * tangent;
    if (from_axis.dot(direction) > 0) continue;
    const Averages average =
        averages(exemplar.segment_material(hit->segment), inclination(tangent, direction));
    ++result.fibers;
    result.transmittance *= average.forward;
    result.variance += average.forward_variance;
  }
  return result;
}

Rgb DualScattering::spread_scattering(std::uint16_t index, float theta_d, float theta_o,
                                      float delta_phi, const Rgb& variance) const {
  const Material& material = materials_[index];
  const Rgb fresnel = material.fresnel(theta_d);
  const float place = std::abs(std::remainder(delta_phi, 2 * kPif)) * (kAzimuthSteps / kPif);
  const int step = std::min(static_cast<int>(place), kAzimuthSteps - 1);
  const float share = place - static_cast<float>(step);
  const auto at = static_cast<std::size_t>(step);
  const float mean_azimuth =
      (1 - share) * material.mean_azimuth[at] + share * material.mean_azimuth[at + 1];
  Rgb result;
  for (int c = 0; c < 3; ++c) {
    const float r = longitudinal(theta_d, theta_o, material.beta_r * material.beta_r + variance[c]);
    const float tt =
        longitudinal(theta_d, theta_o, material.beta_tt * material.beta_tt + variance[c]);
    result[c] =
        fresnel[c] * r / (2 * kPif) + (1 - fresnel[c]) * material.color_tt[c] * tt * mean_azimuth;
  }
  return result;
}

DualScattering::Parts DualScattering::directional(const ShadingPoint& point, const Vec3& position,
                                                  const DirectionPair& light) const {
  const Mat3 to_fiber = frame_about(point.tangent.world).transpose();
  const Vec3 wi = to_fiber * light.world;
  const Vec3 wo = to_fiber * point.wo.world;
  const float theta_d = std::asin(std::clamp(wi.x(), -1.0F, 1.0F));
  const float theta_o = std::asin(std::clamp(wo.x(), -1.0F, 1.0F));
  const float delta_phi =
      std::remainder(std::atan2(wo.z(), wo.y()) - std::atan2(wi.z(), wi.y()), 2 * kPif);
  const float cosine = std::cos(theta_d);

  const Passage way = passage(position, point.segment, light.fabric);
  const Backscattering back = backscattering(averages(point.material, theta_d));
  const float half = std::cos(0.5F * (theta_o - theta_d));
  const Rgb lobe = 2 * back.attenuation *
                   gaussian(theta_o + theta_d, back.deviation.square() + way.variance) /
                   (kPif * std::max(half * half, kLeastCos2));
  Parts parts;
  if (way.fibers == 0) {
    parts.single = cosine * tables_[point.material].evaluate(wi, wo);
    if (std::abs(delta_phi) < kPif / 2) parts.multiple = cosine * lobe;
    return parts;
  }
  // of the front half with the half that sends light back to wo
  const float overlap = 1 - std::abs(delta_phi) / kPif;
  parts.multiple = cosine * way.transmittance *
                   (spread_scattering(point.material, theta_d, theta_o, delta_phi, way.variance) +
                    overlap * lobe);
  return parts;
}

}  // namespace heddle
