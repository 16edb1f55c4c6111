#ifndef HEDDLE_FIBERS_BAKED_CONE_TRANSFER_H_
#define HEDDLE_FIBERS_BAKED_CONE_TRANSFER_H_
// The part of a cell's transfer that spherical harmonics blur: light that parallel fibers keep on a
// cone. Not in the papers.
//
// A smooth fiber conserves the light's inclination to its tangent, up to the width beta of its
// lobe. Among parallel filaments, indirect light therefore stays near a cone about the bundle
// (bundle_tangents.h): that on which the light itself lies, within a few degrees. Harmonics of
// order 5 resolve some 30 degrees and spread it: 26 % RMSE on flat silk satin.
//
// The history of a path predicts its deviation from the cone: the variances of the lobes that
// scattered it, and sin^2 of the angle between each fiber and the bundle. Paths are sorted into
// classes by it. Within a class the measured deviations have that variance and are Gaussian
// (kurtosis 2.1 to 3.1 on silk, cotton and wool). For paths below a limit the transfer is modelled
// as
//
//   T(w0, w) = sum over widths d: N(theta - theta0; deviation_d) / cos(theta) * f_d(w0, phi)
//
// theta and theta0 are the inclinations of w and w0 to the segment's bundle. phi is the azimuth of
// w about it. f_d is smooth: real spherical harmonics in w0 (fabric space), Fourier series in phi.
// Its coefficients are moments of the same paths that make the matrix, so no light is lost or
// gained:
//
//   moments[d][j0][m] = mean of 4 pi throughput Y_j0(w0) F_m(phi)
//
// Tested in tests/precompute/transfer_bake_test.cpp and tests/render/multiple_scattering_test.cpp.

#include <array>
#include <cstdint>
#include <vector>

#include "fibers/math/sampling.h"
#include "fibers/math/vector.h"

namespace heddle {

struct ConeTransfer {
  static constexpr int kWidths = 3;
  static constexpr int kAzimuthOrder = 4;
  static constexpr int kAzimuths = 2 * kAzimuthOrder + 1;
  // of the deviation predicted
  static constexpr std::array<float, kWidths> kLimitDegrees = {5.0F, 9.0F, 13.0F};
  // of a class: its rms
  static constexpr std::array<float, kWidths> kDeviationDegrees = {3.7F, 7.1F, 10.4F};

  // [cell][j0][j1][rgb]: the part of Transfer::matrices that these paths are
  std::vector<float> harmonics;
  std::vector<float> moments;  // [cell][width][j0][azimuth][rgb]

  /// The class of a path by the variance that it predicts (square radians); kWidths if that is too
  /// wide.
  static int width_of(float variance) {
    int width = 0;
    while (width < kWidths &&
           variance >= square(kLimitDegrees[static_cast<std::size_t>(width)] * kPif / 180))
      ++width;
    return width;
  }
  static float variance_of(int width) {
    return square(kDeviationDegrees[static_cast<std::size_t>(width)] * kPif / 180);
  }

 private:
  static float square(float x) { return x * x; }
};

/// Axes about a bundle as rows: x = its tangent, y = up (across the tangent), z = x cross y.
/// Azimuths are measured from y towards z.
inline Mat3 cone_frame(const Vec3& bundle_tangent) {
  constexpr float kUpright = 1e-4F;  // as close to upright, any y will do
  const Vec3 up = Vec3(0, 0, 1) - bundle_tangent.z() * bundle_tangent;
  const float length = up.norm();
  Mat3 axes;
  axes.row(0) = bundle_tangent;
  axes.row(1) = length > kUpright ? Vec3(up / length) : Vec3(frame_about(bundle_tangent).col(1));
  axes.row(2) = bundle_tangent.cross(Vec3(axes.row(1)));
  return axes;
}

/// Orthonormal Fourier series on the circle, by the cosine and sine of the azimuth: 1, cos, sin,
/// cos 2, sin 2, ...
inline std::array<float, ConeTransfer::kAzimuths> azimuth_harmonics(float cosine, float sine) {
  const float constant = 1 / std::sqrt(2 * kPif);
  const float factor = 1 / std::sqrt(kPif);
  std::array<float, ConeTransfer::kAzimuths> values;
  values[0] = constant;
  float c = cosine;
  float s = sine;
  for (std::size_t m = 1; m <= ConeTransfer::kAzimuthOrder; ++m) {
    values[2 * m - 1] = factor * c;
    values[2 * m] = factor * s;
    const float next = c * cosine - s * sine;
    s = s * cosine + c * sine;
    c = next;
  }
  return values;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_CONE_TRANSFER_H_
