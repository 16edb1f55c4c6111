#ifndef HEDDLE_RENDER_ENVIRONMENT_SGS_H_
#define HEDDLE_RENDER_ENVIRONMENT_SGS_H_
// An environment as a sum of spherical Gaussian lights, nearest to its blurred radiance in the
// least-squares sense. It is the lighting of Iwasaki et al. 2014 (section 3), and a list of lights
// that every renderer takes.
//
// The published text does not say how its Gaussians are found. Here the map is first blurred by a
// Gaussian of sharpness kEnvironmentBlur (5 degrees). Otherwise one sun of a few pixels takes all
// Gaussians, and the light that cloth receives is off by half. Gaussians are added one at a time.
// Each is taken from a fixed set of axes and sharpnesses, and lowers the error most. After each,
// all axes, sharpnesses and colours are moved together by Levenberg-Marquardt steps. Non-negative
// least squares keeps colours at or above 0. This runs on 64 x 32 pixels first, and at the end on
// 128 x 64. At last the blur is taken out of the sharpnesses, up to kSharpestLight. There are no
// random numbers: equal maps give equal lights. 0.3 s for 10 Gaussians, 4 s for 64.
//
// Small bright sources may be split off first (bright_sources.h). Then the Gaussians are scaled, in
// each colour, to bring all the light of the rest. Tested in tests/render/environment_sgs_test.cpp;
// errors for real maps: docs/surface-models.md.

#include <vector>

#include "render/environment_map.h"
#include "render/lights.h"

namespace heddle {

inline constexpr double kEnvironmentBlur = 120;
inline constexpr double kSharpestLight = 2000;

struct EnvironmentSgs {
  // spherical Gaussians: the bright sources, then `count` others, brightest first
  std::vector<Light> lights;
  int bright_sources = 0;
  // of the rest: root of the integral of |L - sum|^2 over that of |L|^2, both blurred
  double relative_error = 0;
  double irradiance_error = 0;  // of all: relative RMS of the irradiance over normals, to order 8
  double energy_error = 0;      // of all: sum over colours of what is missing or too much, relative
};

/// count >= 1; at most `bright_sources` are split off. A black map gives black lights and error 0.
EnvironmentSgs fit_environment_sgs(const EnvironmentMap& map, int count, int bright_sources = 0);

}  // namespace heddle

#endif  // HEDDLE_RENDER_ENVIRONMENT_SGS_H_
