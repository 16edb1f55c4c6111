#ifndef HEDDLE_RENDER_SCENE_LAYERS_H_
#define HEDDLE_RENDER_SCENE_LAYERS_H_
// Layers of what eye rays see, whatever its light: albedo, N, P, UV, and Cryptomattes of cloths,
// yarns and fibers. They are found by a pass of their own over the same eye rays, in every method,
// so that only a block of pixels needs the lists of what its samples see. The mattes' shares are
// shares of samples. Those are drawn as the pixel filter weighs them, so coverage is filtered like
// the beauty, and a matte times the beauty has no fringe.
//
// Names in mattes: the cloth or mesh, CLOTH/warp12 or CLOTH/weft-3 (counted through the cloth, as
// in yarn_tints.h), and CLOTH/warp12/fiber345 (counted through the exemplar; in patterns
// CLOTH/warp12/part2/fiber345). What has no yarns has its own name in all three. Tested in
// tests/render/scene_layers_test.cpp.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "fibers/scattering/fiber_bcsdf.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/g_buffer.h"
#include "render/render_output.h"
#include "render/scene_config.h"

namespace heddle {

/// A piece of cloth as its layers know it.
struct LayerPiece {
  std::string name;
  // texture coordinates of a place on the fabric (mm)
  std::function<Eigen::Vector2d(const Eigen::Vector2d&)> uv;
};

/// The pieces of a scene in the order of ClothScene.
struct LayerPieces {
  std::vector<LayerPiece> cloths;    // of fibers
  std::vector<LayerPiece> surfaces;  // without, then coloured meshes, whose UV is 0
  std::vector<std::string> meshes;   // black ones, then undersides
};
/// Yarns that lie unevenly (yarn_drift) move the fabric on the mesh; their UV leaves that out.
LayerPieces layer_pieces_of(const SceneConfig& scene);

/// Eye rays: samples first .. last - 1 of the pixels of a block.
using EyeRays = std::function<GBuffer(const PixelRect& block, int first, int last)>;

struct SceneLayerChoice {
  bool surface = false;  // albedo, N, P, UV, and the layers of each pixel's first sample
  bool mattes = false;
};

/// Names in a manifest; a matte of more has none.
inline constexpr std::size_t kMostManifestNames = 10000;

/// Adds the layers to a picture that is done. seed: that of the picture.
void add_scene_layers(const ClothScene& scene, const LayerPieces& pieces, const EyeRays& eye_rays,
                      const Camera& camera, const PixelRect& crop, std::uint64_t seed,
                      const SceneLayerChoice& choice, FrameBuffers& frame);

/// Share of the light at normal incidence that a fiber scatters.
Rgb fiber_albedo(const FiberScattering& fiber);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SCENE_LAYERS_H_
