#include "render/flip.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace heddle {
namespace {

// Exponents and breakpoint of the paper: q_c, p_c, p_t (section 4.1.4), q_f and the width of an
// edge detector in degrees (section 4.2).
constexpr double kColorExponent = 0.7;
constexpr double kColorBreak = 0.4;
constexpr double kColorBreakValue = 0.95;
constexpr double kFeatureExponent = 0.5;
constexpr double kFeatureWidth = 0.082;

const Mat3d kXyzFromLinear = (Mat3d() << 0.4123908, 0.3575843, 0.1804808,  //
                              0.2126390, 0.7151687, 0.0721923,             //
                              0.0193308, 0.1191948, 0.9505322)
                                 .finished();
const Mat3d kLinearFromXyz = kXyzFromLinear.inverse();
const Rgbd kWhite = (kXyzFromLinear * Vec3d::Ones()).array();

using Plane = std::vector<Rgbd>;  // [pixel]

/// Linear opponent space: luminance, red-green, blue-yellow; linear in light, unlike L*a*b*.
Rgbd opponent(const Rgb& linear) {
  const Rgbd xyz =
      (kXyzFromLinear * linear.max(0.0F).min(1.0F).cast<double>().matrix()).array() / kWhite;
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

/// L*a*b* with a* and b* scaled by 0.01 L*: differences of colour count less in the dark.
Rgbd hunt_lab(const Rgbd& linear) {
  const Rgbd xyz = (kXyzFromLinear * linear.matrix()).array() / kWhite;
  const auto root = [](double t) {
    constexpr double kDelta = 6.0 / 29.0;
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29.0;
  };
  const double luminance = 116 * root(xyz[1]) - 16;
  const double scale = 0.01 * luminance;
  return {luminance, scale * 500 * (root(xyz[0]) - root(xyz[1])),
          scale * 200 * (root(xyz[1]) - root(xyz[2]))};
}

Rgbd hunt_lab_of_opponent(const Rgbd& value) {
  const double y = (value[0] + 16) / 116;
  const Rgbd xyz = Rgbd(value[1] / 500 + y, y, y - value[2] / 200) * kWhite;
  return hunt_lab((kLinearFromXyz * xyz.matrix()).array().max(0.0).min(1.0));
}

double hyab(const Rgbd& a, const Rgbd& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

/// A square kernel of (2 radius + 1)^2 taps per channel.
struct Kernel {
  int radius;
  std::vector<Rgbd> taps;
};

template <class Tap>
Kernel make_kernel(int radius, Tap&& tap) {
  Kernel kernel{radius, {}};
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) kernel.taps.push_back(tap(x, y));
  }
  return kernel;
}

/// Contrast sensitivity as a filter in space; channels of the opponent space, each of sum 1.
Kernel contrast_kernel(double pixels_per_degree) {
  struct Gaussians {
    double a1, b1, a2, b2;
  };
  constexpr std::array<Gaussians, 3> kSensitivity = {
      {{1, 0.0047, 0, 1e-5}, {1, 0.0053, 0, 1e-5}, {34.1, 0.04, 13.5, 0.025}}};
  const double widest = kSensitivity[2].b1;
  const int radius =
      static_cast<int>(std::ceil(3 * std::sqrt(widest / (2 * kPi * kPi)) * pixels_per_degree));
  Kernel kernel = make_kernel(radius, [&](int x, int y) {
    const double square = (x * x + y * y) / (pixels_per_degree * pixels_per_degree);
    Rgbd tap;
    for (int c = 0; c < 3; ++c) {
      const Gaussians& g = kSensitivity[static_cast<std::size_t>(c)];
      tap[c] = g.a1 * std::sqrt(kPi / g.b1) * std::exp(-kPi * kPi * square / g.b1) +
               g.a2 * std::sqrt(kPi / g.b2) * std::exp(-kPi * kPi * square / g.b2);
    }
    return tap;
  });
  Rgbd sum = Rgbd::Zero();
  for (const Rgbd& tap : kernel.taps) sum += tap;
  for (Rgbd& tap : kernel.taps) tap /= sum;
  return kernel;
}

/// Channel 0: first derivative of a Gaussian along x (edges), 1: the second (points); positive taps
/// sum to 1, negative to -1.
Kernel feature_kernel(double pixels_per_degree) {
  const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
  Kernel kernel = make_kernel(static_cast<int>(std::ceil(3 * sigma)), [&](int x, int y) {
    const double gaussian = std::exp(-(x * x + y * y) / (2 * sigma * sigma));
    return Rgbd(-x * gaussian, (x * x / (sigma * sigma) - 1) * gaussian, 0);
  });
  Rgbd positive = Rgbd::Zero();
  Rgbd negative = Rgbd::Zero();
  for (const Rgbd& tap : kernel.taps) {
    positive += tap.max(0.0);
    negative -= tap.min(0.0);
  }
  for (Rgbd& tap : kernel.taps) {
    for (int c = 0; c < 2; ++c) tap[c] /= tap[c] > 0 ? positive[c] : negative[c];
  }
  return kernel;
}

/// visit(dx, dy, tap, value) over the neighbourhood of a pixel.
template <class Visit>
void convolve(const Kernel& kernel, const Plane& plane, int width, int height, int x, int y,
              Visit&& visit) {
  std::size_t k = 0;
  for (int dy = -kernel.radius; dy <= kernel.radius; ++dy) {
    const int row = std::clamp(y + dy, 0, height - 1);
    for (int dx = -kernel.radius; dx <= kernel.radius; ++dx, ++k) {
      const int column = std::clamp(x + dx, 0, width - 1);
      visit(dx, dy, kernel.taps[k], plane[static_cast<std::size_t>(row) * width + column]);
    }
  }
}

struct Features {
  double edge;
  double point;
};

Features features_at(const Kernel& kernel, const Plane& opponent_plane, int width, int height,
                     int x, int y) {
  const int side = 2 * kernel.radius + 1;
  Rgbd along_x = Rgbd::Zero();
  Rgbd along_y = Rgbd::Zero();
  convolve(
      kernel, opponent_plane, width, height, x, y,
      [&](int dx, int dy, const Rgbd& tap, const Rgbd& value) {
        const double luminance = (value[0] + 16) / 116;
        along_x += luminance * tap;
        along_y +=
            luminance *
            kernel.taps[static_cast<std::size_t>((dx + kernel.radius) * side + dy + kernel.radius)];
      });
  return {std::hypot(along_x[0], along_y[0]), std::hypot(along_x[1], along_y[1])};
}

/// Stretches small differences over [0, 0.95], squeezes the rest below 1.
double remapped(double difference, double largest) {
  const double at_break = kColorBreak * largest;
  if (difference < at_break) return kColorBreakValue / at_break * difference;
  return std::min(1.0, kColorBreakValue +
                           (difference - at_break) / (largest - at_break) * (1 - kColorBreakValue));
}

}  // namespace

double default_pixels_per_degree() {
  constexpr double kDistance = 0.7;  // m
  constexpr double kScreenWidth = 0.7;
  constexpr double kScreenPixels = 3840;
  return kDistance * kScreenPixels / kScreenWidth * kPi / 180;
}

std::vector<float> flip_map(std::span<const Rgb> a, std::span<const Rgb> b, int width, int height,
                            double pixels_per_degree) {
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  assert(a.size() == count && b.size() == count && pixels_per_degree > 0);
  Plane left(count);
  Plane right(count);
  std::transform(a.begin(), a.end(), left.begin(), opponent);
  std::transform(b.begin(), b.end(), right.begin(), opponent);

  const Kernel contrast = contrast_kernel(pixels_per_degree);
  const Kernel feature = feature_kernel(pixels_per_degree);
  const double largest =
      std::pow(hyab(hunt_lab(Rgbd(0, 1, 0)), hunt_lab(Rgbd(0, 0, 1))), kColorExponent);
  std::vector<float> map(count);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto filtered = [&](const Plane& plane) {
        Rgbd sum = Rgbd::Zero();
        convolve(contrast, plane, width, height, x, y,
                 [&](int, int, const Rgbd& tap, const Rgbd& value) { sum += tap * value; });
        return hunt_lab_of_opponent(sum);
      };
      const double color =
          remapped(std::pow(hyab(filtered(left), filtered(right)), kColorExponent), largest);
      const Features of_left = features_at(feature, left, width, height, x, y);
      const Features of_right = features_at(feature, right, width, height, x, y);
      const double difference = std::max(std::abs(of_left.edge - of_right.edge),
                                         std::abs(of_left.point - of_right.point));
      const double features =
          std::min(1.0, std::pow(difference / std::sqrt(2.0), kFeatureExponent));
      map[static_cast<std::size_t>(y) * width + x] =
          static_cast<float>(std::pow(color, 1 - features));
    }
  }
  return map;
}

double flip_error(std::span<const Rgb> a, std::span<const Rgb> b, int width, int height,
                  double pixels_per_degree) {
  const std::vector<float> map = flip_map(a, b, width, height, pixels_per_degree);
  double sum = 0;
  for (const float value : map) sum += static_cast<double>(value);
  return map.empty() ? 0 : sum / static_cast<double>(map.size());
}

}  // namespace heddle
