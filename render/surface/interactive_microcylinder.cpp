#include "render/surface/interactive_microcylinder.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

constexpr double kHalfPi = 0.5 * kPi;

// Nodes per angle over which smooth factors are averaged.
constexpr int kSide = 4;
using Nodes = Eigen::Array<double, kSide, 1>;
constexpr int kGrid = kSide * kSide;

// What is thrown away: light times lobe below this share of the lobe's peak.
constexpr double kNegligible = 1e-4;

// Wider is constant over half a turn.
constexpr double kWidest = 1e3;

struct Angles {
  double theta;
  double phi;
};

Angles angles_of(const Vec3d& w) {  // components along tangent, binormal, normal
  return {std::asin(std::clamp(w.x(), -1.0, 1.0)), std::atan2(w.y(), w.z())};
}

// Nodes about the middle of a Gaussian within the domain, and their weights, which sum to 1.
struct Average {
  Nodes at;
  Nodes weight;
};
Average one_node(double at) {
  return {Nodes::Constant(std::clamp(at, -kHalfPi, kHalfPi)), Nodes::Constant(1.0 / kSide)};
}
Average average_over(const CircularGaussian& gaussian) {
  // Over 4 degrees smooth factors change by less than what else is neglected.
  if (gaussian.width < 0.07) return one_node(gaussian.mean);
  static const QuadratureRule& rule = gauss_legendre(kSide);
  const double reach = gaussian.width < 1.1 ? 2 * std::asin(0.9 * gaussian.width) : kPi;  // 1.8 widths
  const double begin = std::clamp(gaussian.mean - reach, -kHalfPi, kHalfPi);
  const double end = std::clamp(gaussian.mean + reach, -kHalfPi, kHalfPi);
  Average result;
  result.at = 0.5 * (begin + end) + 0.5 * (end - begin) * Eigen::Map<const Nodes>(rule.nodes.data());
  const Nodes half = 0.5 * (result.at - gaussian.mean);
  // sin 2x = 2 sin x cos x: means lie up to half a turn from 0, so that |half| <= 3 pi / 4.
  const Nodes quarter = sine_of_quarter(Nodes(0.5 * half));
  const Nodes sine = 4 / gaussian.width * quarter * (1 - quarter.square()).sqrt();
  const Nodes exponent = -sine * sine;
  result.weight = Eigen::Map<const Nodes>(rule.weights.data()) * (exponent - exponent.maxCoeff()).exp();
  result.weight /= result.weight.sum();
  return result;
}

// Where nothing but the surface itself hides.
SignedDistance distance_to_horizon(const Vec3d& direction) {
  const Vec3d up = Vec3d(0, 0, 1) - direction.z() * direction;
  const double length = up.norm();
  return {std::asin(std::clamp(direction.z(), -1.0, 1.0)), length > 1e-9 ? Vec3d(up / length) : Vec3d(Vec3d::Zero())};
}

Nodes cosine_of(const Nodes& x) {  // |x| <= pi
  const Nodes half = sine_of_quarter(Nodes(0.5 * x));
  return 1 - 2 * half * half;
}

}  // namespace

struct InteractiveMicrocylinder::Tangent {
  Mat3d frame;  // patch = frame * thread
  int thread;
  ThreadScattering scattering;
};

/// A thread's lobe in theta: amplitude gc(theta_i; -theta_o, width); the isotropic part has infinite width.
struct InteractiveMicrocylinder::Lobe {
  double width;
  double amplitude;
  bool surface;
};

/// The product of a light and a lobe, as two Gaussians in the angles of a tangent.
struct InteractiveMicrocylinder::Around {
  const Mat3d& frame;  // patch = frame * thread
  CircularGaussian theta;
  CircularGaussian phi;

  /// The mean, moved into the domain.
  Angles inside() const {
    const double edge = kHalfPi - 1e-3;  // poles of the thread frame have no azimuth
    return {std::clamp(theta.mean, -edge, edge), std::clamp(phi.mean, -kHalfPi, kHalfPi)};
  }
  Vec3d direction(const Angles& at) const {
    return frame *
           Vec3d(std::sin(at.theta), std::cos(at.theta) * std::sin(at.phi), std::cos(at.theta) * std::cos(at.phi));
  }
};

InteractiveMicrocylinder::InteractiveMicrocylinder(const MicrocylinderFabric& fabric,
                                                   const InteractiveSettings& settings)
    : InteractiveMicrocylinder(fabric, settings,
                               WeightingTable(fabric, tangent_samples(fabric, settings.most_tangents),
                                              settings.weighting, settings.table)) {}

InteractiveMicrocylinder::InteractiveMicrocylinder(const MicrocylinderFabric& fabric,
                                                   const InteractiveSettings& settings, WeightingTable table)
    : fabric_(fabric),
      settings_(settings),
      samples_(tangent_samples(fabric, settings.most_tangents)),
      table_(std::move(table)),
      gains_(settings.printed ? std::make_unique<const SigmoidGains>() : nullptr) {
  assert(samples_.size() == table_.ranks().size());
  prepare();
}

InteractiveMicrocylinder::~InteractiveMicrocylinder() = default;

void InteractiveMicrocylinder::set_scattering(std::size_t thread, const ThreadParameters& parameters) {
  assert(thread < fabric_.threads.size());
  fabric_.threads[thread].scattering = parameters;
  prepare();
}

void InteractiveMicrocylinder::prepare() {
  tangents_.clear();
  for (const TangentSample& sample : samples_) {
    ThreadParameters parameters = fabric_.threads[static_cast<std::size_t>(sample.thread)].scattering;
    if (!settings_.printed) {
      // theta_h turns with the tangent, so the mean over a piece is nearly a lobe of larger variance.
      const bool deviations = fabric_.conventions.width == ThreadConventions::Width::kStandardDeviation;
      const double spread = (deviations ? 1 : std::sqrt(2.0)) * sample.deviation;
      parameters.gamma_s = std::hypot(parameters.gamma_s, spread);
      parameters.gamma_v = std::hypot(parameters.gamma_v, spread);
    }
    tangents_.push_back({sample.frame(), sample.thread, ThreadScattering(parameters, fabric_.conventions)});
  }
}

Rgbd InteractiveMicrocylinder::reflected(const Vec3d& wi, const Vec3d& wo) const {
  const std::vector<double> weights = thread_weights(fabric_, samples_, settings_.weighting, wi, wo);
  Rgbd sum = Rgbd::Zero();
  for (std::size_t t = 0; t < weights.size(); ++t) {
    if (weights[t] == 0) continue;
    const Angles i = angles_of(tangents_[t].frame.transpose() * wi);
    const Angles o = angles_of(tangents_[t].frame.transpose() * wo);
    sum += weights[t] * std::cos(i.theta) * tangents_[t].scattering.value(i.theta, i.phi, o.theta, o.phi);
  }
  return sum;
}

double InteractiveMicrocylinder::clipped(const Around& around, const PointVisibility& visibility) const {
  const Angles at = around.inside();
  const double cos_theta = std::cos(at.theta);
  const double sin_theta = std::sin(at.theta);
  const double cos_phi = std::cos(at.phi);
  const double sin_phi = std::sin(at.phi);
  const Vec3d direction = around.direction(at);
  const SignedDistance distance = visibility.maps == nullptr
                                      ? distance_to_horizon(direction)
                                      : visibility.maps->evaluate(visibility.coefficients, direction);
  VisibilityLine line =
      visibility_line(distance, cos_theta, around.frame * Vec3d(cos_theta, -sin_theta * sin_phi, -sin_theta * cos_phi),
                      around.frame * Vec3d(0, cos_phi, -sin_phi));
  line.distance +=
      line.theta_gradient * (around.theta.mean - at.theta) + line.phi_gradient * (around.phi.mean - at.phi);
  if (!settings_.printed) return clipped_gaussians(around.theta, around.phi, line);
  const double gain = gains_->gain(around.theta.width, around.phi.width, line.theta_gradient, line.phi_gradient);
  return unoccluded_gaussians_printed(around.theta, around.phi) / (1 + std::exp(-gain * line.distance));
}

Rgbd InteractiveMicrocylinder::shade(const Mat3d& frame, const Vec3d& wo, std::span<const Light> lights,
                                     const PointVisibility& visibility) const {
  const Vec3d out = frame.transpose() * wo;
  Rgbd radiance = Rgbd::Zero();
  if (out.z() <= 0) return radiance;
  const WeightingTable::Outgoing outgoing = table_.outgoing(out);

  for (const Light& light : lights) {
    if (!light.is_directional()) continue;
    const Vec3d wi = frame.transpose() * light.axis.cast<double>();
    const bool visible =
        visibility.maps == nullptr || visibility.maps->evaluate(visibility.coefficients, wi).distance > 0;
    if (visible) radiance += light.irradiance.cast<double>() * reflected(wi, out);
  }

  for (std::size_t t = 0; t < tangents_.size(); ++t) {
    const Tangent& tangent = tangents_[t];
    const Vec3d out_thread = tangent.frame.transpose() * out;
    if (out_thread.z() <= 0) continue;
    const Angles o = angles_of(out_thread);
    const ThreadScattering& scattering = tangent.scattering;
    const ThreadParameters& parameters = scattering.parameters();
    // g(theta_h) of deviation d is gc(theta_i; -theta_o, sqrt(8) d) / (sqrt(2 pi) d) to a good approximation.
    const auto lobe_of = [](double deviation, double share, bool surface) {
      return Lobe{std::sqrt(8.0) * deviation, share / (std::sqrt(2 * kPi) * deviation), surface};
    };
    const std::array<Lobe, 3> lobes = {lobe_of(scattering.surface_deviation(), 1, true),
                                       lobe_of(scattering.volume_deviation(), 1 - parameters.kd, false),
                                       Lobe{kWidest, parameters.kd, false}};

    for (const Light& light : lights) {
      if (light.is_directional()) continue;
      const double sharpness = static_cast<double>(light.sharpness);
      const Vec3d axis = frame.transpose() * light.axis.cast<double>();
      const Angles k = angles_of(tangent.frame.transpose() * axis);
      const CircularGaussian theta_k{k.theta, std::min(width_of_sharpness(sharpness), kWidest)};
      Rgbd sum = Rgbd::Zero();
      for (const Lobe& lobe : lobes) {
        if (lobe.amplitude == 0) continue;
        const CircularGaussianProduct product = circular_gaussian_product(theta_k, {-o.theta, lobe.width});
        if (product.amplitude < kNegligible) continue;
        const double theta_l = product.gaussian.mean;
        const Around around{tangent.frame,
                            {theta_l, std::min(product.gaussian.width, kWidest)},
                            {k.phi, std::min(azimuthal_width(theta_k.width, theta_l, k.theta), kWidest)}};
        const double integral = clipped(around, visibility);
        if (integral <= 0) continue;

        double weight = 0;
        Average theta;
        Average phi;
        if (settings_.printed) {
          weight = table_.value(t, outgoing, axis, sharpness);
          theta = one_node(theta_l);
          phi = {Nodes::Constant(o.phi + std::remainder(k.phi - o.phi, 2 * kPi)), Nodes::Constant(1.0 / kSide)};
        } else {
          const Angles at = around.inside();
          const double across = around.phi.width * std::cos(at.theta);
          const double width = std::sqrt(0.5 * (std::pow(around.theta.width, 2) + across * across));
          weight = table_.value(t, outgoing, around.direction(at), sharpness_of_width(width));
          theta = average_over(around.theta);
          phi = average_over(around.phi);
        }
        if (weight <= 0) continue;

        // Smooth factors on the grid of nodes: cos^2 theta_i / cos^2 theta_d and what depends on both angles.
        const Nodes cos_theta = cosine_of(theta.at);
        const Nodes cos_theta_d = cosine_of(Nodes(0.5 * (theta.at - o.theta)));
        Nodes along = theta.weight * cos_theta.square() / cos_theta_d.square().max(1e-12);
        if (!lobe.surface) along /= cos_theta + std::cos(o.theta);
        const Nodes cos_half_phi_d =
            cosine_of(Nodes(0.5 * (phi.at - o.phi)));  // both in the domain: within half a turn
        Lanes<kGrid> cosine;
        for (int a = 0; a < kSide; ++a) cosine.segment<kSide>(a * kSide) = cos_theta_d[a] * cos_half_phi_d;
        const Lanes<kGrid> reflectance = fresnel_reflectance<kGrid>(parameters.ior, cosine.max(0.0));
        double smooth = 0;
        for (int a = 0; a < kSide; ++a) {
          const Nodes fresnel = reflectance.segment<kSide>(a * kSide);
          Nodes factor;
          if (lobe.surface) {
            factor = fresnel * cos_half_phi_d;
          } else if (fabric_.conventions.fresnel == ThreadConventions::Fresnel::kHalf) {
            factor = (1 - fresnel).square();
          } else {
            const Nodes normal = (cos_theta[a] * cosine_of(phi.at)).max(0.0);
            factor = (1 - fresnel_reflectance<kSide>(parameters.ior, normal)) *
                     (1 - fresnel_reflectance<1>(parameters.ior, Lanes<1>(out_thread.z()))[0]);
          }
          smooth += along[a] * (phi.weight * factor).sum();
        }
        const double value = weight * smooth * lobe.amplitude * product.amplitude * integral;
        sum += lobe.surface ? Rgbd(Rgbd::Constant(value)) : Rgbd(value * parameters.albedo);
      }
      radiance += sum * light.irradiance.cast<double>() / sg_mass(sharpness);
    }
  }
  return radiance;
}

Rgbd ray_traced_radiance(const std::function<Rgbd(const Vec3d& wi, const Vec3d& wo)>& reflected, const Mat3d& frame,
                         const Vec3d& wo, std::span<const Light> lights,
                         const std::function<bool(const Vec3& direction)>& visible, int strata) {
  const Vec3d out = frame.transpose() * wo;
  Rgbd radiance = Rgbd::Zero();
  const auto from = [&](const Vec3d& world) -> Rgbd {
    const Vec3d wi = frame.transpose() * world;
    if (wi.z() <= 0 || !visible(world.cast<float>())) return Rgbd::Zero();
    return reflected(wi, out);
  };
  for (const Light& light : lights) {
    const Vec3d axis = light.axis.cast<double>();
    const Rgbd irradiance = light.irradiance.cast<double>();
    if (light.is_directional()) {
      radiance += irradiance * from(axis);
      continue;
    }
    const Vec3d across = axis.unitOrthogonal();
    const Vec3d other = axis.cross(across);
    const double sharpness = static_cast<double>(light.sharpness);
    Rgbd sum = Rgbd::Zero();
    for (int i = 0; i < strata; ++i) {
      // The distance within which the share (i + 1/2) / strata of the light lies.
      const double share = (i + 0.5) / strata;
      const double depth = sharpness < 1e-6 ? 2 * share : -std::log1p(share * std::expm1(-2 * sharpness)) / sharpness;
      const double cosine = 1 - depth;
      const double sine = std::sqrt(std::max(0.0, depth * (2 - depth)));
      for (int j = 0; j < strata; ++j) {
        const double azimuth = 2 * kPi * (j + 0.5 * (i % 2)) / strata;
        sum += from(cosine * axis + sine * (std::cos(azimuth) * across + std::sin(azimuth) * other));
      }
    }
    radiance += irradiance * sum / (static_cast<double>(strata) * strata);
  }
  return radiance;
}

}  // namespace heddle
