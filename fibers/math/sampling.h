#ifndef HEDDLE_FIBERS_MATH_SAMPLING_H_
#define HEDDLE_FIBERS_MATH_SAMPLING_H_
// Random directions, points and angles with their exact densities.
//
// Densities are per steradian over the whole sphere, or per radian. Some routines reject and so
// take a variable number of draws, always from their own stream. Chi-square tested in
// tests/math/sampling_test.cpp.

#include "fibers/math/random.h"
#include "fibers/math/vector.h"

namespace heddle {

/// Right-handed orthonormal frame whose first column is `tangent` (unit): world = frame * local,
/// local x = tangent. Duff et al. 2017; continuous except across tangent.z = 0.
Mat3 frame_about(const Vec3& tangent);

/// Uniform on the unit sphere; density 1 / 4 pi.
Vec3 sample_sphere(RandomStream& random);

/// Uniform on the half of the sphere about `axis` (unit); density 1 / 2 pi.
Vec3 sample_hemisphere(const Vec3& axis, RandomStream& random);

/// Uniform in the unit disk; density 1 / pi per unit area.
Vec2 sample_disk(RandomStream& random);

/// Direction with density G / mass of the spherical Gaussian (von Mises-Fisher). Sharpness from 0
/// (uniform) to 1e8.
Vec3 sample_spherical_gaussian(const Vec3& axis, float sharpness, RandomStream& random);
float spherical_gaussian_pdf(const Vec3& axis, float sharpness, const Vec3& direction);

/// Angle in [-pi, pi] with the von Mises density exp(concentration (cos(angle) - 1)) / (2 pi I0(k)
/// exp(-k)). By the rejection of Best and Fisher 1979, which accepts at least 65 %. Concentration k
/// from 0 to 1e8.
class VonMisesSampler {
 public:
  explicit VonMisesSampler(double concentration);
  float sample(RandomStream& random) const;

 private:
  double concentration_;
  double envelope_;  // r - 1 of the wrapped Cauchy envelope
};

/// Angle with the density of a Gaussian (mean, deviation in radians) cut to [-pi/2, pi/2] and
/// normalised there. |mean| <= pi/2 and deviation <= pi/2: the rejection then keeps at least 47 %.
float sample_cut_gaussian(float mean, float deviation, RandomStream& random);

/// Share of the uncut Gaussian that lies in [-pi/2, pi/2]: the density above is the Gaussian's
/// divided by it.
float cut_gaussian_mass(float mean, float deviation);

/// Weight of a draw by one of two samplers (Veach 1997, exponent 2), from the densities of both
/// there. Written so that neither square can overflow.
inline float power_heuristic(float chosen, float other) {
  const float ratio = other / chosen;
  return 1.0F / (1.0F + ratio * ratio);
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SAMPLING_H_
