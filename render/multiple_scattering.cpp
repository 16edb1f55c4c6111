#include "render/multiple_scattering.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "fibers/baked/cone_scattering.h"
#include "fibers/math/light_dual.h"
#include "fibers/math/sh_rotation.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/scattering/wo_space.h"

namespace heddle {

namespace {

// Strata of a Gaussian's mass in its polar and azimuthal angle, from which its part over the
// horizon is projected.
constexpr int kPolar = 64;
constexpr int kAzimuths = 64;

// Lights of this sharpness and softer do without cones; from the second on, they use them alone.
constexpr float kConesFrom = 8;
constexpr float kConesAlone = 20;

}  // namespace

MultipleScattering::LightShape::OnCones MultipleScattering::LightShape::on_cones_of(
    std::optional<float> sharpness, Projection projection) {
  OnCones on_cones;
  if (projection == Projection::kPrinted) on_cones.share = 0;
  if (!sharpness) return on_cones;
  on_cones.share *= std::clamp((*sharpness - kConesFrom) / (kConesAlone - kConesFrom), 0.0F, 1.0F);
  on_cones.variance = 1 / std::max(*sharpness, kConesFrom);
  return on_cones;
}

MultipleScattering::LightShape::LightShape(std::optional<float> sharpness, Projection projection,
                                           bool may_come_from_both_sides)
    : directional_(!sharpness),
      projection_(projection),
      on_cones_(on_cones_of(sharpness, projection)) {
  band_.fill(1);
  if (!sharpness) return;
  const std::vector<double> ratios = spherical_bessel_ratios(kMaxShOrder, *sharpness);
  std::transform(ratios.begin(), ratios.end(), band_.begin(),
                 [](double a) { return static_cast<float>(a); });
  if (projection == Projection::kPrinted) return;

  upper_.assign(static_cast<std::size_t>(kInclinations) * kColumns, 0.0F);
  std::vector<float> rooted(upper_.size(), 0.0F);  // the same with sqrt(z)
  std::array<double, kColumns> y;
  for (int row = 0; row < kInclinations; ++row) {
    const double inclination = kPi * row / (kInclinations - 1);
    const Vec3d axis(std::sin(inclination), 0, std::cos(inclination));
    const Vec3d side(std::cos(inclination), 0, -std::sin(inclination));
    std::array<double, kColumns> sum{};
    std::array<double, kColumns> rooted_sum{};
    for (int p = 0; p < kPolar; ++p) {
      const double cosine = 1 - sg_depth_of_share((p + 0.5) / kPolar, *sharpness);
      const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
      for (int a = 0; a < kAzimuths; ++a) {
        const double azimuth = 2 * kPi * (a + 0.5) / kAzimuths;
        const Vec3d w =
            cosine * axis + sine * (std::cos(azimuth) * side + std::sin(azimuth) * Vec3d(0, 1, 0));
        if (w.z() <= 0) continue;
        evaluate_sh(kMaxShOrder, w, y.data());
        for (std::size_t j = 0; j < y.size(); ++j) sum[j] += y[j];
        if (!may_come_from_both_sides) continue;
        const double root = std::sqrt(w.z());
        for (std::size_t j = 0; j < y.size(); ++j) rooted_sum[j] += root * y[j];
      }
    }
    for (int l = 0; l <= kMaxShOrder; ++l) {
      for (int m = 0; m <= l; ++m) {
        const auto j = static_cast<std::size_t>(l * (l + 1) + m);
        const std::size_t place = static_cast<std::size_t>(row) * kColumns + j;
        upper_[place] = static_cast<float>(sum[j] / (kPolar * kAzimuths));
        rooted[place] = static_cast<float>(rooted_sum[j] / (kPolar * kAzimuths));
      }
    }
  }
  if (may_come_from_both_sides) fill_both(rooted);
}

void MultipleScattering::LightShape::fill_both(const std::vector<float>& rooted) {
  both_.resize(rooted.size());
  for (std::size_t row = 0; row < kInclinations; ++row) {
    // What lies below is what lies above of the mirrored axis.
    std::array<float, kColumns> below{};
    const float* mirrored = rooted.data() + (kInclinations - 1 - row) * kColumns;
    for (int l = 0; l <= kMaxShOrder; ++l) {
      for (int m = 0; m <= l; ++m) {
        const int j = l * (l + 1) + m;
        below[static_cast<std::size_t>(j)] = (l + m) % 2 == 0 ? mirrored[j] : -mirrored[j];
      }
    }
    two_sided_moments(kMaxShOrder, rooted.data() + row * kColumns, below.data(),
                      both_.data() + row * kColumns);
  }
}

void MultipleScattering::LightShape::moments(int order, bool both_sides, const Vec3& axis,
                                             float* moments) const {
  if (projection_ == Projection::kPrinted) {
    evaluate_sh(order, axis, moments);
    for (int l = 0; l <= order; ++l) {
      for (int m = -l; m <= l; ++m) moments[l * (l + 1) + m] *= band_[static_cast<std::size_t>(l)];
    }
  } else if (directional_) {
    direction_moments(order, both_sides, axis, moments);
  } else {
    assert(!(both_sides && both_.empty()) && "made for light from the face only");
    moments_by_inclination(both_sides ? both_ : upper_, order, axis, moments);
  }
}

void MultipleScattering::LightShape::project(int order, bool both_sides, const Vec3& axis,
                                             float* coefficients) const {
  moments(order, both_sides, axis, coefficients);
  if (projection_ == Projection::kDual) LightDual::of(order, both_sides).apply(coefficients);
}

void MultipleScattering::LightShape::moments_by_inclination(const std::vector<float>& table,
                                                            int order, const Vec3& axis,
                                                            float* moments) {
  const float place = std::acos(std::clamp(axis.z(), -1.0F, 1.0F)) * (kInclinations - 1) / kPif;
  const int row = std::min(static_cast<int>(place), kInclinations - 2);
  const float share = place - static_cast<float>(row);
  const float* low = table.data() + static_cast<std::ptrdiff_t>(row) * kColumns;
  const float* high = low + kColumns;
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
                                  CellLight& result) const {
  std::array<float, sh_count(kMaxShOrder)> coefficients;
  light.project(transfer_->order, transfer_->both_sides, axis, coefficients.data());
  const float cone_share = light.on_cones().share;
  transfer_->incoming(cell, coefficients.data(), cone_share, result.harmonics.data());
  if (transfer_->cones && cone_share > 0) {
    transfer_->incoming_on_cones(cell, coefficients.data(), result.cones.data());
  }
}

Rgb MultipleScattering::outgoing_from_cones(const CellLight& incoming,
                                            const LightShape::OnCones& light, const Vec3& axis,
                                            std::uint32_t segment, std::uint16_t material,
                                            const Vec3& tangent, const Vec3& wo) const {
  if (!transfer_->cones || !(light.share > 0)) return Rgb::Zero();
  return light.share * scattered_from_cones(incoming.cones.data(), axis, light.variance,
                                            {bundle_tangent_[segment], tangent, wo},
                                            materials_[material]);
}

void MultipleScattering::clear(SummedLight& sum) const {
  for (std::size_t c = 0; c < 3; ++c) {
    std::fill_n(sum.all[c].begin(), transfer_->coefficients(), 0.0F);
    std::fill_n(sum.on_cones[c].begin(), transfer_->coefficients(), 0.0F);
  }
}

Rgb MultipleScattering::add(const SeenLight& light, const Vec3& axis, const LightShapes& shapes,
                            const ShadingPoint& point, SummedLight& sum) const {
  const int n = transfer_->coefficients();
  std::optional<float> sharpness;
  if (!light.is_directional) sharpness = light.sharpness;
  std::array<float, SummedLight::kMost> values;
  shapes.moments(transfer_->order, transfer_->both_sides, sharpness, axis, values.data());
  for (std::size_t c = 0; c < 3; ++c) {
    const float irradiance = light.irradiance[static_cast<Eigen::Index>(c)];
    for (std::size_t j = 0; j < static_cast<std::size_t>(n); ++j)
      sum.all[c][j] += irradiance * values[j];
  }
  const LightShape::OnCones on_cones = LightShape::on_cones_of(sharpness, shapes.projection());
  if (!transfer_->cones || !(on_cones.share > 0)) return Rgb::Zero();
  for (std::size_t c = 0; c < 3; ++c) {
    const float irradiance = on_cones.share * light.irradiance[static_cast<Eigen::Index>(c)];
    for (std::size_t j = 0; j < static_cast<std::size_t>(n); ++j)
      sum.on_cones[c][j] += irradiance * values[j];
  }
  LightDual::of(transfer_->order, transfer_->both_sides).apply(values.data());
  CellLight arriving;
  transfer_->incoming_on_cones(point.cell, values.data(), arriving.cones.data());
  return light.irradiance * outgoing_from_cones(arriving, on_cones, axis, point.segment,
                                                point.material, point.tangent.fabric,
                                                point.wo.fabric);
}

void MultipleScattering::incoming(std::uint32_t cell, const LightShapes& shapes,
                                  const SummedLight& sum, IncomingField& field) const {
  const bool by_dual = shapes.projection() == LightShape::Projection::kDual;
  const auto in_colors = [&](const std::array<std::array<float, SummedLight::kMost>, 3>& planes) {
    IncomingField light;  // [j0][rgb]
    for (std::size_t c = 0; c < 3; ++c) {
      std::array<float, SummedLight::kMost> values = planes[c];
      if (by_dual) LightDual::of(transfer_->order, transfer_->both_sides).apply(values.data());
      for (int j = 0; j < transfer_->coefficients(); ++j)
        light[static_cast<std::size_t>(3 * j) + c] = values[static_cast<std::size_t>(j)];
    }
    return light;
  };
  transfer_->add_incoming(cell, in_colors(sum.all).data(), field.data());
  if (transfer_->cones && shapes.projection() == LightShape::Projection::kDual)
    transfer_->subtract_incoming_of_cones(cell, in_colors(sum.on_cones).data(), field.data());
}

LightShapes::LightShapes(LightShape::Projection projection, bool may_come_from_both_sides)
    : projection_(projection),
      may_come_from_both_sides_(may_come_from_both_sides),
      directional_(std::nullopt, projection) {}

const LightShapes::LightShape& LightShapes::at(std::size_t k) const {
  Late& late = shapes_[k];
  std::call_once(late.once, [&] {
    late.shape.emplace(kLeast * std::exp2(static_cast<float>(k) / kPerOctave), projection_,
                       may_come_from_both_sides_);
  });
  return *late.shape;
}

void LightShapes::moments(int order, bool both_sides, std::optional<float> sharpness,
                          const Vec3& axis, float* moments) const {
  if (!sharpness) {
    directional_.moments(order, both_sides, axis, moments);
    return;
  }
  const float place = kPerOctave * std::log2(std::clamp(*sharpness, kLeast, kMost) / kLeast);
  const std::size_t middle =
      std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(place)), 1, kCount - 2);
  const float x = place - static_cast<float>(middle);
  const std::array<float, 3> weights = {0.5F * x * (x - 1), 1 - x * x, 0.5F * x * (x + 1)};
  std::fill_n(moments, sh_count(order), 0.0F);
  for (std::size_t k = 0; k < 3; ++k) {
    std::array<float, SummedLight::kMost> own;
    at(middle + k - 1).moments(order, both_sides, axis, own.data());
    for (int j = 0; j < sh_count(order); ++j)
      moments[j] += weights[k] * own[static_cast<std::size_t>(j)];
  }
}

Rgb MultipleScattering::radiance(const LightShape& light, const Vec3& axis, std::uint32_t segment,
                                 std::uint16_t material, const Vec3& tangent,
                                 const Vec3& wo) const {
  CellLight arriving;
  incoming(transfer_->cell_of_segment[segment], light, axis, arriving);
  return outgoing(arriving.harmonics, material, tangent, wo) +
         outgoing_from_cones(arriving, light.on_cones(), axis, segment, material, tangent, wo);
}

Rgb MultipleScattering::outgoing(const IncomingField& field, std::uint16_t material,
                                 const Vec3& tangent, const Vec3& wo) const {
  return outgoing_from_field(transfer_->order, field, materials_[material], tangent, wo);
}

Rgb outgoing_from_field(int order, const IncomingField& field, const BcsdfTable& bcsdf,
                        const Vec3& tangent, const Vec3& wo) {
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
