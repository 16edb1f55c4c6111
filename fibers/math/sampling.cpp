#include "fibers/math/sampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {

Mat3 frame_about(const Vec3& tangent) {
  const float sign = std::copysign(1.0F, tangent.z());
  const float a = -1.0F / (sign + tangent.z());
  const float b = tangent.x() * tangent.y() * a;
  Mat3 frame;
  frame.col(0) = tangent;
  frame.col(1) = Vec3(1.0F + sign * tangent.x() * tangent.x() * a, sign * b, -sign * tangent.x());
  frame.col(2) = Vec3(b, sign + tangent.y() * tangent.y() * a, -tangent.y());
  return frame;
}

Vec3 sample_sphere(RandomStream& random) {
  const float z = 1.0F - 2.0F * random.uniform();
  const float phi = 2.0F * kPif * random.uniform();
  const float radius = std::sqrt(std::max(0.0F, 1.0F - z * z));
  return {radius * std::cos(phi), radius * std::sin(phi), z};
}

Vec3 sample_hemisphere(const Vec3& axis, RandomStream& random) {
  const Vec3 direction = sample_sphere(random);
  return direction.dot(axis) < 0.0F ? Vec3(-direction) : direction;
}

Vec2 sample_disk(RandomStream& random) {
  const float radius = std::sqrt(random.uniform());
  const float phi = 2.0F * kPif * random.uniform();
  return {radius * std::cos(phi), radius * std::sin(phi)};
}

Vec3 sample_spherical_gaussian(const Vec3& axis, float sharpness, RandomStream& random) {
  // 1 - cosine to the axis, by inversion; the double uniform keeps the tail at any sharpness.
  const double drop = sg_depth_of_share(random.uniform_double(), sharpness);
  const auto radius = static_cast<float>(std::sqrt(drop * (2.0 - drop)));
  const float phi = 2.0F * kPif * random.uniform();
  const Vec3 local(static_cast<float>(1.0 - drop), radius * std::cos(phi), radius * std::sin(phi));
  return (frame_about(axis) * local).normalized();
}

float spherical_gaussian_pdf(const Vec3& axis, float sharpness, const Vec3& direction) {
  return std::exp(-0.5F * sharpness * (direction - axis).squaredNorm()) / sg_mass(sharpness);
}

VonMisesSampler::VonMisesSampler(double concentration)
    : concentration_(concentration), envelope_(0.0) {
  assert(concentration >= 0.0);
  // rho = (t - sqrt(2 t)) / (2 k), t = 1 + sqrt(1 + 4 k^2), and r = (1 + rho^2) / (2 rho); written
  // without cancellation: t - sqrt(2 t) = sqrt(t) (sqrt(t) - sqrt(2)) = sqrt(t) (t - 2) / (sqrt(t)
  // + sqrt(2)).
  const double root = std::sqrt(1.0 + 4.0 * concentration * concentration);
  const double t = 1.0 + root;
  const double t_minus_2 = 4.0 * concentration * concentration / (root + 1.0);
  if (concentration > 1e-8) {
    const double rho =
        std::sqrt(t) * t_minus_2 / ((std::sqrt(t) + std::sqrt(2.0)) * 2.0 * concentration);
    envelope_ = (1.0 - rho) * (1.0 - rho) / (2.0 * rho);
  }
}

float VonMisesSampler::sample(RandomStream& random) const {
  if (concentration_ <= 1e-8) return kPif * (2.0F * random.uniform() - 1.0F);
  while (true) {
    const double u = random.uniform_double();
    const double half_sine = std::sin(0.5 * kPi * u);
    const double one_minus_z = 2.0 * half_sine * half_sine;
    // 1 - cos(angle) = (r - 1) (1 - z) / (r + z), small numbers throughout at high concentration.
    const double drop = envelope_ * one_minus_z / (envelope_ + 2.0 - one_minus_z);
    const double c = concentration_ * (envelope_ + drop);
    const double v = random.uniform_double();
    if (c * (2.0 - c) <= v && std::log(c) + 1.0 - c < std::log(v)) continue;
    const auto angle = static_cast<float>(2.0 * std::asin(std::sqrt(std::min(1.0, 0.5 * drop))));
    return (random.bits() & 1U) != 0U ? angle : -angle;
  }
}

float sample_cut_gaussian(float mean, float deviation, RandomStream& random) {
  assert(std::abs(mean) <= 0.5F * kPif + 1e-6F && deviation > 0.0F);
  while (true) {
    // Box and Muller: two normal deviates from two uniforms; the second is tried when the first
    // falls outside.
    const float radius = deviation * std::sqrt(-2.0F * std::log(1.0F - random.uniform()));
    const float phi = 2.0F * kPif * random.uniform();
    const float first = mean + radius * std::cos(phi);
    if (std::abs(first) < 0.5F * kPif) return first;
    const float second = mean + radius * std::sin(phi);
    if (std::abs(second) < 0.5F * kPif) return second;
  }
}

float cut_gaussian_mass(float mean, float deviation) {
  const float scale = 0.70710678F / deviation;
  return 0.5F * erf_difference(scale * (-0.5F * kPif - mean), scale * (0.5F * kPif - mean));
}

}  // namespace heddle
