#ifndef HEDDLE_PIPELINE_WARNINGS_H_
#define HEDDLE_PIPELINE_WARNINGS_H_
// Warnings of methods that are used beyond their limits: what a user should know before trusting a
// picture or a pack. Every limit below was read from a measured error curve (docs/stability.md).
// tests/stability compares curve and limit. `heddle check` reports what is true of a pack, whatever
// is rendered from it. `render` and `run` report that and what is true of the picture, and put it
// into the picture's report. A warning never changes a result or an exit status. Tested in
// tests/stability/warnings_test.cpp.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "fibers/tracing/tile_scene.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/lights.h"
#include "render/methods.h"
#include "render/render_output.h"
#include "render/scene_config.h"
#include "render/single_scattering.h"

namespace heddle {

struct Warning {
  std::string subject;        // its curve in docs/stability.md
  std::string what;           // the fact, with its place and figures
  double expected_error = 0;  // relative, of what `what` speaks of; from the curve
  std::string instead;        // what to do
};

/// "warning: cells: ...; expect errors of about 12 %. Do this."
std::string warning_text(const Warning& warning);
/// [{"subject", "what", "expected_relative_error", "instead"}]
nlohmann::ordered_json warnings_report(std::span<const Warning> warnings);
/// The warnings in the report beside a picture. Errors: FileError.
std::vector<Warning> read_warnings(const std::filesystem::path& path);

// Transfer: cells of more mean free paths are visibly too dark and blocky.
inline constexpr double kCellMeanFreePaths = 6;
// Transfer without cones: light that spreads by less than this at every scattering keeps shapes
// that order 5 cannot hold.
inline constexpr double kParallelDegrees = 7;
// Sharpness above which sums of Gaussians alone are out of range, on data for light from the face
// and from both sides. Sharpness below which signed distances alone are.
inline constexpr double kLobesSharpness = 200;
inline constexpr double kSphereLobesSharpness = 30;
inline constexpr double kDistanceSharpness = 3;
// Gamma as printed: lights softer than this.
inline constexpr double kPrintedGammaSharpness = 1000;
// Pixels smaller than this many radii of a fiber show the one value of a segment.
inline constexpr double kPixelRadii = 0.5;
// Eye rays this far from the normal, for more than half of what the picture shows.
inline constexpr double kGrazingDegrees = 80;
// Cloth this near to a rim, and the share of what the picture shows.
inline constexpr double kRimThicknesses = 1;
inline constexpr double kRimShare = 0.2;
// Light from behind, share of what the picture shows.
inline constexpr double kBehindShare = 0.05;
// Light from both sides: light this near to the plane of the cloth, for more than half of what the
// picture shows.
inline constexpr double kPlaneDegrees = 8;
// Tetrahedra without a picture (flipped, degenerate), share of all.
inline constexpr double kHiddenTetShare = 0.005;
// Negative light by ringing, share of multiple scattering.
inline constexpr double kNegativeShare = 0.01;
// Interactive surfaces: Gaussian lights softer than this, from which the weights do not come out of
// the integral.
inline constexpr double kInteractiveSharpness = 20;
// A near light closer to the cloth than this many of its tiles, and the share of what the picture
// shows that is.
inline constexpr double kNearTiles = 4;
inline constexpr double kNearShare = 0.05;
// Noise of pixels that cover more than a repeat.
inline constexpr double kNoise = 0.1;

/// What a pack's limits depend on.
struct PackFacts {
  double mean_free_path_mm = 0;
  // edge of as many cubes as there are cells; 0 without a transfer
  double cell_mean_free_paths = 0;
  // radians: rms angle between the fibers within three mean free paths, median over segments
  double neighbour_angle = 0;
  // radians: the narrowest longitudinal lobe that carries a tenth of the light or more
  double lobe_width = 0;
};
PackFacts pack_facts(const FabricPack& pack, const TileScene& tile);

/// Of the pack alone.
std::vector<Warning> pack_warnings(const FabricPack& pack, const TileScene& tile);

/// A picture about to be made. packs: [part of the scene]; empty where paths are traced.
struct PictureSetup {
  const ClothScene* scene;
  std::span<const FabricPack* const> packs;
  std::span<const Light> lights;
  const Camera* camera;
  PixelRect crop;
  RenderMethod method = RenderMethod::kExact;
  VisibilityBlend blend;
  bool interactive_surfaces = false;  // some cloth is a surface by its interactive method
};

/// Of the picture, before it is made and without those of its packs. From some hundred eye rays.
std::vector<Warning> picture_warnings(const PictureSetup& setup);
/// Of the picture that was made.
std::vector<Warning> frame_warnings(const PictureSetup& setup, const FrameBuffers& frame);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_WARNINGS_H_
