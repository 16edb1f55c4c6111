#include "render/rivals/bcsdf_factors.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "fibers/math/special_functions.h"
#include "fibers/math/symmetric_eigen.h"

namespace heddle {
namespace {

// Modes whose factor is below this share of mode 0 are left out.
constexpr double kLeastMode = 1e-5;

/// I_m(k) / I_0(k) for m = 0 .. , as long as they count, by backward recurrence.
std::vector<double> mode_ratios(double k, int highest) {
  std::vector<double> ratio(static_cast<std::size_t>(highest) + 1, 1.0);
  double quotient = 0;  // I_{m+1} / I_m
  for (int m = highest + 40; m >= 1; --m) {
    quotient = 1 / (2.0 * m / k + quotient);  // I_m / I_{m-1}
    if (m <= highest) ratio[static_cast<std::size_t>(m)] = quotient;
  }
  for (std::size_t m = 1; m < ratio.size(); ++m) ratio[m] *= ratio[m - 1];
  while (ratio.size() > 1 && ratio.back() < kLeastMode) ratio.pop_back();
  return ratio;
}

}  // namespace

BcsdfFactors::BcsdfFactors(const FiberScattering& fiber, int terms, Matrix matrix) {
  constexpr double kFinest = kPi / 512;
  constexpr double kCoarsest = kPi / 96;
  const double narrowest = fiber.isotropic_white ? kPi : std::min(fiber.beta_r, fiber.beta_tt);
  thetas_ = static_cast<int>(std::lround(kPi / std::clamp(0.5 * narrowest, kFinest, kCoarsest)));
  const auto theta = [&](int i) { return kPi * ((i + 0.5) / thetas_ - 0.5); };

  // Factors of cos(m (phi_o - phi_i)) in TT's azimuth, whose mean is 1 / 2 pi.
  std::vector<double> scales = {1 / (2 * kPi)};
  if (!fiber.isotropic_white) {
    const std::vector<double> ratios = mode_ratios(1 / (fiber.gamma_tt * fiber.gamma_tt), kMaxMode);
    for (std::size_t m = 1; m < ratios.size(); ++m)
      scales.push_back((m % 2 != 0 ? -1 : 1) * ratios[m] / kPi);
  }

  // TT's longitudinal part: its value straight on over the azimuth's there.
  double straight_on = scales[0];
  for (std::size_t m = 1; m < scales.size(); ++m) straight_on += std::abs(scales[m]);
  std::array<Block, 3> both;
  std::array<Block, 3> tt;
  for (int c = 0; c < 3; ++c) {
    both[static_cast<std::size_t>(c)].resize(thetas_, thetas_);
    tt[static_cast<std::size_t>(c)].resize(thetas_, thetas_);
  }
  for (int i = 0; i < thetas_; ++i) {
    const Vec3d wi = vector_from({theta(i), 0});
    for (int o = 0; o < thetas_; ++o) {
      const Vec3d wo = vector_from({theta(o), kPi});
      const Rgbd r = std::cos(theta(i)) * evaluate_bcsdf(fiber, wi, wo, Lobe::kR);
      const Rgbd t = std::cos(theta(i)) * evaluate_bcsdf(fiber, wi, wo, Lobe::kTt) / straight_on;
      for (int c = 0; c < 3; ++c) {
        both[static_cast<std::size_t>(c)](i, o) = static_cast<float>(r[c] + scales[0] * t[c]);
        tt[static_cast<std::size_t>(c)](i, o) = static_cast<float>(t[c]);
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    const auto at = static_cast<std::size_t>(c);
    if (terms != kAllTerms) {
      cut(both[at], tt[at], scales, terms, matrix, c);
      continue;
    }
    terms_[at] = thetas_ * static_cast<int>(2 * scales.size() - 1);
    energy_[at] = 1;
    colours_[at].blocks = {both[at], tt[at]};
    colours_[at].modes = {{0, 0, 1.0F}};
    for (std::size_t m = 1; m < scales.size(); ++m) {
      colours_[at].modes.push_back({static_cast<int>(m), 1, static_cast<float>(scales[m])});
    }
  }
  for (const Colour& colour : colours_) {
    for (const Mode& mode : colour.modes) highest_mode_ = std::max(highest_mode_, mode.m);
  }
}

void BcsdfFactors::cut(const Block& both, const Block& tt, const std::vector<double>& mode_scales,
                       int terms, Matrix matrix, int c) {
  // What the blocks, which hold S cos(theta_i), are multiplied by on either side.
  Eigen::ArrayXd left(thetas_);
  Eigen::ArrayXd right(thetas_);
  for (int i = 0; i < thetas_; ++i) {
    const double cosine = std::cos(kPi * ((i + 0.5) / thetas_ - 0.5));
    left[i] = matrix == Matrix::kWeighted ? std::sqrt(cosine) : 1 / cosine;
    right[i] = matrix == Matrix::kWeighted ? std::sqrt(cosine) : 1;
  }
  const auto scaled = [&](const Block& block) -> Eigen::MatrixXd {
    return left.matrix().asDiagonal() * block.cast<double>() * right.matrix().asDiagonal();
  };
  const Eigen::MatrixXd scaled_both = scaled(both);
  const Eigen::MatrixXd scaled_tt = scaled(tt);
  const RightSingular singular_both = right_singular(scaled_both);
  const RightSingular singular_tt = right_singular(scaled_tt);

  // Singular values of the whole matrix: cos(m (phi_o - phi_i)) has the norm 2 pi for m = 0, pi
  // twice for the others.
  struct Term {
    double value;
    int m;
  };
  std::vector<Term> candidates;
  double total = 0;
  for (int i = 0; i < thetas_; ++i) {
    candidates.push_back({2 * kPi * singular_both.values[i], 0});
    total += candidates.back().value * candidates.back().value;
    for (std::size_t m = 1; m < mode_scales.size(); ++m) {
      candidates.push_back(
          {kPi * std::abs(mode_scales[m]) * singular_tt.values[i], static_cast<int>(m)});
      total += 2 * candidates.back().value * candidates.back().value;
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Term& a, const Term& b) {
    return std::tie(b.value, a.m) < std::tie(a.value, b.m);
  });
  std::vector<int> kept(mode_scales.size(), 0);
  int spent = 0;
  double held = 0;
  for (const Term& term : candidates) {
    const int cost = term.m == 0 ? 1 : 2;
    if (spent + cost > terms) break;
    spent += cost;
    held += cost * term.value * term.value;
    ++kept[static_cast<std::size_t>(term.m)];
  }
  const auto at = static_cast<std::size_t>(c);
  terms_[at] = spent;
  energy_[at] = total > 0 ? held / total : 1;

  const auto rebuilt = [&](const Eigen::MatrixXd& whole, const RightSingular& singular,
                           int rank) -> Block {
    return (left.inverse().matrix().asDiagonal() * of_rank(whole, singular, rank) *
            right.inverse().matrix().asDiagonal())
        .cast<float>();
  };
  for (std::size_t m = 0; m < kept.size(); ++m) {
    if (kept[m] == 0) continue;
    colours_[at].modes.push_back({static_cast<int>(m), static_cast<int>(colours_[at].blocks.size()),
                                  m == 0 ? 1.0F : static_cast<float>(mode_scales[m])});
    colours_[at].blocks.push_back(m == 0 ? rebuilt(scaled_both, singular_both, kept[m])
                                         : rebuilt(scaled_tt, singular_tt, kept[m]));
  }
}

Rgb BcsdfFactors::value(const Vec3& wi, const Vec3& wo) const {
  const auto place = [&](float sine) {
    const float theta = std::asin(std::clamp(sine, -1.0F, 1.0F));
    return std::clamp((theta / kPif + 0.5F) * static_cast<float>(thetas_) - 0.5F, 0.0F,
                      static_cast<float>(thetas_ - 1));
  };
  const float row = place(wi.x());
  const float column = place(wo.x());
  const int i = std::min(static_cast<int>(row), thetas_ - 2);
  const int o = std::min(static_cast<int>(column), thetas_ - 2);
  const float u = row - static_cast<float>(i);
  const float v = column - static_cast<float>(o);
  const float delta = std::atan2(wo.z(), wo.y()) - std::atan2(wi.z(), wi.y());
  Rgb result = Rgb::Zero();
  for (int c = 0; c < 3; ++c) {
    const Colour& colour = colours_[static_cast<std::size_t>(c)];
    for (const Mode& mode : colour.modes) {
      const Block& block = colour.blocks[static_cast<std::size_t>(mode.block)];
      result[c] += mode.scale * std::cos(static_cast<float>(mode.m) * delta) *
                   ((1 - u) * ((1 - v) * block(i, o) + v * block(i, o + 1)) +
                    u * ((1 - v) * block(i + 1, o) + v * block(i + 1, o + 1)));
    }
  }
  return result;
}

Rgb BcsdfFactors::response(const Vec3& axis, float sharpness, const Vec3& wo) const {
  // Beyond this many deviations of the Gaussian nothing is left: exp(-10).
  constexpr float kReach = 4.5F;
  const float step = kPif / static_cast<float>(thetas_);
  const float theta_axis = std::asin(std::clamp(axis.x(), -1.0F, 1.0F));
  const float reach = kReach / std::sqrt(sharpness + 1e-6F);
  const auto index = [&](float theta) {
    return std::clamp(
        static_cast<int>(std::floor((theta / kPif + 0.5F) * static_cast<float>(thetas_))), 0,
        thetas_ - 1);
  };
  const int first = reach < kPif ? index(theta_axis - reach) : 0;
  const int last = reach < kPif ? index(theta_axis + reach) : thetas_ - 1;

  const float theta_o = std::asin(std::clamp(wo.x(), -1.0F, 1.0F));
  const float column = std::clamp((theta_o / kPif + 0.5F) * static_cast<float>(thetas_) - 0.5F,
                                  0.0F, static_cast<float>(thetas_ - 1));
  const int o = std::min(static_cast<int>(column), thetas_ - 2);
  const float v = column - static_cast<float>(o);
  const float delta = std::atan2(wo.z(), wo.y()) - std::atan2(axis.z(), axis.y());

  std::array<float, kMaxMode + 1> azimuth;  // [m] cos(m delta)
  for (int m = 0; m <= highest_mode_; ++m) {
    azimuth[static_cast<std::size_t>(m)] = std::cos(static_cast<float>(m) * delta);
  }
  std::array<float, kMaxMode + 1> bessel;  // [m] I_m(a) exp(-a)
  const float cos_axis = std::cos(theta_axis);
  Rgb sum = Rgb::Zero();
  for (int i = first; i <= last; ++i) {
    const float theta =
        kPif * ((static_cast<float>(i) + 0.5F) / static_cast<float>(thetas_) - 0.5F);
    const float s = std::sin(0.5F * (theta - theta_axis));
    const float a = sharpness * cos_axis * std::cos(theta);
    // The density's measure is cos(theta) d theta d phi.
    const float weight = std::exp(-2 * sharpness * s * s) * std::cos(theta) * step * 2 * kPif;
    // I_m / I_{m-1} by backward recurrence from Amos' bound (1974) for the ratio a few orders
    // further up.
    const int top = highest_mode_ + 4;
    const auto above = static_cast<float>(top);
    float quotient = a / (above + 0.5F + std::sqrt((above + 1.5F) * (above + 1.5F) + a * a));
    for (int m = top; m >= 1; --m) {
      quotient = a / (2.0F * static_cast<float>(m) + a * quotient);
      if (m <= highest_mode_) bessel[static_cast<std::size_t>(m)] = quotient;
    }
    bessel[0] = weight * scaled_bessel_i0(a);
    for (int m = 1; m <= highest_mode_; ++m) {
      bessel[static_cast<std::size_t>(m)] *= bessel[static_cast<std::size_t>(m - 1)];
    }
    for (int c = 0; c < 3; ++c) {
      const Colour& colour = colours_[static_cast<std::size_t>(c)];
      float of_block = 0;
      for (std::size_t k = 0; k < colour.modes.size(); ++k) {
        const Mode& mode = colour.modes[k];
        const auto m = static_cast<std::size_t>(mode.m);
        of_block += mode.scale * azimuth[m] * bessel[m];
        // Modes of one block stand together.
        if (k + 1 < colour.modes.size() && colour.modes[k + 1].block == mode.block) continue;
        const Block& block = colour.blocks[static_cast<std::size_t>(mode.block)];
        sum[c] += of_block * ((1 - v) * block(i, o) + v * block(i, o + 1));
        of_block = 0;
      }
    }
  }
  return sum;
}

}  // namespace heddle
