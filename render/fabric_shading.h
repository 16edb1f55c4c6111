#ifndef HEDDLE_RENDER_FABRIC_SHADING_H_
#define HEDDLE_RENDER_FABRIC_SHADING_H_
// Third pass of the precomputed methods: light that leaves the fibers of one fabric towards the
// eye, from a G-buffer and the visibility of its lights. TransferShading serves every method that
// takes multiple scattering from the pack's transfer: ours and the rivals differ in their
// SingleScatteringModel. Which method is made of what: render/methods.cpp. Tested in
// tests/render/precomputed_renderer_test.cpp.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "fibers/baked/fabric_pack.h"
#include "fibers/tracing/tile_scene.h"
#include "render/cloth_scene.h"
#include "render/g_buffer.h"
#include "render/light_visibility.h"
#include "render/lights.h"
#include "render/multiple_scattering.h"
#include "render/pixel_sums.h"
#include "render/rivals/dual_scattering.h"
#include "render/single_scattering.h"

namespace heddle {

/// What a shading is made from. All that is pointed to outlives it.
struct ShadingInputs {
  const ClothScene* scene;
  const TileScene* tile;  // of the fabric
  const FabricPack* pack;
  std::span<const Light> lights;                           // no environments
  std::span<const MultipleScattering::LightShape> shapes;  // [light] of those at infinity
  const LightShapes* near_shapes;
  VisibilityBlend blend;
  // Highest band of the transfer that is used; all of them where empty.
  std::optional<int> transfer_order;
  // The pack's materials without TT, where EyeSample::transmitted is asked for; else empty.
  std::span<const BcsdfTable> reflecting = {};
};

class FabricShading {
 public:
  virtual ~FabricShading() = default;
  /// Adds the light of some samples to what eye rays see. fibers: places in g_buffer.fibers, all on
  /// one part of the fabric, those of one cell and tetrahedron side by side. seen: [sample].
  virtual void shade(const GBuffer& g_buffer, const LightVisibility& visibility,
                     std::span<const std::uint32_t> fibers, std::span<EyeSample> seen) const = 0;
  /// Radiance from a fiber under one more light at infinity, which reaches it; 0 where the method
  /// knows no such light.
  virtual Rgb under(const SeenFiber&, const SeenLight&) const { return Rgb::Zero(); }
};

/// Single scattering by a model, multiple scattering by the pack's transfer. Incoming fields of all
/// lights are summed before they are turned and scattered. Those of lights at infinity are kept
/// while cell and light direction stay the same; near lights are summed before the transfer.
class TransferShading final : public FabricShading {
 public:
  /// reflecting: the same model of fibers without TT, where EyeSample::transmitted is asked for.
  TransferShading(const ShadingInputs& inputs, std::unique_ptr<const SingleScatteringModel> single,
                  std::unique_ptr<const SingleScatteringModel> reflecting = {});
  void shade(const GBuffer& g_buffer, const LightVisibility& visibility,
             std::span<const std::uint32_t> fibers, std::span<EyeSample> seen) const override;
  Rgb under(const SeenFiber& fiber, const SeenLight& light) const override;

 private:
  const ClothScene* scene_;
  std::span<const Light> lights_;
  std::span<const MultipleScattering::LightShape> shapes_;
  const LightShapes* near_shapes_;
  std::unique_ptr<const SingleScatteringModel> single_;
  std::unique_ptr<const SingleScatteringModel> reflecting_;  // may be null
  std::unique_ptr<const Transfer> cut_transfer_;             // in place of the pack's
  const Transfer* transfer_;
  MultipleScattering multiple_;
};

/// Dual scattering: single and multiple. A light's share comes from LightVisibility::direction.
class DualScatteringShading final : public FabricShading {
 public:
  explicit DualScatteringShading(const ShadingInputs& inputs);
  void shade(const GBuffer& g_buffer, const LightVisibility& visibility,
             std::span<const std::uint32_t> fibers, std::span<EyeSample> seen) const override;

 private:
  DualScattering::Parts scattered(const SeenFiber& fiber, const Vec3& direction) const;

  const ClothScene* scene_;
  const FabricPack* pack_;
  std::span<const Light> lights_;
  DualScattering dual_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_FABRIC_SHADING_H_
