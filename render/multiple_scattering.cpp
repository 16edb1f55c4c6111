#include "render/multiple_scattering.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fibers/math/hemisphere_dual.h"
#include "fibers/math/sampling.h"
#include "fibers/math/sh_rotation.h"
#include "fibers/math/special_functions.h"

namespace heddle {

Mat3 wo_space(const Vec3& tangent, const Vec3& wo) {
  // Below this length of wo's part across the tangent, its direction is rounding error; so is the choice of y
  // then, since the BCSDF at theta_o = 90 degrees does not depend on it.
  constexpr float kAlong = 1e-5F;
  const Vec3 across = wo - wo.dot(tangent) * tangent;
  const float length = across.norm();
  const Vec3 y = length > kAlong ? Vec3(across / length) : Vec3(frame_about(tangent).col(1));
  Mat3 axes;
  axes.row(0) = tangent;
  axes.row(1) = y;
  axes.row(2) = tangent.cross(y);
  return axes;
}

namespace {

// Strata of a Gaussian's mass in its polar and azimuthal angle, from which its part over the horizon is projected.
constexpr int kPolar = 64;
constexpr int kAzimuths = 64;

// Inverse of the distribution of cos(angle to the axis) under a normalised spherical Gaussian.
double cosine_of_share(double share, double sharpness) {
  if (sharpness < 1e-4) return 1 - 2 * share;
  return 1 + std::log1p(-share * -std::expm1(-2 * sharpness)) / sharpness;
}

}  // namespace

MultipleScattering::LightShape::LightShape(std::optional<float> sharpness, FaceLight face_light)
    : directional_(!sharpness), face_light_(face_light) {
  band_.fill(1);
  if (!sharpness) return;
  const std::vector<double> ratios = spherical_bessel_ratios(kMaxShOrder, *sharpness);
  std::transform(ratios.begin(), ratios.end(), band_.begin(), [](double a) { return static_cast<float>(a); });

  constexpr int kCount = sh_count(kMaxShOrder);
  upper_.assign(static_cast<std::size_t>(kInclinations) * kCount, 0.0F);
  std::array<double, kCount> y;
  for (int row = 0; row < kInclinations; ++row) {
    const double inclination = kPi * row / (kInclinations - 1);
    const Vec3d axis(std::sin(inclination), 0, std::cos(inclination));
    const Vec3d side(std::cos(inclination), 0, -std::sin(inclination));
    std::array<double, kCount> sum{};
    for (int p = 0; p < kPolar; ++p) {
      const double cosine = cosine_of_share((p + 0.5) / kPolar, *sharpness);
      const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
      for (int a = 0; a < kAzimuths; ++a) {
        const double azimuth = 2 * kPi * (a + 0.5) / kAzimuths;
        const Vec3d w = cosine * axis + sine * (std::cos(azimuth) * side + std::sin(azimuth) * Vec3d(0, 1, 0));
        if (w.z() <= 0) continue;
        evaluate_sh(kMaxShOrder, w, y.data());
        for (int j = 0; j < kCount; ++j) sum[static_cast<std::size_t>(j)] += y[static_cast<std::size_t>(j)];
      }
    }
    for (int l = 0; l <= kMaxShOrder; ++l) {
      for (int m = 0; m <= l; ++m) {
        const int j = l * (l + 1) + m;
        upper_[static_cast<std::size_t>(row * kCount + j)] =
            static_cast<float>(sum[static_cast<std::size_t>(j)] / (kPolar * kAzimuths));
      }
    }
  }
}

void MultipleScattering::LightShape::project(int order, bool both_sides, const Vec3& axis, float* coefficients) const {
  if (both_sides || face_light_ == FaceLight::kPrinted) {
    evaluate_sh(order, axis, coefficients);
    for (int l = 0; l <= order; ++l) {
      for (int m = -l; m <= l; ++m) coefficients[l * (l + 1) + m] *= band_[static_cast<std::size_t>(l)];
    }
    return;
  }
  if (!directional_) {
    moments_above(order, axis, coefficients);
  } else if (axis.z() > 0) {
    evaluate_sh(order, axis, coefficients);
  } else {
    std::fill_n(coefficients, sh_count(order), 0.0F);
    return;
  }
  HemisphereDual::of_order(order).apply(coefficients);
}

void MultipleScattering::LightShape::moments_above(int order, const Vec3& axis, float* moments) const {
  const float place = std::acos(std::clamp(axis.z(), -1.0F, 1.0F)) * (kInclinations - 1) / kPif;
  const int row = std::min(static_cast<int>(place), kInclinations - 2);
  const float share = place - static_cast<float>(row);
  const float* low = upper_.data() + static_cast<std::ptrdiff_t>(row) * sh_count(kMaxShOrder);
  const float* high = low + sh_count(kMaxShOrder);
  // The axis' azimuth: cos and sin of its multiples by recurrence.
  const float across = std::hypot(axis.x(), axis.y());
  const float c1 = across > 0 ? axis.x() / across : 1.0F;
  const float s1 = across > 0 ? axis.y() / across : 0.0F;
  float c = 1;
  float s = 0;
  for (int m = 0; m <= order; ++m) {
    for (int l = m; l <= order; ++l) {
      const int j = l * (l + 1);
      const float value = low[j + m] + share * (high[j + m] - low[j + m]);
      moments[j + m] = value * c;
      if (m > 0) moments[j - m] = value * s;
    }
    const float next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
  }
}

void MultipleScattering::incoming(std::uint32_t cell, const LightShape& light, const Vec3& axis,
                                  IncomingField& field) const {
  std::array<float, sh_count(kMaxShOrder)> coefficients;
  light.project(transfer_->order, transfer_->both_sides, axis, coefficients.data());
  transfer_->incoming(cell, coefficients.data(), field.data());
}

Rgb MultipleScattering::outgoing(const IncomingField& field, std::uint16_t material, const Vec3& tangent,
                                 const Vec3& wo) const {
  return outgoing_from_field(transfer_->order, field, materials_[material], tangent, wo);
}

Rgb outgoing_from_field(int order, const IncomingField& field, const BcsdfTable& bcsdf, const Vec3& tangent,
                        const Vec3& wo) {
  IncomingField turned;
  ShRotation(order, wo_space(tangent, wo).cast<double>()).rotate<3>(field.data(), turned.data());
  IncomingField response;
  const float theta_o = std::asin(std::clamp(wo.dot(tangent), -1.0F, 1.0F));
  bcsdf.sh_coefficients(theta_o, order, response.data());
  Rgb sum = Rgb::Zero();
  for (int j = 0; j < sh_count(order); ++j) {
    for (int c = 0; c < 3; ++c) sum[c] += response[3 * j + c] * turned[3 * j + c];
  }
  return sum;
}

}  // namespace heddle
