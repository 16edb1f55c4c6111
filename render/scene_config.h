#ifndef HEDDLE_RENDER_SCENE_CONFIG_H_
#define HEDDLE_RENDER_SCENE_CONFIG_H_
// What a scene TOML says: views, lights, pieces of cloth, other meshes, how to render. Keys, units
// and ranges: configs/README.md. Lengths in millimetres, angles in radians after parsing. Errors:
// ConfigError with its place. Tested in tests/render/scene_config_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/tracing/block_layout.h"
#include "formats/toml_table.h"
#include "render/camera.h"
#include "render/lights.h"
#include "render/mesh_file.h"
#include "render/methods.h"
#include "render/pixel_filter.h"
#include "render/surface/microcylinder.h"
#include "render/surface/paint.h"
#include "render/surface/surface_model.h"
#include "render/tone_map.h"
#include "render/yarn_drift.h"
#include "render/yarn_tints.h"

namespace heddle {

/// How the precomputed methods shade a cloth without fibers. Traced paths always sample.
enum class SurfaceMethod : std::uint8_t {
  kSampled,      // shadow rays and directions drawn from the model
  kInteractive,  // closed forms from precomputed data (surface/interactive_microcylinder.h)
};

/// A cloth without fibers.
struct SurfaceFabric {
  std::string name;  // as the scene gives it: a preset or a file
  std::string text;  // canonical text of its config: equal content, equal text
  std::shared_ptr<const SurfaceModel> model;
  std::optional<MicrocylinderFabric> interactive;  // where the model has an interactive form
};

/// How blocks of exemplars are laid on a cloth's plane.
struct BlocksConfig {
  std::array<int, 2> size_repeats = {1, 1};  // weave repeats in a block along x and y
  BlockOrder order = BlockOrder::kAligned;
  std::uint64_t seed = 1;  // of the order
};

/// What lies where two fabrics of a pattern meet.
enum class PatternBorders : std::uint8_t {
  kCut,    // the fibers of each, cut at the block's border, as in Khungurn 2017, section 6.4
  kWoven,  // blocks of a sample that is woven with these neighbours (pipeline/border_sample.h)
};

/// A picture that says which fabric lies where: one pixel, one block. It is repeated without end.
struct PatternConfig {
  std::vector<std::filesystem::path> fabrics;  // as `fabric` of a cloth
  std::filesystem::path picture;
  int columns = 1;
  int rows = 1;
  std::vector<std::uint16_t> blocks;  // [row][column] which of `fabrics`, rows upwards
  // the cloth's block on which the picture's lower left pixel lies
  std::array<int, 2> corner_blocks = {0, 0};
  PatternBorders borders = PatternBorders::kCut;
  int sample_blocks = 64;  // most blocks of the sample
};

struct ClothConfig {
  std::string name;              // in mattes; empty: by its number
  std::optional<MeshFile> mesh;  // an OBJ with UVs, or else a flat swatch
  double uv_size_mm = 0;         // flat cloth (mm) per unit of UV; meshes only
  FabricPlacement on_uvs;        // meshes only
  // flat swatch centred on the world's origin, z = 0; x = weft, y = warp
  double flat_width_mm = 0;
  double flat_height_mm = 0;
  Placement flat_placement;
  // fabric TOML; empty where a surface model draws the cloth; the first of a pattern
  std::filesystem::path fabric;
  std::optional<PatternConfig> pattern;       // in place of one fabric
  std::optional<BlocksConfig> blocks;         // with a pattern, or to break up one fabric's repeat
  std::optional<YarnDriftConfig> yarn_drift;  // fibers only
  std::optional<YarnTintConfig> yarn_tint;    // fibers only
  std::optional<SurfaceFabric> surface;
  SurfaceMethod surface_method = SurfaceMethod::kSampled;
  // fibers only: what a plan may draw instead where it is good enough
  std::optional<SurfaceFabric> far_surface;
  bool underlay = false;  // a black copy of the cloth's underside just below it; fibers only
  double thickness = 1;   // relative to the fabric's; fibers only
};

/// A mesh beside cloth.
struct MeshConfig : MeshFile {
  std::shared_ptr<const Paint> paint;  // null: black
};

/// The fabric files of a cloth: none for a surface, one, or those of its pattern.
std::vector<std::filesystem::path> fabric_files(const ClothConfig& cloth);

/// A path-traced crop of a view, to compare the view with.
struct ReferenceConfig {
  PixelRect crop;      // inside the view's frame
  int spp = 64;        // even
  bool local = false;  // paths end where they leave the shell
};

/// One picture that the scene asks for.
struct ViewConfig {
  std::string name;  // part of the file's name; empty for the view of [camera]
  CameraConfig camera;
  CameraConfig camera_of_frame_0;
  double turn_per_frame = 0;  // radians about the camera's up, through look_at
  int spp = 16;               // samples per pixel; even where paths are traced
  std::optional<ReferenceConfig> reference;
};

/// Layers of a picture that are made when asked for.
struct LayerChoice {
  bool lobes = false;        // reflected, transmitted
  bool surface = false;      // albedo, N, P, UV
  bool cryptomatte = false;  // of cloths, yarns and fibers

  bool any() const { return lobes || surface || cryptomatte; }
};

struct SceneConfig {
  std::string name;
  int frame = 0;
  std::vector<ViewConfig> views;  // that of [camera] first, then every [[view]]
  std::vector<Light> lights;
  // [Light::group] names; one without a name where no light has a group
  std::vector<std::string> light_groups;
  std::vector<std::filesystem::path> light_files;  // pictures that the lights were read from
  Rgb background = Rgb(0, 0, 0);  // radiance seen by eye rays that hit nothing; lights nothing
  std::vector<ClothConfig> cloths;
  std::vector<MeshConfig> meshes;
  RenderMethod method = RenderMethod::kExact;
  std::uint64_t seed = 1;
  // smoothing of global visibility; from the fabric where absent
  std::optional<double> shadow_sigma_mm;
  // repeats of a fabric in a pixel from which nothing but its far form is seen; none where absent
  std::optional<double> far_from;
  int bounces = 0;  // of light between folds, in methods with far forms
  PixelFilter filter;
  LayerChoice layers;
  ScreenLook look;  // of the PNG
};

/// Do shapes depend on the cameras (subdivide_px)?
bool is_cut_for_pictures(const SceneConfig& scene);
/// The cameras on which they depend: those of all views, in all frames.
std::vector<CameraConfig> cameras_of_cuts(const SceneConfig& scene);

/// Reads a whole scene document, finish() included, and shows a frame: that of the key `frame`
/// where none is chosen.
SceneConfig read_scene_config(const TomlTable& document, std::optional<int> frame = {});

/// Puts the meshes and cameras of a frame in place. Errors: ConfigError where a numbered mesh lacks
/// that frame.
void show_frame(SceneConfig& scene, int frame);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SCENE_CONFIG_H_
