#include "render/surface/interactive_microcylinder.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

// Nodes per angle over which smooth factors are averaged.
constexpr int kSide = 4;
using Nodes = Eigen::Array<double, kSide, 1>;
constexpr int kGrid = kSide * kSide;

// What is thrown away: light times lobe below this share of the lobe's peak.
constexpr double kNegligible = 1e-4;

// Wider is constant over half a turn.
constexpr double kWidest = 1e3;

// Means keep this far from the poles of a thread's frame, which have no azimuth.
constexpr double kEdge = 1e-3;

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
  // 1.8 widths
  const double reach = gaussian.width < 1.1 ? 2 * std::asin(0.9 * gaussian.width) : kPi;
  const double begin = std::clamp(gaussian.mean - reach, -kHalfPi, kHalfPi);
  const double end = std::clamp(gaussian.mean + reach, -kHalfPi, kHalfPi);
  Average result;
  result.at =
      0.5 * (begin + end) + 0.5 * (end - begin) * Eigen::Map<const Nodes>(rule.nodes.data());
  const Nodes half = 0.5 * (result.at - gaussian.mean);
  // sin 2x = 2 sin x cos x: means lie up to half a turn from 0, so that |half| <= 3 pi / 4.
  const Nodes quarter = sine_of_quarter(Nodes(0.5 * half));
  const Nodes sine = 4 / gaussian.width * quarter * (1 - quarter.square()).sqrt();
  const Nodes exponent = -sine * sine;
  result.weight =
      Eigen::Map<const Nodes>(rule.weights.data()) * (exponent - exponent.maxCoeff()).exp();
  result.weight /= result.weight.sum();
  return result;
}

// Where nothing but the surface itself hides.
SignedDistance distance_to_horizon(const Vec3d& direction) {
  const Vec3d up = Vec3d(0, 0, 1) - direction.z() * direction;
  const double length = up.norm();
  return {std::asin(std::clamp(direction.z(), -1.0, 1.0)),
          length > 1e-9 ? Vec3d(up / length) : Vec3d(Vec3d::Zero())};
}

Nodes cosine_of(const Nodes& x) {  // |x| <= pi
  const Nodes half = sine_of_quarter(Nodes(0.5 * x));
  return 1 - 2 * half * half;
}

}  // namespace

/// A thread's lobe in theta: amplitude gc(theta_i; -theta_o, width); the isotropic part has
/// infinite width.
struct InteractiveMicrocylinder::Lobe {
  double width;
  double amplitude;
  bool surface;
};

struct InteractiveMicrocylinder::Tangent {
  Mat3d frame;  // patch = frame * thread
  int thread;
  ThreadScattering scattering;
  std::array<Lobe, 3> lobes;
};

std::array<InteractiveMicrocylinder::Lobe, 3> InteractiveMicrocylinder::lobes_of(
    const ThreadScattering& scattering) {
  // g(theta_h) of deviation d is gc(theta_i; -theta_o, sqrt(8) d) / (sqrt(2 pi) d) to a good
  // approximation.
  const auto lobe_of = [](double deviation, double share, bool surface) {
    return Lobe{std::sqrt(8.0) * deviation, share / (std::sqrt(2 * kPi) * deviation), surface};
  };
  const double kd = scattering.parameters().kd;
  return {lobe_of(scattering.surface_deviation(), 1, true),
          lobe_of(scattering.volume_deviation(), 1 - kd, false), Lobe{kWidest, kd, false}};
}

/// The product of a light and a lobe, as two Gaussians in the angles of a tangent.
struct InteractiveMicrocylinder::Around {
  const Mat3d& frame;  // patch = frame * thread
  CircularGaussian theta;
  CircularGaussian phi;

  /// The mean, moved into the domain.
  Angles inside() const {
    const double most = kHalfPi - kEdge;
    return {std::clamp(theta.mean, -most, most), std::clamp(phi.mean, -kHalfPi, kHalfPi)};
  }
  Vec3d direction(const Angles& at) const {
    return frame * Vec3d(std::sin(at.theta), std::cos(at.theta) * std::sin(at.phi),
                         std::cos(at.theta) * std::cos(at.phi));
  }
};

InteractiveMicrocylinder::InteractiveMicrocylinder(const MicrocylinderFabric& fabric,
                                                   const InteractiveSettings& settings)
    : InteractiveMicrocylinder(
          fabric, settings,
          WeightingTable(fabric, tangent_samples(fabric, settings.most_tangents),
                         settings.weighting, settings.table)) {}

InteractiveMicrocylinder::InteractiveMicrocylinder(const MicrocylinderFabric& fabric,
                                                   const InteractiveSettings& settings,
                                                   WeightingTable table)
    : fabric_(fabric),
      settings_(settings),
      samples_(tangent_samples(fabric, settings.most_tangents)),
      table_(std::move(table)),
      gains_(settings.printed ? std::make_unique<const SigmoidGains>() : nullptr) {
  assert(samples_.size() == table_.ranks().size());
  prepare();
}

InteractiveMicrocylinder::~InteractiveMicrocylinder() = default;

void InteractiveMicrocylinder::set_scattering(std::size_t thread,
                                              const ThreadParameters& parameters) {
  assert(thread < fabric_.threads.size());
  fabric_.threads[thread].scattering = parameters;
  prepare();
}

void InteractiveMicrocylinder::prepare() {
  tangents_.clear();
  for (const TangentSample& sample : samples_) {
    ThreadParameters parameters =
        fabric_.threads[static_cast<std::size_t>(sample.thread)].scattering;
    if (!settings_.printed) {
      // theta_h turns with the tangent, so the mean over a piece is nearly a lobe of larger
      // variance.
      const bool deviations =
          fabric_.conventions.width == ThreadConventions::Width::kStandardDeviation;
      const double spread = (deviations ? 1 : std::sqrt(2.0)) * sample.deviation;
      parameters.gamma_s = std::hypot(parameters.gamma_s, spread);
      parameters.gamma_v = std::hypot(parameters.gamma_v, spread);
    }
    const ThreadScattering scattering(parameters, fabric_.conventions);
    tangents_.push_back({sample.frame(), sample.thread, scattering, lobes_of(scattering)});
  }
}

Rgbd InteractiveMicrocylinder::reflected(const Vec3d& wi, const Vec3d& wo) const {
  const std::vector<double> weights =
      thread_weights(fabric_, samples_, settings_.weighting, wi, wo);
  Rgbd sum = Rgbd::Zero();
  for (std::size_t t = 0; t < weights.size(); ++t) {
    if (weights[t] == 0) continue;
    const Angles i = angles_of(tangents_[t].frame.transpose() * wi);
    const Angles o = angles_of(tangents_[t].frame.transpose() * wo);
    sum += weights[t] * std::cos(i.theta) *
           tangents_[t].scattering.value(i.theta, i.phi, o.theta, o.phi);
  }
  return sum;
}

double InteractiveMicrocylinder::clipped(const Around& around,
                                         const PointVisibility& visibility) const {
  const Angles at = around.inside();
  const double cos_theta = std::cos(at.theta);
  const double sin_theta = std::sin(at.theta);
  const double cos_phi = std::cos(at.phi);
  const double sin_phi = std::sin(at.phi);
  const Vec3d direction = around.direction(at);
  const SignedDistance distance =
      visibility.maps == nullptr ? distance_to_horizon(direction)
                                 : visibility.maps->evaluate(visibility.coefficients, direction);
  VisibilityLine line =
      visibility_line(distance, cos_theta,
                      around.frame * Vec3d(cos_theta, -sin_theta * sin_phi, -sin_theta * cos_phi),
                      around.frame * Vec3d(0, cos_phi, -sin_phi));
  line.distance += line.theta_gradient * (around.theta.mean - at.theta) +
                   line.phi_gradient * (around.phi.mean - at.phi);
  if (!settings_.printed) return clipped_gaussians(around.theta, around.phi, line);
  const double gain =
      gains_->gain(around.theta.width, around.phi.width, line.theta_gradient, line.phi_gradient);
  return unoccluded_gaussians_printed(around.theta, around.phi) /
         (1 + std::exp(-gain * line.distance));
}

Rgbd InteractiveMicrocylinder::directional_light(const Mat3d& frame, const Vec3d& out,
                                                 std::span<const Light> lights,
                                                 const PointVisibility& visibility) const {
  Rgbd radiance = Rgbd::Zero();
  for (const Light& light : lights) {
    if (!light.is_directional()) continue;
    const Vec3d wi = frame.transpose() * light.axis.cast<double>();
    const bool visible = visibility.maps == nullptr ||
                         visibility.maps->evaluate(visibility.coefficients, wi).distance > 0;
    if (visible) radiance += light.irradiance.cast<double>() * reflected(wi, out);
  }
  return radiance;
}

Rgbd InteractiveMicrocylinder::shade_in_double(const Mat3d& frame, const Vec3d& wo,
                                               std::span<const Light> lights,
                                               const PointVisibility& visibility) const {
  const Vec3d out = frame.transpose() * wo;
  if (out.z() <= 0) return Rgbd::Zero();
  const WeightingTable::Outgoing outgoing = table_.outgoing(out);
  Rgbd radiance = directional_light(frame, out, lights, visibility);

  for (std::size_t t = 0; t < tangents_.size(); ++t) {
    const Tangent& tangent = tangents_[t];
    const Vec3d out_thread = tangent.frame.transpose() * out;
    if (out_thread.z() <= 0) continue;
    const Angles o = angles_of(out_thread);
    const ThreadScattering& scattering = tangent.scattering;
    const ThreadParameters& parameters = scattering.parameters();
    for (const Light& light : lights) {
      if (light.is_directional()) continue;
      const double sharpness = static_cast<double>(light.sharpness);
      const Vec3d axis = frame.transpose() * light.axis.cast<double>();
      const Angles k = angles_of(tangent.frame.transpose() * axis);
      const CircularGaussian theta_k{k.theta, std::min(width_of_sharpness(sharpness), kWidest)};
      Rgbd sum = Rgbd::Zero();
      for (const Lobe& lobe : tangent.lobes) {
        if (lobe.amplitude == 0) continue;
        const CircularGaussianProduct product =
            circular_gaussian_product(theta_k, {-o.theta, lobe.width});
        if (product.amplitude < kNegligible) continue;
        const double theta_l = product.gaussian.mean;
        const Around around{
            tangent.frame,
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
          phi = {Nodes::Constant(o.phi + std::remainder(k.phi - o.phi, 2 * kPi)),
                 Nodes::Constant(1.0 / kSide)};
        } else {
          const Angles at = around.inside();
          const double across = around.phi.width * std::cos(at.theta);
          const double width = std::sqrt(0.5 * (std::pow(around.theta.width, 2) + across * across));
          weight = table_.value(t, outgoing, around.direction(at), sharpness_of_width(width));
          theta = average_over(around.theta);
          phi = average_over(around.phi);
        }
        if (weight <= 0) continue;

        // Smooth factors on the grid of nodes: cos^2 theta_i / cos^2 theta_d and what depends on
        // both angles.
        const Nodes cos_theta = cosine_of(theta.at);
        const Nodes cos_theta_d = cosine_of(Nodes(0.5 * (theta.at - o.theta)));
        Nodes along = theta.weight * cos_theta.square() / cos_theta_d.square().max(1e-12);
        if (!lobe.surface) along /= cos_theta + std::cos(o.theta);
        const Nodes cos_half_phi_d =
            cosine_of(Nodes(0.5 * (phi.at - o.phi)));  // both in the domain: within half a turn
        Lanes<kGrid> cosine;
        for (int a = 0; a < kSide; ++a)
          cosine.segment<kSide>(a * kSide) = cos_theta_d[a] * cos_half_phi_d;
        const Lanes<kGrid> reflectance =
            fresnel_reflectance<kGrid>(parameters.ior, cosine.max(0.0));
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

/// Terms (lights times lobes) of one tangent that shade() computes eight at a time, one array for
/// each quantity.
struct InteractiveMicrocylinder::Terms {
  static constexpr std::size_t kQuantities = 9;
  enum Quantity : std::size_t {
    kSinTheta,
    kCosTheta,
    kThetaWidth,
    kSinPhi,
    kCosPhi,
    kPhiWidth,
    kFactor,
    kWeight,
    kKind
  };

  std::size_t size = 0;
  std::array<std::vector<float>, kQuantities> values;
  std::vector<std::uint32_t> light;

  void reserve(std::size_t count) {
    for (std::vector<float>& value : values) value.resize(count + kFloat8Lanes);
    light.resize(count + kFloat8Lanes);
  }
  Float8 get(Quantity quantity, std::size_t first) const { return load8(&values[quantity][first]); }
  void put(Quantity quantity, Float8 value) { store8(value, &values[quantity][size]); }

  /// Removes the terms of less weight; the last eight are filled up with copies.
  void keep_from(float least) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < size; ++k) {
      if (values[kWeight][k] < least) continue;
      for (std::vector<float>& value : values) value[kept] = value[k];
      light[kept++] = light[k];
    }
    size = kept;
    if (kept == 0) return;
    for (std::size_t k = kept; k % kFloat8Lanes != 0; ++k) {
      for (std::vector<float>& value : values) value[k] = value[kept - 1];
    }
  }
};

/// What shade() knows of the Gaussian lights, [light] padded to eights: axes in the patch frame,
/// sharpness / 2, colour over mass.
struct InteractiveMicrocylinder::LightLanes {
  std::vector<float> x, y, z, half_sharpness, brightness;
  std::vector<Rgbd> colour;

  LightLanes(const Mat3d& frame, std::span<const Light> lights) {
    for (const Light& light : lights) {
      if (light.is_directional()) continue;
      const double sharpness = static_cast<double>(light.sharpness);
      add(frame.transpose() * light.axis.cast<double>(), sharpness,
          light.irradiance.cast<double>() / sg_mass(sharpness));
    }
    while (colour.size() % kFloat8Lanes != 0) add(Vec3d(0, 0, -1), 1e4, Rgbd::Zero());
  }

  void add(const Vec3d& axis, double sharpness, const Rgbd& radiance) {
    x.push_back(static_cast<float>(axis.x()));
    y.push_back(static_cast<float>(axis.y()));
    z.push_back(static_cast<float>(axis.z()));
    half_sharpness.push_back(
        static_cast<float>(std::max(0.5 * sharpness, 1 / (kWidest * kWidest))));
    brightness.push_back(static_cast<float>(radiance.maxCoeff()));
    colour.push_back(radiance);
  }
};

namespace {

// The part of all estimates that shade() leaves out at most.
constexpr float kEstimatesLeftOut = 1e-3F;

Float8 reflectance8(float ior, Float8 cosine) {
  const Float8 refracted = sqrt8(ior * ior - 1 + cosine * cosine);
  const Float8 s = (cosine - refracted) / (cosine + refracted);
  const Float8 p = (ior * ior * cosine - refracted) / (ior * ior * cosine + refracted);
  return 0.5F * (s * s + p * p);
}

// average_over() for eight at a time.
struct Average8 {
  std::array<Float8, kSide> at;
  std::array<Float8, kSide> weight;
};
Average8 average8(Float8 mean, Float8 width) {
  static const QuadratureRule& rule = gauss_legendre(kSide);
  const Float8 half_sine = min8(0.9F * width, splat8(0.999F));
  const Float8 reach =
      width < 1.1F ? 2 * atan2_8(half_sine, sqrt8(1 - half_sine * half_sine)) : splat8(kPif);
  constexpr float kHalf = 0.5F * kPif;
  const Float8 begin = max8(min8(mean - reach, splat8(kHalf)), splat8(-kHalf));
  const Float8 end = max8(min8(mean + reach, splat8(kHalf)), splat8(-kHalf));
  Average8 result;
  std::array<Float8, kSide> exponent;
  Float8 most = splat8(-1e30F);
  for (std::size_t k = 0; k < kSide; ++k) {
    result.at[k] = 0.5F * (begin + end) + 0.5F * (end - begin) * static_cast<float>(rule.nodes[k]);
    const Float8 u = 2 * sine8(0.5F * (result.at[k] - mean)) / width;
    exponent[k] = -u * u;
    most = max8(most, exponent[k]);
  }
  Float8 sum = {};
  for (std::size_t k = 0; k < kSide; ++k) {
    result.weight[k] = static_cast<float>(rule.weights[k]) * exp8(exponent[k] - most);
    sum += result.weight[k];
  }
  for (Float8& weight : result.weight) weight /= sum;
  return result;
}

// One tangent and the viewer.
struct View8 {
  Mat3 to_patch;  // patch = to_patch * thread
  float ior;
  float theta_o;
  float phi_o;
  float cos_o;
  bool half_angle;  // Fresnel's terms at the half angle, otherwise at each direction's own
  float leaving;    // then: the share that passes the surface towards the viewer

  View8(const Mat3d& frame, double index, ThreadConventions::Fresnel fresnel, const Vec3d& out)
      : to_patch(frame.cast<float>()),
        ior(static_cast<float>(index)),
        half_angle(fresnel == ThreadConventions::Fresnel::kHalf) {
    const Vec3d o = frame.transpose() * out;
    theta_o = static_cast<float>(std::asin(std::clamp(o.x(), -1.0, 1.0)));
    phi_o = static_cast<float>(std::atan2(o.y(), o.z()));
    cos_o = std::cos(theta_o);
    leaving =
        half_angle ? 0 : 1 - static_cast<float>(fresnel_reflectance<1>(index, Lanes<1>(o.z()))[0]);
  }

  Vec8 patch(Float8 x, Float8 y, Float8 z) const {
    return {to_patch(0, 0) * x + to_patch(0, 1) * y + to_patch(0, 2) * z,
            to_patch(1, 0) * x + to_patch(1, 1) * y + to_patch(1, 2) * z,
            to_patch(2, 0) * x + to_patch(2, 1) * y + to_patch(2, 2) * z};
  }

  // Smooth factors averaged over the nodes of both Gaussians; surface: by lane, or volume.
  Float8 smooth(const CircularGaussian8& theta, const CircularGaussian8& phi, Int8 surface) const {
    const Average8 theta_nodes = average8(theta.mean, theta.width);
    const Average8 phi_nodes = average8(phi.mean, phi.width);
    std::array<Float8, kSide> cos_half_phi_d;
    std::array<Float8, kSide> cosine_phi = {};
    for (std::size_t k = 0; k < kSide; ++k) {
      cos_half_phi_d[k] = cosine8(0.5F * (phi_nodes.at[k] - phi_o));
      if (!half_angle) cosine_phi[k] = cosine8(phi_nodes.at[k]);
    }
    Float8 result = {};
    for (std::size_t a = 0; a < kSide; ++a) {
      const Float8 cosine = cosine8(theta_nodes.at[a]);
      const Float8 cos_theta_d = cosine8(0.5F * (theta_nodes.at[a] - theta_o));
      Float8 along =
          theta_nodes.weight[a] * cosine * cosine / max8(cos_theta_d * cos_theta_d, splat8(1e-12F));
      along = surface ? along : along / (cosine + cos_o);
      Float8 sum = {};
      for (std::size_t k = 0; k < kSide; ++k) {
        const Float8 reflected = reflectance8(ior, max8(cos_theta_d * cos_half_phi_d[k], Float8{}));
        const Float8 entering =
            half_angle ? (1 - reflected) * (1 - reflected)
                       : leaving * (1 - reflectance8(ior, max8(cosine * cosine_phi[k], Float8{})));
        sum += phi_nodes.weight[k] * (surface ? reflected * cos_half_phi_d[k] : entering);
      }
      result += along * sum;
    }
    return result;
  }
};

SignedDistance8 distance_at(const PointVisibility& visibility, const Vec8& direction) {
  if (visibility.maps != nullptr)
    return visibility.maps->evaluate(visibility.coefficients, direction);
  // Nothing but the surface itself hides.
  const Float8 across = sqrt8(direction.x * direction.x + direction.y * direction.y);
  const Float8 scale = across > 1e-6F ? 1 / across : Float8{};
  return {atan2_8(direction.z, across),
          {-direction.z * direction.x * scale, -direction.z * direction.y * scale,
           across * across * scale}};
}

}  // namespace

void InteractiveMicrocylinder::find_terms(std::size_t t, const Vec3d& out, const LightLanes& lights,
                                          Terms& own, float& total) const {
  own.size = 0;
  const Tangent& tangent = tangents_[t];
  const Vec3d o = tangent.frame.transpose() * out;
  if (o.z() <= 0) return;
  const std::size_t padded = lights.colour.size();
  own.reserve(3 * padded);
  const auto sin_o = static_cast<float>(o.x());
  const auto cos_o = static_cast<float>(std::sqrt(std::max(0.0, 1 - o.x() * o.x())));
  const Mat3 to_thread = tangent.frame.transpose().cast<float>();
  const auto albedo = static_cast<float>(tangent.scattering.parameters().albedo.maxCoeff());
  const auto share = static_cast<float>(
      fabric_.threads[static_cast<std::size_t>(tangent.thread)].share * samples_[t].share);
  for (std::size_t first = 0; first < padded; first += kFloat8Lanes) {
    const Vec8 axis = {load8(&lights.x[first]), load8(&lights.y[first]), load8(&lights.z[first])};
    const Float8 w_k = load8(&lights.half_sharpness[first]);
    const auto component = [&](int row) {
      return to_thread(row, 0) * axis.x + to_thread(row, 1) * axis.y + to_thread(row, 2) * axis.z;
    };
    const Float8 sin_k = max8(min8(component(0), splat8(1)), splat8(-1));
    const Float8 across = component(1);
    const Float8 normal = component(2);
    const Float8 cos_k = max8(sqrt8(across * across + normal * normal), splat8(1e-9F));
    // No more of the light than this reaches what lies above the surface, and above the thread's
    // own horizon.
    const Float8 above = sqrt8(max8(1 - axis.z * axis.z, Float8{}));
    const Float8 beside = sqrt8(sin_k * sin_k + across * across);
    const Float8 hidden =
        2 * w_k * (min8(axis.z < 0 ? above - 1 : Float8{}, normal < 0 ? beside - 1 : Float8{}));
    const Float8 light_estimate = load8(&lights.brightness[first]) * share * exp8(hidden);
    for (const Lobe& lobe : tangent.lobes) {
      if (lobe.amplitude == 0) continue;
      const auto w_l = static_cast<float>(1 / (lobe.width * lobe.width));
      const Float8 real = w_k * cos_k + w_l * cos_o;
      const Float8 imaginary = w_k * sin_k - w_l * sin_o;
      const Float8 length = sqrt8(real * real + imaginary * imaginary);
      const Float8 apart = (cos_k - cos_o) * (cos_k - cos_o) + (sin_k + sin_o) * (sin_k + sin_o);
      const Float8 amplitude =
          static_cast<float>(lobe.amplitude) * exp8(-2 * w_k * w_l * apart / (length + w_k + w_l));
      const Float8 cos_l = max8(real / length, splat8(1e-9F));
      const Float8 sin_l = imaginary / length;
      constexpr auto kWidest8 = static_cast<float>(kWidest);
      const Float8 theta_width = min8(1 / sqrt8(length), splat8(kWidest8));
      const Float8 phi_width = min8(1 / sqrt8(w_k * cos_l * cos_k), splat8(kWidest8));
      constexpr float kRootPi = 1.77245385F;
      const Float8 mass =
          min8(kRootPi * theta_width, splat8(kPif)) * min8(kRootPi * phi_width, splat8(kPif));
      // cos^2 theta_i / cos^2 theta_d at the mean; cos^2 of a half is (1 + cos) / 2.
      const Float8 cos_squared_d = max8(0.5F * (1 + cos_l * cos_o + sin_l * sin_o), splat8(1e-3F));
      Float8 estimate = light_estimate * amplitude * mass * cos_l * cos_l / cos_squared_d;
      if (!lobe.surface) estimate *= albedo / (cos_l + cos_o);
      own.put(Terms::kSinTheta, sin_l);
      own.put(Terms::kCosTheta, cos_l);
      own.put(Terms::kThetaWidth, theta_width);
      own.put(Terms::kSinPhi, across / cos_k);
      own.put(Terms::kCosPhi, normal / cos_k);
      own.put(Terms::kPhiWidth, phi_width);
      own.put(Terms::kFactor, amplitude);
      own.put(Terms::kWeight, estimate);
      own.put(Terms::kKind, splat8(lobe.surface ? 1.0F : 0.0F));
      for (std::size_t k = 0; k < kFloat8Lanes; ++k) {
        own.light[own.size + k] = static_cast<std::uint32_t>(first + k);
        total += estimate[k];
      }
      own.size += kFloat8Lanes;
    }
  }
}

void InteractiveMicrocylinder::add_terms(std::size_t t, const Vec3d& out,
                                         const WeightingTable::Outgoing& outgoing,
                                         const LightLanes& lights,
                                         const PointVisibility& visibility, const Terms& own,
                                         Rgbd& radiance) const {
  const Tangent& tangent = tangents_[t];
  const ThreadParameters& parameters = tangent.scattering.parameters();
  const View8 view(tangent.frame, parameters.ior, fabric_.conventions.fresnel, out);
  for (std::size_t first = 0; first < own.size; first += kFloat8Lanes) {
    const Float8 sin_l = own.get(Terms::kSinTheta, first);
    const Float8 cos_l = own.get(Terms::kCosTheta, first);
    const CircularGaussian8 theta = {atan2_8(sin_l, cos_l), own.get(Terms::kThetaWidth, first)};
    const Float8 sin_k = own.get(Terms::kSinPhi, first);
    const Float8 cos_k = own.get(Terms::kCosPhi, first);
    const CircularGaussian8 phi = {atan2_8(sin_k, cos_k), own.get(Terms::kPhiWidth, first)};

    // The mean, moved into the domain, and the line through the nearest border.
    const Float8 cos_theta = max8(cos_l, splat8(static_cast<float>(kEdge)));
    const Float8 sin_theta = sign8(sin_l) * sqrt8(1 - cos_theta * cos_theta);
    const Float8 cos_phi = max8(cos_k, Float8{});
    const Float8 sin_phi = cos_k > 0 ? sin_k : sign8(sin_k);
    const Vec8 direction = view.patch(sin_theta, cos_theta * sin_phi, cos_theta * cos_phi);
    VisibilityLine8 line =
        visibility_line(distance_at(visibility, direction), cos_theta,
                        view.patch(cos_theta, -sin_theta * sin_phi, -sin_theta * cos_phi),
                        view.patch(Float8{}, cos_phi, -sin_phi));
    line.distance += line.theta_gradient * (theta.mean - atan2_8(sin_theta, cos_theta)) +
                     line.phi_gradient * (phi.mean - atan2_8(sin_phi, cos_phi));
    const Float8 integral = clipped_gaussians(theta, phi, line);
    if (!any8(integral > 0)) continue;

    const Float8 across_width = phi.width * cos_theta;
    const Float8 sharpness = 4 / (theta.width * theta.width + across_width * across_width);
    const Float8 weight = table_.value(t, outgoing, direction, sharpness);
    const Int8 surface = own.get(Terms::kKind, first) > 0.5F;
    const Float8 value =
        weight * view.smooth(theta, phi, surface) * own.get(Terms::kFactor, first) * integral;
    const std::size_t lanes = std::min<std::size_t>(kFloat8Lanes, own.size - first);
    for (std::size_t k = 0; k < lanes; ++k) {
      const Rgbd colour = static_cast<double>(value[k]) * lights.colour[own.light[first + k]];
      radiance += surface[k] != 0 ? colour : Rgbd(colour * parameters.albedo);
    }
  }
}

Rgbd InteractiveMicrocylinder::shade(const Mat3d& frame, const Vec3d& wo,
                                     std::span<const Light> lights,
                                     const PointVisibility& visibility) const {
  if (settings_.printed) return shade_in_double(frame, wo, lights, visibility);
  const Vec3d out = frame.transpose() * wo;
  if (out.z() <= 0) return Rgbd::Zero();
  Rgbd radiance = directional_light(frame, out, lights, visibility);
  const LightLanes gaussians(frame, lights);
  if (gaussians.colour.empty()) return radiance;

  // First all products of lights and lobes, with an estimate of what each contributes.
  thread_local std::vector<Terms> terms;
  terms.resize(tangents_.size());
  float total = 0;
  std::size_t count = 0;
  for (std::size_t t = 0; t < tangents_.size(); ++t) {
    find_terms(t, out, gaussians, terms[t], total);
    count += terms[t].size;
  }
  if (count == 0 || !(total > 0)) return radiance;

  const float least = kEstimatesLeftOut * total / static_cast<float>(count);
  const WeightingTable::Outgoing outgoing = table_.outgoing(out);
  for (std::size_t t = 0; t < tangents_.size(); ++t) {
    terms[t].keep_from(least);
    if (terms[t].size > 0) add_terms(t, out, outgoing, gaussians, visibility, terms[t], radiance);
  }
  return radiance;
}

Rgbd ray_traced_radiance(const std::function<Rgbd(const Vec3d& wi, const Vec3d& wo)>& reflected,
                         const Mat3d& frame, const Vec3d& wo, std::span<const Light> lights,
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
      const double depth = sg_depth_of_share((i + 0.5) / strata, sharpness);
      const double cosine = 1 - depth;
      const double sine = std::sqrt(std::max(0.0, depth * (2 - depth)));
      for (int j = 0; j < strata; ++j) {
        const double azimuth = 2 * kPi * (j + 0.5 * (i % 2)) / strata;
        sum +=
            from(cosine * axis + sine * (std::cos(azimuth) * across + std::sin(azimuth) * other));
      }
    }
    radiance += irradiance * sum / (static_cast<double>(strata) * strata);
  }
  return radiance;
}

}  // namespace heddle
