#ifndef HEDDLE_TESTS_RENDER_STAND_IN_TWO_TEXELS_H_
#define HEDDLE_TESTS_RENDER_STAND_IN_TWO_TEXELS_H_
// Maps of the least cloth: a flat weft, along x, beside a flat warp, along y.

#include "render/stand_in/flat_maps.h"

namespace heddle::test {

inline FlatMaps two_texels() {
  FlatMaps maps;
  maps.width = 2;
  maps.height = 1;
  maps.width_mm = 2;
  maps.height_mm = 1;
  maps.opacity = {1, 1};
  maps.relief_mm = {0, 0.1F};
  maps.albedo = {Rgb(0.6F, 0.4F, 0.2F), Rgb(0.3F, 0.4F, 0.6F)};
  maps.normal = {Vec3::UnitZ(), Vec3::UnitZ()};
  maps.along = {Vec2::UnitX(), Vec2::UnitY()};
  maps.tilt_along = {0, 0};
  maps.tilt_across = {0, 0};
  maps.picture = {Rgb::Zero(), Rgb::Zero()};
  return maps;
}

}  // namespace heddle::test

#endif  // HEDDLE_TESTS_RENDER_STAND_IN_TWO_TEXELS_H_
