#include "fibers/math/circular_gaussian.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

// Beyond that many widths a Gaussian holds 2e-8 of itself.
constexpr double kReach = 4;

// Up to this width seven terms of the series in closed form are within 2e-6; above it 16 harmonics
// are.
constexpr double kWidestSeries = 0.5;
constexpr int kHarmonics = 16;

// Nodes along the line: with Gaussians no narrower than an eighth of the panel, error 2e-6.
constexpr int kNodes = 20;
using Nodes = Eigen::Array<double, kNodes, 1>;

struct Interval {
  double begin;
  double end;
  double length() const { return end - begin; }
};

Interval intersection(const Interval& a, const Interval& b) {
  return {std::max(a.begin, b.begin), std::min(a.end, b.end)};
}

const QuadratureRule& unit_rule() {
  static const QuadratureRule& rule = gauss_legendre(kNodes);
  return rule;
}

// What follows is written once for one number and for all nodes at a time (vector code).
double exponential(double x) {
  return std::exp(x);
}
Nodes exponential(const Nodes& x) {
  return x.exp();
}
double magnitude(double x) {
  return std::abs(x);
}
Nodes magnitude(const Nodes& x) {
  return x.abs();
}
double sign_of(double x) {
  return x < 0 ? -1 : 1;
}
Nodes sign_of(const Nodes& x) {
  return x.sign();
}
double root(double x) {
  return std::sqrt(std::max(x, 0.0));
}
Nodes root(const Nodes& x) {
  return x.max(0.0).sqrt();
}

// gc where |x - mean| <= pi.
template <class T>
T gaussian_near(const T& x, double mean, double sharpness) {
  const T half_sine = sine_of_quarter(T(0.5 * (x - mean)));
  return exponential(T(half_sine * half_sine * (-2 * sharpness)));
}

// The integral of gc from its mean to x, |x - mean| <= pi.
class Primitive {
 public:
  explicit Primitive(const CircularGaussian& gaussian)
      : gaussian_(gaussian), narrow_(gaussian.width <= kWidestSeries) {
    if (!narrow_) set_harmonics();
  }

  template <class T>
  T operator()(const T& x) const {
    return narrow_ ? narrow(x) : wide(x);
  }

 private:
  // [n] of the integral: the mean, then factors of sin(n d)
  using Harmonics = std::array<double, kHarmonics + 1>;

  // With t = u / s each moment of t^(2n) exp(-t^2) follows by parts from the one before:
  //   m_n = ((2n - 1) m_(n-1) - t^(2n-1) exp(-t^2)) / 2
  // erf is Abramowitz and Stegun 7.1.26 (absolute error 1.5e-7), which shares its exponential with
  // the moments.
  template <class T>
  T narrow(const T& x) const {
    const double s = gaussian_.width;
    const T t = sine_of_quarter(T(0.5 * (x - gaussian_.mean))) * (2 / s);
    const T square = t * t;
    const T bell = exponential(T(-square));
    const T q = 1 / (1 + 0.3275911 * magnitude(t));
    T tail = q * 1.061405429 - 1.453152027;
    tail = tail * q + 1.421413741;
    tail = tail * q - 0.284496736;
    tail = tail * q + 0.254829592;
    T moment = sign_of(t) * (0.5 * std::sqrt(kPi)) * (1 - tail * q * bell);
    T power = t * bell;
    double scale = 1;
    double odd = 1;
    T sum = moment;
    for (const double binomial : {2, 6, 20, 70, 252, 924}) {
      moment = 0.5 * (odd * moment - power);
      power *= square;
      scale *= s * s / 16;
      sum += binomial * scale * moment;
      odd += 2;
    }
    return s * sum;
  }

  // gc = exp(-k) (I0(k) + 2 sum of In(k) cos n(x - m)), k = 2/s^2: ratios by their continued
  // fraction, I0 from gc(m) = 1.
  void set_harmonics() {
    const double k = sharpness_of_width(gaussian_.width);
    constexpr int kStart = kHarmonics + 12;
    std::array<double, kStart + 1> ratio;  // In / I(n-1)
    double next = 0;
    for (int n = kStart; n >= 1; --n) {
      next = k / (2 * n + k * next);
      ratio[static_cast<std::size_t>(n)] = next;
    }
    double total = 1;
    double product = 1;
    for (std::size_t n = 1; n <= kStart; ++n) {
      product *= ratio[n];
      total += 2 * product;
      if (n <= kHarmonics) harmonic_[n] = 2 * product / static_cast<double>(n);
    }
    harmonic_[0] = 1 / total;
    for (std::size_t n = 1; n <= kHarmonics; ++n) harmonic_[n] /= total;
  }

  template <class T>
  T wide(const T& x) const {
    const T d = x - gaussian_.mean;
    const T s = sine_of_quarter(T(0.5 * d));
    const T sine = 2 * s * root(T(1 - s * s));
    const T twice_cosine = 2 - 4 * s * s;
    T b1 = 0 * d;
    T b2 = 0 * d;
    for (std::size_t n = kHarmonics; n >= 1; --n) {  // Clenshaw
      const T b = harmonic_[n] + twice_cosine * b1 - b2;
      b2 = b1;
      b1 = b;
    }
    return harmonic_[0] * d + b1 * sine;
  }

  CircularGaussian gaussian_;
  bool narrow_;
  Harmonics harmonic_{};
};

// The integral over the circle for widths up to 0.25: the series of Primitive with the whole
// moments of exp(-t^2), sqrt(pi) (2n - 1)!! / 2^n.
double whole_narrow(double width) {
  const double step = width * width / 16;  // sum of binomial(2n, n) (2n - 1)!! / 2^n step^n
  return std::sqrt(kPi) * width * (1 + step * (1 + step * (4.5 + step * (37.5 + step * 459.375))));
}

// What is not negligible of gc within [begin, end].
Interval support(const CircularGaussian& gaussian, const Interval& interval) {
  const double half_sine = 0.5 * kReach * gaussian.width;
  if (half_sine >= 1) return interval;
  const double reach = 2 * std::asin(half_sine);
  return intersection(interval, {gaussian.mean - reach, gaussian.mean + reach});
}

// An image of gc whose mean is at most pi away from all of the interval.
struct Image {
  CircularGaussian gaussian;
  Interval interval;
};

// gc over [-pi/2, pi/2] cut where it repeats: one image for means inside, two for means outside.
int images_of(const CircularGaussian& gaussian, std::array<Image, 5>& images) {
  assert(std::abs(gaussian.mean) <= 2 * kPi + 1e-9);
  int count = 0;
  for (int turn = -2; turn <= 2; ++turn) {
    const double mean = gaussian.mean + turn * 2 * kPi;
    const Interval part = intersection({-kHalfPi, kHalfPi}, {mean - kPi, mean + kPi});
    if (part.length() > 0)
      images[static_cast<std::size_t>(count++)] = {{mean, gaussian.width}, part};
  }
  return count;
}

// The visible part over a box: `inner` has the larger share of the gradient. Visible is slope
// (outer) + inner >= limit, in coordinates as they are, or <= where `flipped`.
double clipped_box(const Image& inner_image, const Image& outer_image, double limit, double slope,
                   bool visible_above) {
  const Interval inner = support(inner_image.gaussian, inner_image.interval);
  const Interval outer = support(outer_image.gaussian, outer_image.interval);
  if (inner.length() <= 0 || outer.length() <= 0) return 0;
  const Primitive inner_primitive(inner_image.gaussian);
  const double at_begin = inner_primitive(inner.begin);
  const double at_end = inner_primitive(inner.end);
  const Primitive outer_primitive(outer_image.gaussian);
  // Outer coordinates where the line enters and leaves the inner support.
  Interval cut = outer;
  if (slope != 0) {
    const double a = (limit - inner.begin) / slope;
    const double b = (limit - inner.end) / slope;
    cut = {std::clamp(std::min(a, b), outer.begin, outer.end),
           std::clamp(std::max(a, b), outer.begin, outer.end)};
  }
  double sum = 0;
  for (const Interval& whole : {Interval{outer.begin, cut.begin}, Interval{cut.end, outer.end}}) {
    if (whole.length() <= 0) continue;
    const double edge = limit - slope * 0.5 * (whole.begin + whole.end);
    if ((edge <= inner.begin) != visible_above) continue;
    sum += (outer_primitive(whole.end) - outer_primitive(whole.begin)) * (at_end - at_begin);
  }
  if (cut.length() <= 0) return sum;
  if (slope == 0) {
    const double at_edge = inner_primitive(std::clamp(limit, inner.begin, inner.end));
    return (visible_above ? at_end - at_edge : at_edge - at_begin) *
           (outer_primitive(outer.end) - outer_primitive(outer.begin));
  }
  const QuadratureRule& rule = unit_rule();
  const double half = 0.5 * cut.length();
  const double middle = 0.5 * (cut.begin + cut.end);
  const double sharpness = sharpness_of_width(outer_image.gaussian.width);
  const Nodes x = middle + half * Eigen::Map<const Nodes>(rule.nodes.data());
  const Nodes weight = Eigen::Map<const Nodes>(rule.weights.data()) *
                       gaussian_near(x, outer_image.gaussian.mean, sharpness);
  const Nodes edge = inner_primitive(Nodes((limit - slope * x).max(inner.begin).min(inner.end)));
  return sum +
         half * (weight * (visible_above ? Nodes(at_end - edge) : Nodes(edge - at_begin))).sum();
}

// Panels over [-pi/2, pi/2] that resolve gc, its images included.
std::vector<double> breaks_of(const CircularGaussian& gaussian) {
  std::vector<double> breaks;
  for (int turn = -2; turn <= 2; ++turn) {
    append_geometric_breaks(gaussian.mean + turn * 2 * kPi, std::min(gaussian.width, 1.0), kPi,
                            breaks);
  }
  return breaks;
}

double mass_by_panels(const CircularGaussian& gaussian, double begin, double end) {
  if (begin >= end) return 0;
  return integrate(gauss_legendre_panels(16, begin, end, breaks_of(gaussian)),
                   [&](double x) { return circular_gaussian(gaussian, x); });
}

}  // namespace

double circular_gaussian(const CircularGaussian& gaussian, double x) {
  const double u = 2 * std::sin(0.5 * (x - gaussian.mean)) / gaussian.width;
  return std::exp(-u * u);
}

double azimuthal_width(double width, double theta, double theta_k) {
  const double product = std::max(std::cos(theta), 0.0) * std::max(std::cos(theta_k), 0.0);
  return product > 0 ? width / std::sqrt(product) : std::numeric_limits<double>::infinity();
}

double sharpness_of_width(double width) {
  return 2 / (width * width);
}

double width_of_sharpness(double sharpness) {
  return std::sqrt(2 / sharpness);
}

CircularGaussianProduct circular_gaussian_product(const CircularGaussian& a,
                                                  const CircularGaussian& b) {
  const double weight_a = 1 / (a.width * a.width);
  const double weight_b = 1 / (b.width * b.width);
  const double half_sine = std::sin(0.5 * (b.mean - a.mean));
  const double x = weight_a + weight_b * std::cos(b.mean - a.mean);
  const double y = weight_b * std::sin(b.mean - a.mean);
  const double length = std::hypot(x, y);
  const double total = length + weight_a + weight_b;
  // |z| - 1/s1^2 - 1/s2^2 without cancellation.
  const double deficit = total > 0 ? 4 * weight_a * weight_b * half_sine * half_sine / total : 0;
  return {{std::remainder(a.mean + std::atan2(y, x), 2 * kPi), 1 / std::sqrt(length)},
          std::exp(-2 * deficit)};
}

double circular_gaussian_mass(const CircularGaussian& gaussian, double begin, double end) {
  if (begin >= end) return 0;
  const Primitive primitive(gaussian);
  return primitive(end) - primitive(begin);
}

double clipped_gaussians(const CircularGaussian& theta, const CircularGaussian& phi,
                         const VisibilityLine& line) {
  // All of two narrow Gaussians within the domain and on one side: 4.2 widths in the angle are
  // kReach in u.
  if (theta.width <= 0.25 && phi.width <= 0.25) {
    const double reach_theta = 4.2 * theta.width;
    const double reach_phi = 4.2 * phi.width;
    const double reach =
        reach_theta * std::abs(line.theta_gradient) + reach_phi * std::abs(line.phi_gradient);
    const bool inside =
        std::abs(theta.mean) + reach_theta <= kHalfPi && std::abs(phi.mean) + reach_phi <= kHalfPi;
    if (inside && line.distance >= reach)
      return whole_narrow(theta.width) * whole_narrow(phi.width);
    if (inside && line.distance <= -reach) return 0;
  }
  const bool theta_is_inner = std::abs(line.theta_gradient) >= std::abs(line.phi_gradient);
  const double inner_gradient = theta_is_inner ? line.theta_gradient : line.phi_gradient;
  const double outer_gradient = theta_is_inner ? line.phi_gradient : line.theta_gradient;
  assert(inner_gradient != 0);
  const CircularGaussian& inner = theta_is_inner ? theta : phi;
  const CircularGaussian& outer = theta_is_inner ? phi : theta;
  const double slope = outer_gradient / inner_gradient;
  const double limit = inner.mean + slope * outer.mean - line.distance / inner_gradient;
  std::array<Image, 5> inner_images;
  std::array<Image, 5> outer_images;
  const int inner_count = images_of(inner, inner_images);
  const int outer_count = images_of(outer, outer_images);
  double sum = 0;
  for (int i = 0; i < inner_count; ++i) {
    for (int o = 0; o < outer_count; ++o) {
      sum +=
          clipped_box(inner_images[static_cast<std::size_t>(i)],
                      outer_images[static_cast<std::size_t>(o)], limit, slope, inner_gradient > 0);
    }
  }
  return sum;
}

namespace {

// The forms for eight at a time. Beyond this many widths a Gaussian holds 8e-5 of itself.
constexpr float kReach8 = 2.8F;
constexpr int kHarmonics8 = 12;
constexpr float kHalfPi8 = static_cast<float>(kHalfPi);

// One-dimensional rules on [-1, 1] in single precision.
template <int N>
struct Rule8 {
  std::array<float, N> node;
  std::array<float, N> weight;
  Rule8() {
    const QuadratureRule& rule = gauss_legendre(N);
    for (std::size_t k = 0; k < N; ++k) {
      node[k] = static_cast<float>(rule.nodes[k]);
      weight[k] = static_cast<float>(rule.weights[k]);
    }
  }
};

Float8 gaussian8(Float8 x, const CircularGaussian8& gaussian) {
  const Float8 u = 2 * sine8(0.5F * (x - gaussian.mean)) / gaussian.width;
  return exp8(-u * u);
}

// Primitive for eight at a time: the series (three terms) for narrow Gaussians, harmonics for the
// others.
class Primitive8 {
 public:
  explicit Primitive8(const CircularGaussian8& gaussian)
      : gaussian_(gaussian),
        narrow_(gaussian.width <= static_cast<float>(kWidestSeries)),
        any_narrow_(any8(narrow_)),
        any_wide_(any8(~narrow_)) {
    if (!any_wide_) return;
    const Float8 k = 2 / (gaussian.width * gaussian.width);
    std::array<Float8, kHarmonics8 + 1> ratio;
    Float8 next = {};
    for (int n = kHarmonics8 + 4; n >= 1; --n) {
      next = k / (2.0F * static_cast<float>(n) + k * next);
      if (n <= kHarmonics8) ratio[static_cast<std::size_t>(n)] = next;
    }
    Float8 total = splat8(1);
    Float8 product = splat8(1);
    for (std::size_t n = 1; n <= kHarmonics8; ++n) {
      product *= ratio[n];
      total += 2 * product;
      harmonic_[n] = 2 * product / static_cast<float>(n);
    }
    harmonic_[0] = 1 / total;
    for (std::size_t n = 1; n <= kHarmonics8; ++n) harmonic_[n] *= harmonic_[0];
  }

  Float8 operator()(Float8 x) const {
    if (!any_wide_) return narrow(x);
    if (!any_narrow_) return wide(x);
    return narrow_ ? narrow(x) : wide(x);
  }

 private:
  Float8 narrow(Float8 x) const {
    const Float8 s = gaussian_.width;
    const Float8 t = 2 * sine8(0.5F * (x - gaussian_.mean)) / s;
    const Float8 square = t * t;
    const Float8 bell = exp8(-square);
    const Float8 q = 1 / (1 + 0.3275911F * abs8(t));
    Float8 tail = q * 1.061405429F - 1.453152027F;
    tail = tail * q + 1.421413741F;
    tail = tail * q - 0.284496736F;
    tail = tail * q + 0.254829592F;
    const Float8 m0 = sign8(t) * 0.886226925F * (1 - tail * q * bell);
    const Float8 m1 = 0.5F * (m0 - t * bell);
    const Float8 m2 = 0.5F * (3 * m1 - t * square * bell);
    const Float8 step = s * s * (1.0F / 16);
    return s * (m0 + step * (2 * m1 + 6 * step * m2));
  }
  Float8 wide(Float8 x) const {
    const Float8 d = x - gaussian_.mean;
    const Float8 half = 0.5F * d;
    const Float8 s = sine8(half);
    const Float8 cosine = cosine8(half);
    const Float8 twice_cosine = 2 - 4 * s * s;
    Float8 b1 = {};
    Float8 b2 = {};
    for (std::size_t n = kHarmonics8; n >= 1; --n) {
      const Float8 b = harmonic_[n] + twice_cosine * b1 - b2;
      b2 = b1;
      b1 = b;
    }
    return harmonic_[0] * d + b1 * 2 * s * cosine;
  }

  CircularGaussian8 gaussian_;
  Int8 narrow_;
  bool any_narrow_;
  bool any_wide_;
  std::array<Float8, kHarmonics8 + 1> harmonic_;
};

struct Interval8 {
  Float8 begin;
  Float8 end;
};

// What is not negligible of gc within the domain; all of it for wide ones.
Interval8 support8(const CircularGaussian8& gaussian) {
  const Float8 half_sine = min8(0.5F * kReach8 * gaussian.width, splat8(0.75F));
  const Float8 narrow_reach = 2 * atan2_8(half_sine, sqrt8(1 - half_sine * half_sine));
  const Float8 reach =
      gaussian.width <= static_cast<float>(kWidestSeries) ? narrow_reach : splat8(10);
  return {max8(gaussian.mean - reach, splat8(-kHalfPi8)),
          min8(gaussian.mean + reach, splat8(kHalfPi8))};
}

}  // namespace

Float8 clipped_gaussians(const CircularGaussian8& theta, const CircularGaussian8& phi,
                         const VisibilityLine8& line) {
  static const Rule8<12> along_cut;
  static const Rule8<10> beside_cut;
  const Int8 theta_is_inner = abs8(line.theta_gradient) >= abs8(line.phi_gradient);
  const Float8 inner_gradient = theta_is_inner ? line.theta_gradient : line.phi_gradient;
  const Float8 outer_gradient = theta_is_inner ? line.phi_gradient : line.theta_gradient;
  const CircularGaussian8 inner = {theta_is_inner ? theta.mean : phi.mean,
                                   theta_is_inner ? theta.width : phi.width};
  const CircularGaussian8 outer = {theta_is_inner ? phi.mean : theta.mean,
                                   theta_is_inner ? phi.width : theta.width};
  const Float8 raw_slope = outer_gradient / inner_gradient;
  const Float8 slope = abs8(raw_slope) < 1e-6F ? splat8(1e-6F) : raw_slope;
  const Float8 limit = inner.mean + slope * outer.mean - line.distance / inner_gradient;
  const Int8 above = inner_gradient > 0;

  const Interval8 inner_support = support8(inner);
  const Interval8 outer_support = support8(outer);
  const Int8 empty =
      (inner_support.begin >= inner_support.end) | (outer_support.begin >= outer_support.end);
  const Primitive8 primitive(inner);
  const Float8 at_begin = primitive(inner_support.begin);
  const Float8 at_end = primitive(inner_support.end);

  // Where the line crosses the inner support, and the part on its visible side.
  const auto clamped = [&](Float8 x) {
    return max8(min8(x, outer_support.end), outer_support.begin);
  };
  const Float8 a = clamped((limit - inner_support.begin) / slope);
  const Float8 b = clamped((limit - inner_support.end) / slope);
  const Interval8 cut = {min8(a, b), max8(a, b)};
  const Int8 beyond = (slope > 0) == above;
  const Interval8 whole = {beyond ? cut.end : outer_support.begin,
                           beyond ? outer_support.end : cut.begin};

  Float8 sum = {};
  const Float8 half = 0.5F * (cut.end - cut.begin);
  if (any8(half > 0)) {
    const Float8 middle = 0.5F * (cut.begin + cut.end);
    for (std::size_t k = 0; k < along_cut.node.size(); ++k) {
      const Float8 x = middle + half * along_cut.node[k];
      const Float8 edge =
          primitive(max8(min8(limit - slope * x, inner_support.end), inner_support.begin));
      sum += along_cut.weight[k] * gaussian8(x, outer) * (above ? at_end - edge : edge - at_begin);
    }
    sum *= half;
  }
  const Float8 whole_half = 0.5F * (whole.end - whole.begin);
  if (any8(whole_half > 0)) {
    const Float8 middle = 0.5F * (whole.begin + whole.end);
    Float8 mass = {};
    for (std::size_t k = 0; k < beside_cut.node.size(); ++k) {
      mass += beside_cut.weight[k] * gaussian8(middle + whole_half * beside_cut.node[k], outer);
    }
    sum += whole_half * mass * (at_end - at_begin);
  }
  return empty ? Float8{} : max8(sum, Float8{});
}

double clipped_gaussians_quadrature(const CircularGaussian& theta, const CircularGaussian& phi,
                                    const VisibilityLine& line) {
  // The angle with the larger share of the gradient is integrated inside, so that its limit moves
  // at most as fast as the other angle.
  const bool theta_is_inner = std::abs(line.theta_gradient) >= std::abs(line.phi_gradient);
  const CircularGaussian& inner = theta_is_inner ? theta : phi;
  const CircularGaussian& outer = theta_is_inner ? phi : theta;
  const double inner_gradient = theta_is_inner ? line.theta_gradient : line.phi_gradient;
  const double outer_gradient = theta_is_inner ? line.phi_gradient : line.theta_gradient;
  std::vector<double> breaks = breaks_of(outer);
  if (outer_gradient != 0) {
    // outer coordinate at which the line passes the inner one
    const auto crossing = [&](double x) {
      return outer.mean - (line.distance + inner_gradient * (x - inner.mean)) / outer_gradient;
    };
    breaks.push_back(crossing(-kHalfPi));
    breaks.push_back(crossing(kHalfPi));
    const double scale = std::min(inner.width * std::abs(inner_gradient / outer_gradient), 1.0);
    for (int turn = -1; turn <= 1; ++turn) {
      append_geometric_breaks(crossing(inner.mean + turn * 2 * kPi), scale, 2 * kPi, breaks);
    }
  }
  return integrate(gauss_legendre_panels(16, -kHalfPi, kHalfPi, breaks), [&](double x) {
    const double edge = std::clamp(
        inner.mean - (line.distance + outer_gradient * (x - outer.mean)) / inner_gradient, -kHalfPi,
        kHalfPi);
    return circular_gaussian(outer, x) * (inner_gradient > 0
                                              ? mass_by_panels(inner, edge, kHalfPi)
                                              : mass_by_panels(inner, -kHalfPi, edge));
  });
}

double unoccluded_gaussians_printed(const CircularGaussian& theta, const CircularGaussian& phi) {
  const auto share = [](const CircularGaussian& gaussian) {
    return erf_difference((-kHalfPi - gaussian.mean) / gaussian.width,
                          (kHalfPi - gaussian.mean) / gaussian.width);
  };
  return 0.25 * kPi * theta.width * phi.width * share(theta) * share(phi);
}

double visible_share(double theta_width, double phi_width, const VisibilityLine& line) {
  const CircularGaussian theta{0, theta_width};
  const CircularGaussian phi{0, phi_width};
  return clipped_gaussians(theta, phi, line) / (circular_gaussian_mass(theta, -kHalfPi, kHalfPi) *
                                                circular_gaussian_mass(phi, -kHalfPi, kHalfPi));
}

double sigmoid_gain(double theta_width, double phi_width, double theta_gradient,
                    double phi_gradient) {
  // The share is odd about distance 0, and 1 from where the line leaves the domain or the Gaussians
  // behind.
  const double domain = kHalfPi * (std::abs(theta_gradient) + std::abs(phi_gradient));
  const double spread = std::hypot(theta_width * theta_gradient, phi_width * phi_gradient);
  const double reach = std::min(domain, 4 * spread);
  constexpr int kDistances = 64;
  const QuadratureRule rule = gauss_legendre(kDistances, 0, reach);
  std::array<double, kDistances> share;
  for (std::size_t k = 0; k < kDistances; ++k) {
    share[k] = visible_share(theta_width, phi_width, {rule.nodes[k], theta_gradient, phi_gradient});
  }
  // Gauss-Newton in the logarithm of the gain: one well-behaved unknown.
  double gain = 2.4 / std::min(spread, domain);
  for (int step = 0; step < 50; ++step) {
    double slope_residual = 0;
    double slope_slope = 0;
    for (std::size_t k = 0; k < kDistances; ++k) {
      const double sigmoid = 1 / (1 + std::exp(-gain * rule.nodes[k]));
      const double slope = sigmoid * (1 - sigmoid) * rule.nodes[k] * gain;
      slope_residual += rule.weights[k] * slope * (share[k] - sigmoid);
      slope_slope += rule.weights[k] * slope * slope;
    }
    const double change = std::clamp(slope_residual / slope_slope, -1.0, 1.0);
    gain *= std::exp(change);
    if (std::abs(change) < 1e-12) break;
  }
  return gain;
}

double clipped_gaussians_printed(const CircularGaussian& theta, const CircularGaussian& phi,
                                 const VisibilityLine& line) {
  const double gain = sigmoid_gain(theta.width, phi.width, line.theta_gradient, line.phi_gradient);
  return unoccluded_gaussians_printed(theta, phi) / (1 + std::exp(-gain * line.distance));
}

namespace {

constexpr double kNarrowestGain = 0.005;
constexpr double kWidestGain = 3;

// The line's extent across the two Gaussians, limited as the domain limits it.
double line_spread(double theta_width, double phi_width, double theta_gradient,
                   double phi_gradient) {
  return std::hypot(std::min(theta_width, kWidestGain) * theta_gradient,
                    std::min(phi_width, kWidestGain) * phi_gradient);
}

}  // namespace

SigmoidGains::SigmoidGains() {
  for (int i = 0; i < kWidths; ++i) {
    for (int j = 0; j < kWidths; ++j) {
      for (int g = 0; g < kGradients; ++g) {
        const double theta_width =
            kNarrowestGain * std::pow(kWidestGain / kNarrowestGain, i / (kWidths - 1.0));
        const double phi_width =
            kNarrowestGain * std::pow(kWidestGain / kNarrowestGain, j / (kWidths - 1.0));
        const double gradient = kHalfPi * g / (kGradients - 1.0);
        gains_.push_back(
            sigmoid_gain(theta_width, phi_width, std::cos(gradient), std::sin(gradient)) *
            line_spread(theta_width, phi_width, std::cos(gradient), std::sin(gradient)));
      }
    }
  }
}

double SigmoidGains::gain(double theta_width, double phi_width, double theta_gradient,
                          double phi_gradient) const {
  struct Between {
    int low;
    double share;
  };
  const auto between = [](double position, int count) {
    const double at = std::clamp(position, 0.0, count - 1.0);
    const int low = std::min(static_cast<int>(at), count - 2);
    return Between{low, at - low};
  };
  const auto of_width = [&](double width) {
    return between(
        std::log(width / kNarrowestGain) / std::log(kWidestGain / kNarrowestGain) * (kWidths - 1),
        kWidths);
  };
  const Between i = of_width(theta_width);
  const Between j = of_width(phi_width);
  const Between g = between(
      std::atan2(std::abs(phi_gradient), std::abs(theta_gradient)) / kHalfPi * (kGradients - 1),
      kGradients);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1;
    const int b = (corner >> 1) & 1;
    const int c = corner >> 2;
    const auto index =
        static_cast<std::size_t>(((i.low + a) * kWidths + j.low + b) * kGradients + g.low + c);
    sum += (a != 0 ? i.share : 1 - i.share) * (b != 0 ? j.share : 1 - j.share) *
           (c != 0 ? g.share : 1 - g.share) * gains_[index];
  }
  return sum / line_spread(std::max(theta_width, kNarrowestGain),
                           std::max(phi_width, kNarrowestGain), theta_gradient, phi_gradient);
}

}  // namespace heddle
