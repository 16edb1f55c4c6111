#ifndef HEDDLE_FIBERS_BAKED_FAR_TABLE_H_
#define HEDDLE_FIBERS_BAKED_FAR_TABLE_H_
// A fabric as seen from afar: what a piece of flat cloth sends to the eye in the mean, where a
// pixel covers a repeat or more. Made of the fabric's own precomputed data (precompute/far_bake.h),
// for every view direction:
//
//   single scattering     tabulated over the light's direction, a little blurred in it
//   multiple scattering   linear in the light's harmonics, as the transfer is: one row of
//                         coefficients
//   its part on cones     tabulated like single scattering, where the transfer has cones
//
// Views and lights are the cells of a DirectionGrid in fabric space. Radiance is for a light of
// irradiance 1. Half of the views look at the face (wo.z > 0), half at the back. Tested in
// tests/fibers/baked/far_table_test.cpp.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fibers/math/direction_grid.h"
#include "formats/tensor_file.h"

namespace heddle {

struct FarTable {
  int resolution = 32;       // of the grid of directions
  bool both_sides = false;   // light from the whole sphere; otherwise from the face (z > 0) only
  int order = 5;             // of the harmonics
  float repeat_mm = 0;       // edge of a square as large as the weave's repeat
  float light_variance = 0;  // of the blur in the light's direction, square radians along each axis
  std::vector<float>
      coverage;               // [view] share of the cloth's area that is fiber, as seen from there
  std::vector<float> height;  // [view] mean z of the fibers seen, mm
  std::vector<Half> single;   // [view][light][rgb]
  std::vector<float> multiple;  // [view][coefficient][rgb] all of it, for c_light of transfer.h
  // Where the transfer has cones: the part of `multiple` that they model, and their own form of it.
  std::vector<float> on_cones;  // [view][coefficient][rgb]
  std::vector<Half> cones;      // [view][light][rgb]

  DirectionGrid grid() const { return DirectionGrid(resolution); }
  std::uint32_t view_count() const { return grid().count(); }
  std::uint32_t light_count() const { return both_sides ? grid().count() : grid().per_side(); }
  int coefficients() const { return (order + 1) * (order + 1); }
  bool has_cones() const { return !cones.empty(); }
};

void write_far_table(const std::filesystem::path& path, const FarTable& table,
                     const std::map<std::string, std::string>& metadata);
/// Errors: FileError where the file's tensors do not belong together.
FarTable read_far_table(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_FAR_TABLE_H_
