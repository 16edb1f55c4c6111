#ifndef HEDDLE_PRECOMPUTE_VISIBILITY_SETTINGS_H_
#define HEDDLE_PRECOMPUTE_VISIBILITY_SETTINGS_H_
// A fabric's section [visibility]: how segment visibility is compressed. Keys, ranges and defaults:
// configs/README.md. The resolution of the maps is fixed (VisibilityMaps::kResolution). Tested in
// tests/precompute/visibility_settings_test.cpp.

#include <cstdint>

#include "fibers/math/sg_sum_fit.h"
#include "formats/toml_table.h"

namespace heddle {

struct VisibilitySettings {
  int components = 48;      // principal components of the signed distance functions
  int pca_segments = 2048;  // segments, chosen at random, from which the components are computed
  SgSumShape sgs;           // the sum of spherical Gaussians
  // light from the whole sphere; otherwise only from the face side (z > 0)
  bool both_sides = false;
  std::uint64_t seed = 1;
};

/// Reads the section [visibility]. both_sides is the fabric's, and so is the seed, which the caller
/// sets. Axes of the upper hemisphere only are an error with light from both sides.
VisibilitySettings read_visibility_settings(const TomlTable& section, bool both_sides);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_VISIBILITY_SETTINGS_H_
