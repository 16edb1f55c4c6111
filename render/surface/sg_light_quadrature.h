#ifndef HEDDLE_RENDER_SURFACE_SG_LIGHT_QUADRATURE_H_
#define HEDDLE_RENDER_SURFACE_SG_LIGHT_QUADRATURE_H_
// A surface model under a spherical Gaussian light by quadrature, for models without a closed form.
//
// It uses Fibonacci lattices in (share of the light's power within an angle of its axis, azimuth).
// The light is constant in these coordinates, for every sharpness from 0 (the whole sphere) up.
// Each next lattice has 2.6 times as many points, until two agree. Errors fall as 1 / N for
// continuous models and as N^(-3/4) for those with steps (point values of woven cloth). Adaptive
// cells were tried. They miss steps that touch a cell between its nodes, and at equal cost their
// errors were larger. Tested in tests/render/surface/sg_light_quadrature_test.cpp.

#include <functional>

#include "fibers/math/vector.h"

namespace heddle {

struct SgLightQuadrature {
  double tolerance = 1e-3;  // relative difference of two lattices at which the finer one is taken
  int max_points = 50000;   // of the finest lattice, at least 1597; the coarsest has 610
};

/// Integral over the sphere of reflected(wi) G(wi; axis, sharpness) / M(sharpness), 0 where wi.z <=
/// 0.
Rgbd integrate_sg_light(const Vec3d& axis, double sharpness,
                        const std::function<Rgbd(const Vec3d&)>& reflected,
                        const SgLightQuadrature& settings = {});

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_SG_LIGHT_QUADRATURE_H_
