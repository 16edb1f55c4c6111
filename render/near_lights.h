#ifndef HEDDLE_RENDER_NEAR_LIGHTS_H_
#define HEDDLE_RENDER_NEAR_LIGHTS_H_
// Lights at a finite distance.
//
//   point      irradiance I / d^2 at d metres, I its irradiance at 1 m (radiant intensity, W/sr
//              where irradiance is W/m^2)
//   sphere     constant radiance, to the outside; nothing within
//   rectangle  constant radiance, or that times a picture, from the side that its normal points to
//
// Spheres are sampled uniformly in their cone. Rectangles are sampled uniformly in their solid
// angle by the spherical rectangle of Urena, Fajardo and King 2013, small ones by area.
//
// What stands for one at a point has its irradiance (radiance times solid angle), its mean
// direction, and the sharpness at which a Gaussian has its mean cosine. The mean direction of a
// rectangle is Lambert's sum over its edges. All of that is in closed form. Tested in
// tests/render/near_lights_test.cpp.

#include <functional>
#include <optional>
#include <vector>

#include "render/lights.h"

namespace heddle {

LightSample sample_near_light(const Light& light, const Vec3d& point, RandomStream& random);
std::optional<MetLight> meet_near_light(const Light& light, const Vec3d& point,
                                        const Vec3& direction);
SeenLight near_light_from(const Light& light, const Vec3d& point);

/// A rectangle as light.gaussians parts at most, each with the mean radiance of its part of the
/// texture. The part that is seen under the widest angle from the nearest cloth is halved, until
/// all are as narrow as a Gaussian of sharpness kPartSharpness; with a texture, until none are
/// left. nearest_mm(position): distance of the nearest cloth.
std::vector<Light> split_rectangle(const Light& light,
                                   const std::function<double(const Vec3d&)>& nearest_mm);
inline constexpr double kPartSharpness = 40;

/// Distance (mm) from a point to the nearest point of a near light; 0 within a sphere.
double distance_to_light(const Light& light, const Vec3d& point);

}  // namespace heddle

#endif  // HEDDLE_RENDER_NEAR_LIGHTS_H_
