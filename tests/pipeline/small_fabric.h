#ifndef HEDDLE_TESTS_PIPELINE_SMALL_FABRIC_H_
#define HEDDLE_TESTS_PIPELINE_SMALL_FABRIC_H_
// A fabric that a test can take through all stages in seconds, and a flat scene of it.

#include <gtest/gtest.h>

#include <string>

namespace heddle {

/// About a thousand segments: several chunks of visibility and of transfer.
inline constexpr char kSmallFabric[] = R"(name = "small"
light_from = "face"
segment_um = 60

[weave]
notation = "plain"
repeats_x = 1
repeats_y = 1
crimp_warp = 0.5

[fiber.thread]
radius_um = 10
color_r = [0.2, 0.3, 0.4]
color_tt = [0.5, 0.6, 0.7]
beta_r_deg = 5
beta_tt_deg = 12
gamma_tt_deg = 25

[warp]
fiber = "thread"
spacing_mm = 0.25
width_mm = 0.2
height_mm = 0.12
plies = 1
fibers_per_ply = 24
yarn_twist_per_m = 0
ply_twist_per_m = 400
migration = 0
wander_rms_deg = 3

[weft]
fiber = "thread"
spacing_mm = 0.25
width_mm = 0.2
height_mm = 0.12
plies = 1
fibers_per_ply = 24
yarn_twist_per_m = 0
ply_twist_per_m = 400
migration = 0
wander_rms_deg = 3

[visibility]

[transfer]
order = 2
cell_mean_free_paths = 2.5
min_paths = 4096
max_paths = 4096

[volume]
)";

/// Expects the fabric above beside it, as fabric.toml.
inline constexpr char kSmallScene[] = R"(name = "swatch"

[camera]
position_mm = [0.1, -0.5, 1.0]
look_at_mm = [0, 0, 0]
fov_deg = 25
fov_axis = "vertical"
resolution_px = [24, 24]

[camera.reference]
corner_px = [8, 8]
size_px = [8, 6]
spp = 4

[[light]]
type = "directional"
direction = [0.3, 0.2, 1]
irradiance = [3, 3, 3]

[[light]]
type = "sg"
axis = [-0.5, 0.4, 1]
sharpness = 15
irradiance = [1, 1, 1]

[[cloth]]
flat_mm = [4, 4]
fabric = "fabric.toml"

[render]
method = "exact"
spp = 2
)";

/// The text with every `from` replaced; a test that finds none fails.
inline std::string edited(std::string text, const std::string& from, const std::string& to) {
  std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  for (; at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_PIPELINE_SMALL_FABRIC_H_
