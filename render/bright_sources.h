#ifndef HEDDLE_RENDER_BRIGHT_SOURCES_H_
#define HEDDLE_RENDER_BRIGHT_SOURCES_H_
// Small bright sources of an environment, the sun or lamps, apart from the rest. A few smooth
// Gaussians cannot hold both: fitted together, a sun of a few pixels becomes 5 degrees wide.
//
// The brightest pixel is taken with all that hangs together with it and is brighter than a
// twentieth of it. If that is smaller than kLargestSource and brings more than kLeastShare of the
// light, what is brighter than its rim is split off. Then the next brightest pixel is looked at. No
// light is lost: source and rest add up to the map. Tested in tests/render/bright_sources_test.cpp.

#include <vector>

#include "render/environment_map.h"

namespace heddle {

inline constexpr double kLargestSource = 0.02;  // sr: a disk of 4.6 degrees radius
inline constexpr double kLeastShare = 0.005;    // of the luminance from all around

struct SplitEnvironment {
  std::vector<Light>
      sources;  // spherical Gaussians of the sources' light, direction and mean cosine
  EnvironmentMap rest;
};

/// At most `most` sources, brightest pixel first.
SplitEnvironment split_bright_sources(const EnvironmentMap& map, int most);

}  // namespace heddle

#endif  // HEDDLE_RENDER_BRIGHT_SOURCES_H_
