#ifndef HEDDLE_RENDER_PRECOMPUTED_RENDERER_H_
#define HEDDLE_RENDER_PRECOMPUTED_RENDERER_H_
// The fast methods: deferred shading of what eye rays see, from precomputed data (Khungurn 2017,
// section 5). Three passes over blocks of pixels and samples:
//   1. g_buffer.h: cloth, segment, cell, frames and fabric position of every sample. In: scene,
//      fibers or id volumes, camera.
//   2. light_visibility.h: shadow rays past all macroscopic things. In: G-buffer, scene, lights.
//   3. fabric_shading.h, sorted by part, cell and tetrahedron. In: G-buffer, visibility, lights,
//      the fabrics' data.
// A kept G-buffer (kept_samples.h) is relit by passes 2 and 3, by pass 3 where lights change their
// brightness only, and by neither where a group of lights does not change.
//
// Coloured meshes are lit directly in pass 3, with shadows of fibers and meshes. Surface cloths are
// lit directly too, with shadows of shells and meshes: by one
// sample (surface_cloth.h), whose shadow rays depend on the model too, or from data of their own
// without noise (interactive_surface.h). A near light acts on each sample as the directional or
// Gaussian light that stands for it there (lights.h): exact shadows between folds, but parallel
// light within what surrounds the sample on the cloth. Light between different parts of the cloth
// is left out, unless the settings ask for it (fold_light.h). What is not modelled: the shell's
// bend between two fibers of one cell. Signs of multiple scattering are kept (see
// multiple_scattering.h): a dark pixel can be slightly negative. Random numbers are addressed by
// pixel of the full frame and sample, and sums run in sample order: the picture depends neither on
// threads nor on the crop. Tested in tests/render/precomputed_renderer_test.cpp.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/fabric_shading.h"
#include "render/far_form.h"
#include "render/far_shading.h"
#include "render/fold_light.h"
#include "render/g_buffer.h"
#include "render/interactive_surface.h"
#include "render/kept_samples.h"
#include "render/light_visibility.h"
#include "render/lights.h"
#include "render/methods.h"
#include "render/path_tracer.h"
#include "render/pixel_filter.h"
#include "render/pixel_sums.h"
#include "render/render_output.h"
#include "render/single_scattering.h"

namespace heddle {

struct PrecomputedSettings {
  std::uint64_t seed = 1;
  RenderMethod method = RenderMethod::kExact;  // one that traces no paths
  // Deviation of the Gaussian; the thickness of the cloth where absent.
  std::optional<double> shadow_sigma_mm;
  VisibilityBlend blend;
  // Highest band of the transfer that is used; all of them where absent.
  std::optional<int> transfer_order;
  // Repeats of a fabric in a pixel from which nothing but its far form is seen (GBufferPass); never
  // where absent, or where the method has none.
  std::optional<float> far_from;
  int bounces = 0;  // of light between folds, where the method has far forms
  // [part of the scene] of the packs' far forms; needed with either of these. One object serves
  // many renderers, and keeps what it has built.
  std::vector<std::shared_ptr<const FarForm>> far_forms;
  // [surface cloth] null, or missing at the end: sampled.
  std::vector<std::shared_ptr<const InteractiveSurface>> interactive;
  PixelFilter filter = {};
  // [part of the scene] its materials without TT (without_transmission()), where
  // EyeSample::transmitted is asked for; else empty
  std::vector<std::span<const BcsdfTable>> reflecting = {};
};

class PrecomputedRenderer {
 public:
  /// packs: [part of the scene]; the same pack may serve several. Everything passed must outlive
  /// the renderer. Errors: FileError where a pack lacks what the lights and settings need.
  PrecomputedRenderer(const ClothScene& scene, std::span<const FabricPack* const> packs,
                      std::span<const Light> lights, const Rgb& background,
                      const PrecomputedSettings& settings);
  PrecomputedRenderer(const PrecomputedRenderer&) = delete;
  PrecomputedRenderer& operator=(const PrecomputedRenderer&) = delete;

  /// The lights that it shades with, and the errors of what stands for environments.
  const FittedLights& fitted_lights() const { return fitted_; }
  bool tells_transmitted() const { return !settings_.reflecting.empty(); }

  /// Pass 1: samples first .. last - 1 of the pixels of `block`.
  GBuffer g_buffer(const Camera& camera, const PixelRect& block, int first, int last) const {
    return g_buffer_pass_.run(camera, block, first, last);
  }
  /// The same from a file, without rays.
  GBuffer g_buffer(const Camera& camera, const PixelRect& block, int first, int last,
                   KeptChunk& kept) const;
  /// Pass 2.
  LightVisibility light_visibility(const GBuffer& g_buffer) const {
    return visibility_pass_.run(g_buffer);
  }
  /// Of equal lights for this pass, equal texts; nothing where it may not be kept, since it draws
  /// directions too.
  std::optional<std::string> visibility_text() const;
  /// Pass 3: [sample of the G-buffer].
  std::vector<EyeSample> shade(const GBuffer& g_buffer, const LightVisibility& visibility) const;
  /// The samples without any light but the background.
  std::vector<EyeSample> unlit(const GBuffer& g_buffer) const;

  const ClothScene& scene() const { return *scene_; }

 private:
  std::vector<std::shared_ptr<const FabricShading>> make_shadings() const;
  void shade_far(const GBuffer& g_buffer, const LightVisibility& visibility,
                 std::span<EyeSample> seen) const;
  /// One draw of the light that other cloth sends to a sample; nothing where it is not asked for.
  std::optional<SeenLight> fold_light(const GBuffer& g_buffer, std::uint32_t sample,
                                      const ShellHit& hit) const;
  void tint_yarns(const GBuffer& g_buffer, std::span<EyeSample> seen) const;
  Rgb surface_light(const SeenSurface& surface, RandomStream& random) const;

  const ClothScene* scene_;
  std::span<const Light> scene_lights_;  // what sampled surface cloth is lit by
  FittedLights fitted_;
  // what all else is lit by: environments as Gaussians, rectangles in parts
  std::span<const Light> lights_;
  Rgb background_;
  PrecomputedSettings settings_;
  std::vector<const FabricPack*> packs_;                // [part of the scene]
  std::vector<MultipleScattering::LightShape> shapes_;  // [light]
  LightShapes near_shapes_;
  std::vector<std::shared_ptr<const FabricShading>> shadings_;  // [part of the scene]
  // [part of the scene] own_yarn_scatterings(), where yarns have tints
  std::vector<std::optional<Rgb>> own_scatterings_;
  GBufferPass g_buffer_pass_;
  LightVisibilityPass visibility_pass_;
  FarShading far_shading_;
  FoldLight fold_light_;
};

/// Blocks of pixels between two calls of the progress callback. What is kept of their samples waits
/// in memory meanwhile.
inline constexpr int kBlocksPerReport = 64;

/// Beauty, single, multiple, alpha, G-buffer of the first sample. With 2 samples or more also half0
/// (even samples), half1 (odd samples) and the variance of the pixel's mean. `more` needs these.
FrameBuffers shade_picture(const PrecomputedRenderer& renderer, const Camera& camera,
                           const PixelRect& crop, int spp, const RenderProgress& progress,
                           const MoreSamples& more = {});

/// The same with the light of each renderer kept apart: renderers of one scene, each with lights
/// and a seed of its own. The first one looks through the pixels, and only it has a background.
/// Order: that of FrameBuffers::light_groups, whose names are left empty. store: not with `more`. A
/// group whose light comes from there needs no lights. Errors: FileError of the store's file.
FrameBuffers shade_picture(std::span<const PrecomputedRenderer* const> by_group,
                           const Camera& camera, const PixelRect& crop, int spp,
                           const RenderProgress& progress, const MoreSamples& more = {},
                           const SampleStore& store = {});

}  // namespace heddle

#endif  // HEDDLE_RENDER_PRECOMPUTED_RENDERER_H_
