#ifndef HEDDLE_RENDER_PRECOMPUTED_RENDERER_H_
#define HEDDLE_RENDER_PRECOMPUTED_RENDERER_H_
// The fast methods: a deferred pass that shades what eye rays see from precomputed data (Khungurn
// 2017, section 5). Per block of pixels and samples:
//   1. G-buffer: cloth, segment, cell, frames and fabric position of every sample, by rays against
//      the fibers or through the id volume;
//   2. light visibility: a shadow ray against the shells and the meshes from the shell's surface
//      straight above the hit (below it where the light is under the cloth), for single scattering;
//      another from a point moved along the cloth by a 2D Gaussian, whose mean is the smoothed
//      visibility of multiple scattering. For a spherical Gaussian the ray goes in a direction
//      drawn from the light (the mean is a soft shadow); where the fabric takes light from its face
//      only, from that part of the light that lies on the face's side, since the precomputed data
//      hold no other light;
//   3. shading, sorted by cell and tetrahedron: single_scattering.h, multiple_scattering.h, or a
//      rival of theirs. Incoming fields of all lights are summed before they are turned and
//      scattered, and are kept while cell and light direction stay the same.
// Surface cloths are lit directly, at once, with shadows of the same shells and meshes: by one
// sample (surface_cloth.h), or from data of their own without noise (interactive_surface.h). What
// is not modelled: light between different parts of the cloth, and the shell's bend between two
// fibers of one cell. Signs of multiple scattering are kept (see multiple_scattering.h): a dark
// pixel can be slightly negative. Eye rays are those of the path tracer with the same seed. Random
// numbers are addressed by pixel of the full frame and sample, and sums run in sample order: the
// picture depends neither on threads nor on the crop. Tested in
// tests/render/precomputed_renderer_test.cpp.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "fibers/baked/id_bricks.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/interactive_surface.h"
#include "render/lights.h"
#include "render/multiple_scattering.h"
#include "render/path_tracer.h"
#include "render/pixel_sums.h"
#include "render/render_output.h"
#include "render/rivals/dual_scattering.h"
#include "render/single_scattering.h"

namespace heddle {

/// Who shades what an eye ray sees. All but dual scattering take multiple scattering from the
/// pack's transfer.
enum class LocalShading : std::uint8_t {
  kShipped,         // single_scattering.h, multiple_scattering.h
  kPrinted,         // the same with Gamma and the projection of light as Khungurn 2017 prints them
  kPrt,             // rivals/prt_scattering.h
  kTsaiShih16,      // rivals/tsai_shih_scattering.h, 16 terms
  kTsaiShihFull,    // the same, all terms
  kDualScattering,  // rivals/dual_scattering.h, single and multiple
};

struct PrecomputedSettings {
  std::uint64_t seed = 1;
  LocalShading shading = LocalShading::kShipped;
  bool volume = false;  // eye rays through the packs' id volumes instead of against fibers
  // Deviation of the Gaussian; the thickness of the cloth where absent.
  std::optional<double> shadow_sigma_mm;
  VisibilityBlend blend;
  // Highest band of the transfer that is used; all of them where absent.
  std::optional<int> transfer_order;
  // [surface cloth] null, or missing at the end: sampled.
  std::vector<std::shared_ptr<const InteractiveSurface>> interactive;
};

class PrecomputedRenderer {
 public:
  /// packs: [cloth of fibers]; the same pack may serve several. Everything passed must outlive the
  /// renderer. Errors: FileError where a pack lacks what the lights and settings need.
  PrecomputedRenderer(const ClothScene& scene, std::span<const FabricPack* const> packs,
                      std::span<const Light> lights, const Rgb& background,
                      const PrecomputedSettings& settings);

  /// Of the Gaussians that stand for environments; 0 without environments.
  double environment_error() const { return fitted_.relative_error; }

  using Sample = EyeSample;
  /// What the first sample of a pixel sees; empty where that is no cloth.
  struct Seen {
    static constexpr std::uint32_t kNone = 0xffffffffU;
    std::uint32_t segment;  // kNone on a surface cloth
    std::uint32_t cell;     // kNone on a surface cloth
    Vec3d world;
    Vec3d fabric;
    Vec3 tangent;
  };

  /// Samples first .. last - 1 of the pixels of `block`: samples [pixel][sample], pixels row by
  /// row. Where first is 0, `seen` [pixel] is filled from sample 0.
  void shade(const Camera& camera, const PixelRect& block, int first, int last,
             std::vector<Sample>& samples, std::vector<std::optional<Seen>>& seen) const;

 private:
  struct Cloth {
    const FabricPack* pack;
    std::shared_ptr<const IdBricks> bricks;
    std::shared_ptr<const SingleScatteringModel> single;
    std::shared_ptr<const Transfer> cut_transfer;  // in place of the pack's
    std::optional<MultipleScattering> multiple;
    std::shared_ptr<const DualScattering> dual;  // then neither single nor multiple
    double shadow_sigma;                         // mm
  };
  /// Is the light visible past all macroscopic things, at the point and at the point moved along
  /// the cloth?
  struct GlobalVisibility {
    bool at_point = false;
    bool nearby = false;
  };

  /// A light's share of a sample by dual scattering; a Gaussian's in a direction drawn from it.
  DualScattering::Parts dual_scattered(const ShellHit& hit, const ShadingPoint& point,
                                       const Light& light, RandomStream& random) const;

  std::optional<ShellHit> eye_hit(const SceneRay& ray) const;
  Rgb surface_light(const SurfaceHit& hit, std::uint32_t surface, const Vec3& wo,
                    RandomStream& random) const;
  GlobalVisibility global_visibility(const ShellHit& hit, const Light& light,
                                     RandomStream& random) const;

  const ClothScene* scene_;
  std::span<const Light> scene_lights_;  // what sampled surface cloth is lit by
  FittedLights fitted_;
  std::span<const Light> lights_;  // what all else is lit by: environments as Gaussians
  std::vector<MultipleScattering::LightShape> shapes_;  // [light]
  Rgb background_;
  PrecomputedSettings settings_;
  std::vector<Cloth> cloths_;
};

/// Beauty, single, multiple, alpha, G-buffer of the first sample; with 2 samples or more also half0
/// (even samples), half1 (odd samples) and the variance of the pixel's mean; `more` may be given
/// with those only.
FrameBuffers shade_picture(const PrecomputedRenderer& renderer, const Camera& camera,
                           const PixelRect& crop, int spp, const RenderProgress& progress,
                           const MoreSamples& more = {});

}  // namespace heddle

#endif  // HEDDLE_RENDER_PRECOMPUTED_RENDERER_H_
