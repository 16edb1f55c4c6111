#include "render/environment_sgs.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "fibers/math/fibonacci_axes.h"
#include "fibers/math/nonnegative_least_squares.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/math/spherical_harmonics.h"
#include "render/bright_sources.h"

namespace heddle {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Colors = Eigen::Matrix<double, Eigen::Dynamic, 3>;

struct Lobes {
  std::vector<Vec3d> axes;
  std::vector<double> log_sharpness;
  Colors amplitudes;  // [lobe][rgb] factors of G

  Eigen::Index count() const { return static_cast<Eigen::Index>(axes.size()); }
  SphericalGaussian gaussian(Eigen::Index k) const {
    const auto at = static_cast<std::size_t>(k);
    return {axes[at], std::exp(log_sharpness[at])};
  }
};

// Below this a Gaussian is constant to 1 %.
constexpr double kLowestLogSharpness = -5.3;

// First moment of a normalised Gaussian along its axis: convolution multiplies them.
double moment(double sharpness) {
  return spherical_bessel_ratios(1, sharpness)[1];
}

// Sharpness before the blur: moment(result) moment(kEnvironmentBlur) = moment(blurred).
double without_blur(double blurred) {
  const double wanted = moment(blurred) / moment(kEnvironmentBlur);
  double low = 0;
  double high = kSharpestLight;
  if (moment(high) <= wanted) return high;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (moment(middle) < wanted ? low : high) = middle;
  }
  return low;
}

const double kHighestLogSharpness = std::log(kEnvironmentBlur);

// One resolution of the map, everything times the root of a pixel's solid angle.
class Level {
 public:
  explicit Level(const EnvironmentMap& map)
      : directions_(3, static_cast<Eigen::Index>(map.width()) * map.height()),
        roots_(directions_.cols()),
        target_(directions_.cols(), 3) {
    Eigen::Index k = 0;
    for (int row = 0; row < map.height(); ++row) {
      for (int column = 0; column < map.width(); ++column, ++k) {
        directions_.col(k) = map.centre(row, column);
        roots_[k] = std::sqrt(map.solid_angle(row));
        target_.row(k) = roots_[k] * map.pixel(row, column).cast<double>().matrix().transpose();
      }
    }
    norm_ = target_.norm();
  }

  VectorXd column(const SphericalGaussian& gaussian) const {
    return roots_.array() * (gaussian.sharpness *
                             ((gaussian.axis.transpose() * directions_).transpose().array() - 1))
                                .exp();
  }
  MatrixXd columns(const Lobes& lobes) const {
    MatrixXd result(directions_.cols(), lobes.count());
    for (Eigen::Index k = 0; k < lobes.count(); ++k) result.col(k) = column(lobes.gaussian(k));
    return result;
  }

  // Best colours for the shapes; returns the squared error.
  double fit_colors(Lobes& lobes) const {
    const MatrixXd columns_of = columns(lobes);
    MatrixXd gram = columns_of.transpose() * columns_of;
    gram.diagonal() *= 1 + 1e-9;  // two lobes may coincide
    lobes.amplitudes.resize(lobes.count(), 3);
    for (int c = 0; c < 3; ++c) {
      lobes.amplitudes.col(c) =
          nonnegative_least_squares(gram, columns_of.transpose() * target_.col(c));
    }
    return (target_ - columns_of * lobes.amplitudes).squaredNorm();
  }

  Colors residual(const Lobes& lobes) const {
    if (lobes.count() == 0) return target_;
    return target_ - columns(lobes) * lobes.amplitudes;
  }

  double relative(double squared_error) const {
    return norm_ > 0 ? std::sqrt(squared_error) / norm_ : 0;
  }

  // Levenberg-Marquardt steps of everything; the squared error never grows. Returns it.
  double refine(Lobes& lobes, int steps) const {
    for (double& value : lobes.log_sharpness) value = std::min(value, kHighestLogSharpness);
    double error = fit_colors(lobes);
    double damping = 1e-3;
    bool moved = true;
    Eigen::LDLT<MatrixXd> solver;
    MatrixXd normal;
    VectorXd right_side;
    for (int step = 0; step < steps && damping < 1e8; ++step) {
      if (moved) linearise(lobes, normal, right_side);
      MatrixXd damped = normal;
      const double floor = 1e-12 * normal.diagonal().maxCoeff();
      damped.diagonal() += damping * normal.diagonal() + VectorXd::Constant(normal.rows(), floor);
      solver.compute(damped);
      Lobes trial = stepped(lobes, solver.solve(right_side));
      const double trial_error = fit_colors(trial);
      moved = trial_error < error;
      if (moved) {
        const double gain = error - trial_error;
        lobes = std::move(trial);
        error = trial_error;
        damping = std::max(damping / 3, 1e-9);
        if (gain < 1e-7 * error) break;
      } else {
        damping *= 4;
      }
    }
    return error;
  }

 private:
  // Unknowns: colours [rgb][lobe], then shapes [two across the axis, one of log sharpness][lobe].
  void linearise(const Lobes& lobes, MatrixXd& normal, VectorXd& right_side) const {
    const Eigen::Index n = lobes.count();
    MatrixXd basis(directions_.cols(), 4 * n);  // G, then its derivatives
    basis.leftCols(n) = columns(lobes);
    for (Eigen::Index k = 0; k < n; ++k) {
      const SphericalGaussian g = lobes.gaussian(k);
      const Vec3d across = g.axis.unitOrthogonal();
      const Vec3d other = g.axis.cross(across);
      const auto value = basis.col(k).array();
      basis.col(n + k) =
          g.sharpness * (across.transpose() * directions_).transpose().array() * value;
      basis.col(2 * n + k) =
          g.sharpness * (other.transpose() * directions_).transpose().array() * value;
      basis.col(3 * n + k) =
          g.sharpness * ((g.axis.transpose() * directions_).transpose().array() - 1) * value;
    }
    MatrixXd gram = MatrixXd::Zero(4 * n, 4 * n);
    gram.selfadjointView<Eigen::Lower>().rankUpdate(basis.transpose());
    gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
    const Colors residual_of = target_ - basis.leftCols(n) * lobes.amplitudes;
    const Colors cross = basis.transpose() * residual_of;
    const Colors& a = lobes.amplitudes;
    const MatrixXd color_products = a * a.transpose();
    normal = MatrixXd::Zero(6 * n, 6 * n);
    right_side = VectorXd::Zero(6 * n);
    for (Eigen::Index c = 0; c < 3; ++c) {
      normal.block(c * n, c * n, n, n) = gram.topLeftCorner(n, n);
      right_side.segment(c * n, n) = cross.col(c).head(n);
    }
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index c = 0; c < 3; ++c) {
        normal.block(c * n, (3 + i) * n, n, n) =
            gram.block(0, (1 + i) * n, n, n) * a.col(c).asDiagonal();
        normal.block((3 + i) * n, c * n, n, n) = normal.block(c * n, (3 + i) * n, n, n).transpose();
        right_side.segment((3 + i) * n, n).array() +=
            a.col(c).array() * cross.col(c).segment((1 + i) * n, n).array();
      }
      for (Eigen::Index j = 0; j < 3; ++j) {
        normal.block((3 + i) * n, (3 + j) * n, n, n) =
            color_products.cwiseProduct(gram.block((1 + i) * n, (1 + j) * n, n, n));
      }
    }
  }

  Lobes stepped(const Lobes& lobes, const VectorXd& step) const {
    const Eigen::Index n = lobes.count();
    Lobes result = lobes;
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const Vec3d& axis = lobes.axes[at];
      const Vec3d across = axis.unitOrthogonal();
      // no more than the lobe's own width
      const double reach = 1 / std::sqrt(1 + std::exp(lobes.log_sharpness[at]));
      const double a = std::clamp(step[3 * n + k], -reach, reach);
      const double b = std::clamp(step[4 * n + k], -reach, reach);
      result.axes[at] = (axis + a * across + b * axis.cross(across)).normalized();
      result.log_sharpness[at] =
          std::clamp(lobes.log_sharpness[at] + std::clamp(step[5 * n + k], -1.0, 1.0),
                     kLowestLogSharpness, kHighestLogSharpness);
    }
    return result;
  }

  Eigen::Matrix3Xd directions_;  // [pixel]
  VectorXd roots_;               // [pixel] of solid angle
  Colors target_;                // [pixel][rgb]
  double norm_;
};

// The Gaussians that a greedy step chooses from, on one level.
class Dictionary {
 public:
  explicit Dictionary(const Level& level) {
    constexpr int kAxes = 400;  // 10 degrees apart; refinement moves them
    for (double log_sharpness = kLowestLogSharpness; log_sharpness < kHighestLogSharpness;
         log_sharpness += std::log(2.0)) {
      // all nearly constant
      if (log_sharpness > kLowestLogSharpness && log_sharpness < -0.5) continue;
      for (const Vec3d& axis :
           fibonacci_axes(FibonacciSet::kSphere, log_sharpness < -0.5 ? 1 : kAxes)) {
        gaussians_.push_back({axis, std::exp(log_sharpness)});
      }
    }
    columns_.resize(level.residual({}).rows(), static_cast<Eigen::Index>(gaussians_.size()));
    for (std::size_t k = 0; k < gaussians_.size(); ++k) {
      columns_.col(static_cast<Eigen::Index>(k)) =
          level.column(gaussians_[k]).normalized().cast<float>();
    }
  }

  const SphericalGaussian& best(const Colors& residual) const {
    const Eigen::MatrixXf taken = (columns_.transpose() * residual.cast<float>()).cwiseMax(0.0F);
    Eigen::Index best = 0;
    taken.rowwise().squaredNorm().maxCoeff(&best);
    return gaussians_[static_cast<std::size_t>(best)];
  }

 private:
  std::vector<SphericalGaussian> gaussians_;
  Eigen::MatrixXf columns_;  // [pixel][Gaussian], of length 1
};

// The map convolved with a normalised Gaussian of sharpness kEnvironmentBlur, on 128 x 64 pixels.
EnvironmentMap blurred(const EnvironmentMap& map) {
  constexpr int kWidth = 128;
  constexpr int kHeight = 64;
  // Source pixels much smaller than the kernel: 256 x 128, by averages or by repeating large ones.
  const int across = std::max(1, (2 * kWidth + map.width() - 1) / map.width());
  const int down = std::max(1, (2 * kHeight + map.height() - 1) / map.height());
  std::vector<Rgb> repeated;
  for (int row = 0; row < map.height() * down; ++row) {
    for (int column = 0; column < map.width() * across; ++column) {
      repeated.push_back(map.pixel(row / down, column / across));
    }
  }
  const EnvironmentMap source =
      EnvironmentMap(map.width() * across, map.height() * down, std::move(repeated))
          .reduced(2 * kWidth, 2 * kHeight);
  const double reach = 5 / std::sqrt(kEnvironmentBlur);  // exp(-12.5)
  std::vector<Rgb> result;
  for (int row = 0; row < kHeight; ++row) {
    const double polar = kPi * (row + 0.5) / kHeight;
    const int first = std::max(0, static_cast<int>((polar - reach) / kPi * source.height()));
    const int last =
        std::min(source.height() - 1, static_cast<int>((polar + reach) / kPi * source.height()));
    std::vector<Rgbd> sums(kWidth, Rgbd::Zero());
    double whole = 0;  // the same for all columns
    for (int r = first; r <= last; ++r) {
      // Source columns lie symmetrically about a target's: k + 1/2 columns to either side.
      const double other = kPi * (r + 0.5) / source.height();
      for (int k = 0; k < source.width() / 2; ++k) {
        const double azimuth = 2 * kPi * (k + 0.5) / source.width();
        const double cosine = std::cos(polar) * std::cos(other) +
                              std::sin(polar) * std::sin(other) * std::cos(azimuth);
        if (cosine < 1 - 0.5 * reach * reach) break;
        const double weight = source.solid_angle(r) * std::exp(kEnvironmentBlur * (cosine - 1));
        whole += 2 * weight;
        for (int column = 0; column < kWidth; ++column) {
          const int right = (2 * column + 1 + k) % source.width();
          const int left = (2 * column - k + source.width()) % source.width();
          sums[static_cast<std::size_t>(column)] +=
              weight * (source.pixel(r, left) + source.pixel(r, right)).cast<double>();
        }
      }
    }
    for (const Rgbd& sum : sums) result.push_back((sum / whole).cast<float>());
  }
  return {kWidth, kHeight, std::move(result)};
}

// The clamped cosine's factor of band l (Ramamoorthi and Hanrahan 2001, equation 8).
double cosine_factor(int l) {
  if (l == 0) return kPi;
  if (l == 1) return 2 * kPi / 3;
  if (l % 2 == 1) return 0;
  double factor = 2 * kPi / ((l + 2) * (l - 1)) * (l % 4 == 0 ? -1 : 1);
  for (int k = 1; k <= l / 2; ++k) factor *= (l / 2.0 + k) / (4.0 * k);
  return factor;
}

// Radiance to irradiance, in harmonics up to this order: of a directional light, the bands above
// hold 4e-4 of the square.
constexpr int kIrradianceOrder = 8;
constexpr int kIrradianceCount = sh_count(kIrradianceOrder);

Colors radiance_harmonics(const EnvironmentMap& map) {
  Colors sum = Colors::Zero(kIrradianceCount, 3);
  std::array<double, kIrradianceCount> y;
  for (int row = 0; row < map.height(); ++row) {
    for (int column = 0; column < map.width(); ++column) {
      evaluate_sh(kIrradianceOrder, map.centre(row, column), y.data());
      sum += map.solid_angle(row) * Eigen::Map<const VectorXd>(y.data(), kIrradianceCount) *
             map.pixel(row, column).cast<double>().matrix().transpose();
    }
  }
  return sum;
}

Colors radiance_harmonics(const std::vector<Light>& lights) {
  Colors sum = Colors::Zero(kIrradianceCount, 3);
  std::array<double, kIrradianceCount> y;
  for (const Light& light : lights) {
    evaluate_sh(kIrradianceOrder, light.axis.cast<double>().eval(), y.data());
    const std::vector<double> bands =
        spherical_bessel_ratios(kIrradianceOrder, static_cast<double>(light.sharpness));
    for (int l = 0; l <= kIrradianceOrder; ++l) {
      for (int j = l * l; j < (l + 1) * (l + 1); ++j)
        y[static_cast<std::size_t>(j)] *= bands[static_cast<std::size_t>(l)];
    }
    sum += Eigen::Map<const VectorXd>(y.data(), kIrradianceCount) *
           light.irradiance.cast<double>().matrix().transpose();
  }
  return sum;
}

// Relative RMS over normals.
double irradiance_error(const EnvironmentMap& map, const std::vector<Light>& lights) {
  Colors wanted =
      radiance_harmonics(map.reduced(std::min(map.width(), 512), std::min(map.height(), 256)));
  Colors difference = radiance_harmonics(lights) - wanted;
  for (int l = 0; l <= kIrradianceOrder; ++l) {
    wanted.middleRows(l * l, 2 * l + 1) *= cosine_factor(l);
    difference.middleRows(l * l, 2 * l + 1) *= cosine_factor(l);
  }
  return wanted.norm() > 0 ? difference.norm() / wanted.norm() : 0;
}

Rgbd energy_of(const std::vector<Light>& lights) {
  Rgbd sum = Rgbd::Zero();
  for (const Light& light : lights) sum += light.irradiance.cast<double>();
  return sum;
}

// All the light of the map, in each colour that the lights have.
void keep_energy(const EnvironmentMap& map, std::vector<Light>& lights) {
  const Rgbd wanted = map.integral();
  const Rgbd held = energy_of(lights);
  Rgb factor = Rgb::Ones();
  for (Eigen::Index c = 0; c < 3; ++c) {
    if (held[c] > 0) factor[c] = static_cast<float>(wanted[c] / held[c]);
  }
  for (Light& light : lights) light.irradiance *= factor;
}

EnvironmentSgs fit_smooth(const EnvironmentMap& map, int count) {
  const EnvironmentMap smooth = blurred(map);
  Lobes lobes;
  {
    const Level coarse(smooth.reduced(64, 32));
    const Dictionary dictionary(coarse);
    for (int k = 0; k < count; ++k) {
      const SphericalGaussian& next = dictionary.best(coarse.residual(lobes));
      lobes.axes.push_back(next.axis);
      lobes.log_sharpness.push_back(std::log(next.sharpness));
      coarse.refine(lobes, 5);
    }
    coarse.refine(lobes, 20);
  }
  const Level fine(smooth);
  const double squared_error = fine.refine(lobes, 40);

  EnvironmentSgs result;
  result.relative_error = fine.relative(squared_error);
  for (Eigen::Index k = 0; k < lobes.count(); ++k) {
    const SphericalGaussian g = lobes.gaussian(k);
    Light light;
    light.type = LightType::kSphericalGaussian;
    light.axis = g.axis.cast<float>();
    light.sharpness = static_cast<float>(without_blur(g.sharpness));
    light.irradiance =
        (lobes.amplitudes.row(k).transpose().array() * sg_mass(g.sharpness)).cast<float>();
    result.lights.push_back(light);
  }
  std::stable_sort(result.lights.begin(), result.lights.end(), [](const Light& a, const Light& b) {
    return a.irradiance.sum() > b.irradiance.sum();
  });
  return result;
}

}  // namespace

EnvironmentSgs fit_environment_sgs(const EnvironmentMap& map, int count, int bright_sources) {
  assert(count >= 1);
  EnvironmentSgs result;
  if (bright_sources > 0) {
    SplitEnvironment split = split_bright_sources(map, bright_sources);
    result = fit_smooth(split.rest, count);
    keep_energy(split.rest, result.lights);
    result.bright_sources = static_cast<int>(split.sources.size());
    result.lights.insert(result.lights.begin(), split.sources.begin(), split.sources.end());
  } else {
    result = fit_smooth(map, count);
  }
  result.irradiance_error = irradiance_error(map, result.lights);
  const Rgbd wanted = map.integral();
  if (wanted.sum() > 0)
    result.energy_error = (energy_of(result.lights) - wanted).abs().sum() / wanted.sum();
  return result;
}

}  // namespace heddle
