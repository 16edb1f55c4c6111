#include "fibers/scattering/bcsdf_table.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_harmonics.h"
#include "fibers/scattering/sg_scatter.h"

namespace heddle {
namespace {

constexpr float kHalfPif = 0.5F * kPif;
constexpr int kEndRows = 512;
// deviations from an end beyond which the cut leaves Gn as it is (to 1e-10)
constexpr double kEndReach = 6.5;

// I0(x) exp(-x) sqrt(1 + 2 pi x) over t = x / (x + 2): between 0.9 and 1.1 everywhere, so linear
// interpolation keeps 1e-6.
class BesselTable {
 public:
  BesselTable() {
    for (int k = 0; k < kEntries; ++k) {
      const double t = static_cast<double>(k) / kEntries;
      const double x = 2.0 * t / (1.0 - t);
      values_[static_cast<std::size_t>(k)] =
          static_cast<float>(scaled_bessel_i0(x) * std::sqrt(1.0 + 2.0 * kPi * x));
    }
    values_[kEntries] = values_[kEntries + 1] = 1.0F;
  }
  /// t in [0, 1].
  float operator()(float t) const {
    const float position = t * kEntries;
    const int k = static_cast<int>(position);
    const float* v = &values_[static_cast<std::size_t>(k)];
    return v[0] + (position - static_cast<float>(k)) * (v[1] - v[0]);
  }

 private:
  static constexpr int kEntries = 1024;
  std::array<float, kEntries + 2> values_;
};

const BesselTable& bessel_table() {
  static const BesselTable table;
  return table;
}

struct RowPosition {
  int row;
  float fraction;
};

RowPosition row_position(float theta_o) {
  const float position = (theta_o + kHalfPif) * ((BcsdfTable::kRows - 1) / kPif);
  const int row = std::clamp(static_cast<int>(position), 0, BcsdfTable::kRows - 2);
  return {row, std::clamp(position - static_cast<float>(row), 0.0F, 1.0F)};
}

// (1 - cosine)^5 with 1 - cosine = sine^2 / (1 + cosine), accurate where it is small.
float schlick_weight_of_sine(float sine, float cosine) {
  const float drop = sine * sine / (1.0F + cosine);
  return drop * drop * (drop * drop) * drop;
}

}  // namespace

// A direction taken apart. Near an end the angle comes from the cosine, so that its distance from
// the end is accurate.
struct BcsdfTable::Inclination {
  float theta;
  float from_end;  // pi/2 - |theta|
  float cosine;
  float sine;
  Vec2 azimuth;  // unit; (1, 0) along the tangent

  explicit Inclination(const Vec3& w)
      : cosine(std::sqrt(w.y() * w.y() + w.z() * w.z())), sine(w.x()) {
    if (cosine < 0.7F) {
      from_end = std::asin(cosine);
      theta = std::copysign(kHalfPif - from_end, w.x());
    } else {
      theta = std::asin(std::clamp(w.x(), -1.0F, 1.0F));
      from_end = kHalfPif - std::abs(theta);
    }
    azimuth = cosine > 0.0F ? Vec2(w.y() / cosine, w.z() / cosine) : Vec2(1.0F, 0.0F);
  }

  Inclination(float angle, const Vec2& around)
      : theta(angle),
        from_end(kHalfPif - std::abs(angle)),
        cosine(std::sin(from_end)),
        sine(std::sin(angle)),
        azimuth(around) {}
};

// Each lobe's Gaussian in theta times its density in azimuth, before Gn and the cut.
struct BcsdfTable::Densities {
  float r;
  float tt;
};

struct BcsdfTable::SgSums {
  std::array<Rgb, 2> value = {Rgb::Zero(), Rgb::Zero()};  // R's and TT's share of Gamma
  // mean inclination of what they scatter, from the axis's
  std::array<float, 2> theta_shift = {};
};

float BcsdfTable::LongitudinalLobe::cos2_mean(float cosine, float from_end) const {
  const float uncut = floor + decay * cosine * cosine;
  const float position = std::max(0.0F, from_end) * end_scale;
  if (position >= static_cast<float>(kEndRows)) return uncut * end_ratio[kEndRows];
  const int k = static_cast<int>(position);
  const float* ratio = &end_ratio[static_cast<std::size_t>(k)];
  return uncut * (ratio[0] + (position - static_cast<float>(k)) * (ratio[1] - ratio[0]));
}

BcsdfTable::LongitudinalLobe BcsdfTable::longitudinal_lobe(double beta) {
  LongitudinalLobe lobe;
  lobe.beta = static_cast<float>(beta);
  lobe.inverse_variance = static_cast<float>(1.0 / (beta * beta));
  lobe.norm = static_cast<float>(1.0 / (std::sqrt(2.0 * kPi) * beta));
  const double floor = -0.5 * std::expm1(-2.0 * beta * beta);
  const double decay = std::exp(-2.0 * beta * beta);
  lobe.floor = static_cast<float>(floor);
  lobe.decay = static_cast<float>(decay);
  const double reach = std::min(0.5 * kPi, kEndReach * beta);
  lobe.end_scale = static_cast<float>(kEndRows / reach);
  lobe.end_ratio.resize(kEndRows + 1);
  for (int k = 0; k <= kEndRows; ++k) {
    const double from_end = reach * k / kEndRows;
    const double cosine = std::sin(from_end);
    lobe.end_ratio[static_cast<std::size_t>(k)] = static_cast<float>(
        gaussian_cos2_mean(0.5 * kPi - from_end, beta) / (floor + decay * cosine * cosine));
  }
  return lobe;
}

BcsdfTable::BcsdfTable(const FiberScattering& fiber)
    : fiber_(fiber),
      color_r_(fiber.color_r.cast<float>()),
      color_tt_(fiber.color_tt.cast<float>()),
      azimuth_sampler_(fiber.isotropic_white ? 0.0 : 1.0 / (fiber.gamma_tt * fiber.gamma_tt)),
      adjoint_r_(kRows, Rgb::Ones()),
      adjoint_tt_(kRows, Rgb::Zero()) {
  if (!fiber.isotropic_white) {
    r_ = longitudinal_lobe(fiber.beta_r);
    tt_ = longitudinal_lobe(fiber.beta_tt);
    const double k = 1.0 / (fiber.gamma_tt * fiber.gamma_tt);
    k_ = static_cast<float>(k);
    azimuth_norm_ = static_cast<float>(1.0 / (2.0 * kPi * scaled_bessel_i0(k)));
  }

  constexpr int kCount = sh_count(kMaxOrder);
  sh_.resize(static_cast<std::size_t>(kRows) * kCount * 3);
  for (int row = 0; row < kRows / 2; ++row) {
    const double theta_o = kPi * row / (kRows - 1) - 0.5 * kPi;
    const std::vector<Rgbd> r = bcsdf_sh(fiber, theta_o, kMaxOrder, Lobe::kR);
    const std::vector<Rgbd> tt = bcsdf_sh(fiber, theta_o, kMaxOrder, Lobe::kTt);
    const int mirrored = kRows - 1 - row;
    // Turning theta_o and theta_i about mirrors x, under which harmonics with cos(m phi) change by
    // (-1)^m and those with sin(m phi) by -(-1)^m.
    for (int l = 0; l <= kMaxOrder; ++l) {
      for (int m = -l; m <= l; ++m) {
        const auto j = static_cast<std::size_t>(l * (l + 1) + m);
        const float sign = (m % 2 == 0) == (m >= 0) ? 1.0F : -1.0F;
        for (int c = 0; c < 3; ++c) {
          const auto value = static_cast<float>(r[j][c] + tt[j][c]);
          sh_[(static_cast<std::size_t>(row) * kCount + j) * 3 + static_cast<std::size_t>(c)] =
              value;
          sh_[(static_cast<std::size_t>(mirrored) * kCount + j) * 3 + static_cast<std::size_t>(c)] =
              sign * value;
        }
      }
    }
    // Adjoint albedos are sqrt(4 pi) times the constant coefficients.
    for (const int at : {row, mirrored}) {
      adjoint_r_[static_cast<std::size_t>(at)] = r[0].cast<float>();
      adjoint_tt_[static_cast<std::size_t>(at)] = tt[0].cast<float>();
    }
  }
}

float BcsdfTable::probability_of_r(float theta_o, const Rgb& importance) const {
  const RowPosition at = row_position(theta_o);
  const auto row = static_cast<std::size_t>(at.row);
  const Rgb r = adjoint_r_[row] + at.fraction * (adjoint_r_[row + 1] - adjoint_r_[row]);
  const Rgb tt = adjoint_tt_[row] + at.fraction * (adjoint_tt_[row + 1] - adjoint_tt_[row]);
  const float share_r = (importance * r).sum();
  const float share = share_r + (importance * tt).sum();
  return share > 0.0F ? share_r / share : 0.5F;
}

BcsdfTable::Densities BcsdfTable::densities(const Inclination& in, const Inclination& out) const {
  const float deviation = in.theta + out.theta;
  const float half_square = -0.5F * deviation * deviation;
  return {r_.norm * std::exp(half_square * r_.inverse_variance) * (0.5F / kPif),
          tt_.norm * azimuth_norm_ *
              std::exp(half_square * tt_.inverse_variance -
                       0.5F * k_ * (in.azimuth + out.azimuth).squaredNorm())};
}

Rgb BcsdfTable::value(const Densities& d, const Inclination& in) const {
  const float r = d.r / r_.cos2_mean(in.cosine, in.from_end);
  const float tt = d.tt / tt_.cos2_mean(in.cosine, in.from_end);
  const float schlick = schlick_weight_of_sine(in.sine, in.cosine);
  return color_r_ * r + (1.0F - color_r_) * (schlick * r + (1.0F - schlick) * tt * color_tt_);
}

float BcsdfTable::sampling_density(const Densities& d, const Inclination& out,
                                   float probability_of_r) const {
  // Share of the Gaussian about -theta_o inside [-pi/2, pi/2]; five deviations from the ends it is
  // 1 to 3e-7.
  const float mass_r = out.from_end < 5.0F * r_.beta ? cut_gaussian_mass(out.theta, r_.beta) : 1.0F;
  const float mass_tt =
      out.from_end < 5.0F * tt_.beta ? cut_gaussian_mass(out.theta, tt_.beta) : 1.0F;
  return probability_of_r / mass_r * d.r + (1.0F - probability_of_r) / mass_tt * d.tt;
}

Rgb BcsdfTable::evaluate(const Vec3& wi, const Vec3& wo) const {
  if (fiber_.isotropic_white) return Rgb::Constant(1.0F / (kPif * kPif));
  const Inclination in(wi);
  return value(densities(in, Inclination(wo)), in);
}

float BcsdfTable::pdf(const Vec3& wi, const Vec3& wo, const Rgb& importance) const {
  const Inclination in(wi);
  if (fiber_.isotropic_white) return in.cosine / (kPif * kPif);
  const Inclination out(wo);
  // Exactly along the tangent the density is infinite: capped at the cosine that float can tell
  // from 0.
  return sampling_density(densities(in, out), out, probability_of_r(out.theta, importance)) /
         std::max(in.cosine, 1e-7F);
}

BcsdfTable::Sample BcsdfTable::sample(const Vec3& wo, RandomStream& random,
                                      const Rgb& importance) const {
  if (fiber_.isotropic_white) {
    // Density cos(theta) / pi^2: x has that of a coordinate of a uniform point in the disk, the
    // azimuth is uniform.
    const float x = sample_disk(random).x();
    const float phi = 2.0F * kPif * random.uniform();
    const float cosine = std::sqrt(std::max(0.0F, 1.0F - x * x));
    return {Vec3(x, cosine * std::cos(phi), cosine * std::sin(phi)), Rgb::Ones(),
            cosine / (kPif * kPif), kPif};
  }
  const Inclination out(wo);
  const float probability = probability_of_r(out.theta, importance);
  const bool is_r = random.uniform() < probability;
  const float theta = sample_cut_gaussian(-out.theta, is_r ? r_.beta : tt_.beta, random);
  const float turn = is_r ? 2.0F * kPif * random.uniform() : azimuth_sampler_.sample(random);
  // TT's azimuths scatter about that opposite to wo's.
  const float cos_turn = is_r ? std::cos(turn) : -std::cos(turn);
  const float sin_turn = is_r ? std::sin(turn) : -std::sin(turn);
  const Inclination in(theta, Vec2(cos_turn * out.azimuth.x() - sin_turn * out.azimuth.y(),
                                   sin_turn * out.azimuth.x() + cos_turn * out.azimuth.y()));
  const Densities d = densities(in, out);
  const float density =
      // per d theta_i d phi_i, so pdf = density / cos(theta_i)
      sampling_density(d, out, probability);
  return {Vec3(in.sine, in.cosine * in.azimuth.x(), in.cosine * in.azimuth.y()),
          value(d, in) * (in.cosine * in.cosine / density), density / in.cosine,
          is_r ? r_.beta : tt_.beta};
}

Rgb BcsdfTable::sg_scatter(const Vec3& axis, float sharpness, const Vec3& wo) const {
  const SgSums sums = sg_sums(Inclination(axis), sharpness, Inclination(wo));
  return sums.value[0] + sums.value[1];
}

std::array<BcsdfTable::LobeResponse, 2> BcsdfTable::sg_scatter_by_lobe(const Vec3& axis,
                                                                       float sharpness,
                                                                       const Vec3& wo) const {
  const Inclination light(axis);
  const Inclination view(wo);
  const SgSums sums = sg_sums(light, sharpness, view);
  std::array<LobeResponse, 2> lobes;
  for (std::size_t n = 0; n < 2; ++n) {
    const bool is_r = n == 0;
    const float cosine = std::max(0.0F, std::cos(light.theta + sums.theta_shift[n]));
    // Von Mises of light, about its azimuth, times that of TT, about the azimuth opposite to the
    // viewer's.
    const Vec2 from_light = (sharpness * light.cosine * cosine) * light.azimuth;
    const Vec2 mean = is_r ? from_light : Vec2(from_light - k_ * view.azimuth);
    lobes[n] = {sums.value[n], sums.theta_shift[n],
                std::atan2(light.azimuth.x() * mean.y() - light.azimuth.y() * mean.x(),
                           light.azimuth.dot(mean)),
                sharpness + (is_r ? r_.inverse_variance : tt_.inverse_variance), mean.norm()};
  }
  return lobes;
}

// Nodes of both lobes' integrals over theta, R's first. Angles are measured from the centres of the
// two Gaussians, where they are small.
struct BcsdfTable::SgNodes {
  static constexpr int kMost = 2 * kBroadNodes;
  std::array<float, kMost> from_light;  // theta - theta'
  std::array<float, kMost> from_cone;   // theta + theta_o
  std::array<float, kMost> weight;
  std::array<float, kMost> square;  // x^2 of the rule's weight exp(-x^2)
  int count = 0;

  void add(float light_offset, float cone_offset, float w, float x2) {
    const auto n = static_cast<std::size_t>(count++);
    from_light[n] = light_offset;
    from_cone[n] = cone_offset;
    weight[n] = w;
    square[n] = x2;
  }

  void add_lobe(float inverse_variance, const Inclination& light, float sharpness,
                const Inclination& view) {
    const float gap = -view.theta - light.theta;  // from theta' to the cone
    const float total = inverse_variance + sharpness;
    // 1 - cos(d) >= 2 d^2 / pi^2 bounds the peak of exp(E) from above.
    const float slack = sharpness * (4.0F / (kPif * kPif));
    if (gap * gap * inverse_variance * slack > 80.0F * (inverse_variance + slack)) return;
    if (0.5F * total < static_cast<float>(kBroadPrecision)) {
      static const QuadratureRule& base = gauss_legendre(kBroadNodes);
      for (std::size_t n = 0; n < base.nodes.size(); ++n) {
        const float theta = kHalfPif * static_cast<float>(base.nodes[n]);
        add(theta - light.theta, theta + view.theta, kHalfPif * static_cast<float>(base.weights[n]),
            0.0F);
      }
      return;
    }
    const float share = sharpness / total;
    const float light_offset = (1.0F - share) * gap;
    const float cone_offset = -share * gap;
    const float centre = light.theta + light_offset;
    const float root = std::sqrt(0.5F * total);
    const float scale = std::copysign(1.0F / root, centre);
    const ThreeNodeRule rule = cut_rule(static_cast<double>(root * (kHalfPif - std::abs(centre))));
    for (std::size_t n = 0; n < 3; ++n) {
      const auto x = static_cast<float>(rule.nodes[n]);
      add(light_offset + scale * x, cone_offset + scale * x,
          static_cast<float>(rule.weights[n]) / root, x * x);
    }
  }
};

BcsdfTable::SgSums BcsdfTable::sg_sums(const Inclination& light, float sharpness,
                                       const Inclination& view) const {
  constexpr int kLanes = 8;
  using Lanes = Eigen::Array<float, kLanes, 1>;
  SgNodes nodes;
  nodes.add_lobe(r_.inverse_variance, light, sharpness, view);
  const int nodes_r = nodes.count;
  if (!fiber_.isotropic_white) nodes.add_lobe(tt_.inverse_variance, light, sharpness, view);
  SgSums sums;
  if (nodes.count == 0) return sums;
  while (nodes.count % kLanes != 0) nodes.add(0.0F, 0.0F, 0.0F, 0.0F);

  const float sum2 = (light.azimuth + view.azimuth).squaredNorm();
  const float difference2 = (light.azimuth - view.azimuth).squaredNorm();
  const BesselTable& bessel = bessel_table();
  float r = 0.0F;
  float r_schlick = 0.0F;
  float tt = 0.0F;
  std::array<float, 2> all = {};      // R's and TT's sums
  std::array<float, 2> shifted = {};  // times theta - theta'
  for (int first = 0; first < nodes.count; first += kLanes) {
    const Eigen::Map<const Lanes> d_light(&nodes.from_light[static_cast<std::size_t>(first)]);
    const Eigen::Map<const Lanes> d_cone(&nodes.from_cone[static_cast<std::size_t>(first)]);
    const Eigen::Map<const Lanes> x2(&nodes.square[static_cast<std::size_t>(first)]);
    Lanes inverse_variance;
    Lanes k;
    for (int lane = 0; lane < kLanes; ++lane) {
      const bool is_r = first + lane < nodes_r;
      inverse_variance[lane] = is_r ? r_.inverse_variance : tt_.inverse_variance;
      k[lane] = is_r ? 0.0F : k_;
    }
    const Lanes half_sine = (0.5F * d_light).sin();
    const Lanes from_end = (kHalfPif - (light.theta + d_light).abs()).max(0.0F);
    const Lanes cosine = from_end.sin();
    // B as in sg_scatter.cpp; with k = 0 TT's azimuth integral becomes R's.
    const Lanes a = (sharpness * light.cosine) * cosine;
    const Lanes m = ((k - a).square() + difference2 * k * a).sqrt();
    const Lanes exponent = x2 - 0.5F * inverse_variance * d_cone.square() -
                           2.0F * sharpness * half_sine.square() -
                           sum2 * k * a / (m + a + k).max(1e-30F);
    const Lanes t = m / (m + 2.0F);
    const Lanes value = exponent.exp() * cosine.square() / (1.0F + 2.0F * kPif * m).sqrt();
    const Lanes schlick = (1.0F - cosine).square().square() * (1.0F - cosine);
    for (int lane = 0; lane < kLanes; ++lane) {
      const int n = first + lane;
      const float v = nodes.weight[static_cast<std::size_t>(n)] * value[lane] * bessel(t[lane]);
      if (fiber_.isotropic_white) {
        r += v * (2.0F / kPif);
        all[0] += v;
        shifted[0] += v * d_light[lane];
      } else if (n < nodes_r) {
        const float share = v * r_.norm / r_.cos2_mean(cosine[lane], from_end[lane]);
        r += share;
        r_schlick += share * schlick[lane];
        all[0] += share;
        shifted[0] += share * d_light[lane];
      } else {
        const float share = v * tt_.norm / tt_.cos2_mean(cosine[lane], from_end[lane]);
        tt += share * (1.0F - schlick[lane]);
        all[1] += share;
        shifted[1] += share * d_light[lane];
      }
    }
  }
  for (std::size_t n = 0; n < 2; ++n) {
    if (all[n] > 0.0F) sums.theta_shift[n] = shifted[n] / all[n];
  }
  if (fiber_.isotropic_white) {
    sums.value[0] = Rgb::Constant(r);
    return sums;
  }
  // azimuth_norm_ is 1 / (2 pi I0e(k)).
  sums.value = {color_r_ * r + (1.0F - color_r_) * r_schlick,
                (1.0F - color_r_) * color_tt_ * (tt * (2.0F * kPif * azimuth_norm_))};
  return sums;
}

BcsdfTable::BlurredLobes BcsdfTable::blurred_lobes(const Lanes& theta_i, const Lanes& cos_turn,
                                                   float theta_o, float variance) const {
  const Lanes from_cone = theta_i + theta_o;
  // Each lobe without its colours: value, and value times Schlick's weight.
  const auto lobe_response = [&](const LongitudinalLobe& lobe, Lanes& schlick) {
    const float total = variance + lobe.beta * lobe.beta;
    const Lanes theta = (theta_i - from_cone * (variance / total)).max(-kHalfPif).min(kHalfPif);
    const Lanes cosine = theta.cos().max(0.0F);
    const Lanes drop = 1.0F - cosine;
    schlick = drop.square().square() * drop;
    Lanes response =
        (from_cone.square() * (-0.5F / total)).exp() * cosine * (1 / std::sqrt(2 * kPif * total));
    for (int lane = 0; lane < Lanes::SizeAtCompileTime; ++lane) {
      response[lane] /= lobe.cos2_mean(cosine[lane], kHalfPif - std::abs(theta[lane]));
    }
    return response;
  };
  Lanes schlick_r;
  Lanes schlick_tt;
  const Lanes r = lobe_response(r_, schlick_r) * (0.5F / kPif);
  const Lanes tt = lobe_response(tt_, schlick_tt) * azimuth_norm_ * (-k_ * (1.0F + cos_turn)).exp();
  return {r, r * schlick_r, tt * (1.0F - schlick_tt)};
}

Rgb BcsdfTable::blurred_scatter(const Lanes& theta_i, const Lanes& cos_turn, float theta_o,
                                float variance, const RgbLanes& light) const {
  const auto sum = [&](const Lanes& weight) -> Rgb {
    return (light.colwise() * weight).colwise().sum().transpose();
  };
  if (fiber_.isotropic_white) {
    // S = 1 / pi^2, and the mean of the cosine over the Gaussian.
    return sum(theta_i.cos() * (std::exp(-0.5F * variance) / (kPif * kPif)));
  }
  const BlurredLobes lobes = blurred_lobes(theta_i, cos_turn, theta_o, variance);
  return color_r_ * sum(lobes.r) +
         (1.0F - color_r_) * (sum(lobes.r_grazing) + color_tt_ * sum(lobes.tt));
}

BcsdfTable::RgbLanes BcsdfTable::blurred_response(const Lanes& theta_i, const Lanes& cos_turn,
                                                  float theta_o, float variance) const {
  RgbLanes response;
  if (fiber_.isotropic_white) {
    response.colwise() = theta_i.cos() * (std::exp(-0.5F * variance) / (kPif * kPif));
    return response;
  }
  const BlurredLobes lobes = blurred_lobes(theta_i, cos_turn, theta_o, variance);
  for (int c = 0; c < 3; ++c) {
    response.col(c) =
        color_r_[c] * lobes.r + (1 - color_r_[c]) * (lobes.r_grazing + color_tt_[c] * lobes.tt);
  }
  return response;
}

void BcsdfTable::sh_coefficients(float theta_o, int order, float* out) const {
  assert(order >= 0 && order <= kMaxOrder);
  constexpr int kStride = sh_count(kMaxOrder) * 3;
  const RowPosition at = row_position(theta_o);
  const float* low = &sh_[static_cast<std::size_t>(at.row) * kStride];
  const float* high = low + kStride;
  for (int j = 0; j < 3 * sh_count(order); ++j) out[j] = low[j] + at.fraction * (high[j] - low[j]);
}

std::vector<BcsdfTable> bcsdf_tables(std::span<const FiberScattering> fibers) {
  return {fibers.begin(), fibers.end()};
}

}  // namespace heddle
