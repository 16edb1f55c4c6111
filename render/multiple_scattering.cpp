#include "render/multiple_scattering.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

MultipleScattering::LightShape::LightShape(std::optional<float> sharpness) : directional_(!sharpness) {
  band_.fill(1);
  if (!sharpness) return;
  const std::vector<double> ratios = spherical_bessel_ratios(kMaxShOrder, *sharpness);
  std::transform(ratios.begin(), ratios.end(), band_.begin(), [](double a) { return static_cast<float>(a); });
}

void MultipleScattering::incoming(std::uint32_t cell, const LightShape& light, const Vec3& axis,
                                  IncomingField& field) const {
  if (light.directional_ && !transfer_->both_sides && !(axis.z() > 0)) {
    std::fill_n(field.begin(), 3 * transfer_->coefficients(), 0.0F);
    return;
  }
  std::array<float, sh_count(kMaxShOrder)> coefficients;
  evaluate_sh(transfer_->order, axis, coefficients.data());
  for (int l = 0; l <= transfer_->order; ++l) {
    for (int j = l * l; j < (l + 1) * (l + 1); ++j) coefficients[j] *= light.band_[l];
  }
  transfer_->incoming(cell, coefficients.data(), field.data());
}

Rgb MultipleScattering::outgoing(const IncomingField& field, std::uint16_t material, const Vec3& tangent,
                                 const Vec3& wo) const {
  const int order = transfer_->order;
  IncomingField turned;
  ShRotation(order, wo_space(tangent, wo).cast<double>()).rotate<3>(field.data(), turned.data());
  IncomingField response;
  const float theta_o = std::asin(std::clamp(wo.dot(tangent), -1.0F, 1.0F));
  materials_[material].sh_coefficients(theta_o, order, response.data());
  Rgb sum = Rgb::Zero();
  for (int j = 0; j < transfer_->coefficients(); ++j) {
    for (int c = 0; c < 3; ++c) sum[c] += response[3 * j + c] * turned[3 * j + c];
  }
  return sum;
}

}  // namespace heddle
