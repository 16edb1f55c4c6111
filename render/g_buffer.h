#ifndef HEDDLE_RENDER_G_BUFFER_H_
#define HEDDLE_RENDER_G_BUFFER_H_
// First pass of the precomputed methods: what the eye rays of a block of pixels see. It knows no
// light, so one G-buffer serves any lighting of the same view. Eye rays are those of the path
// tracer with the same seed. Tested in tests/render/precomputed_renderer_test.cpp.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "fibers/baked/id_bricks.h"
#include "fibers/math/random.h"
#include "fibers/math/vector.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/pixel_filter.h"
#include "render/render_output.h"
#include "render/single_scattering.h"
#include "render/surface_cloth.h"

namespace heddle {

/// Segment or cell of what is no fiber.
inline constexpr std::uint32_t kNoSegment = 0xffffffffU;

/// A sample that sees fibers.
struct SeenFiber {
  std::uint32_t sample;  // which of the block's
  ShellHit hit;
  ShadingPoint point;
  float weight = 1;  // share of the sample
};

/// A sample that sees a fabric's far form, in the mean over many fibers.
struct SeenFar {
  std::uint32_t sample;  // which of the block's
  ShellHit hit;          // at the mean height of the fibers seen; of no segment
  Vec3 wo;               // fabric space
  float weight;          // share of the sample
};

/// A sample that sees cloth without fibers.
struct SeenSurface {
  std::uint32_t sample;  // which of the block's
  MeshHit met;           // MeshHit::mesh: of ClothScene::surfaces()
  SurfaceHit hit;
  Vec3 wo;           // world
  float weight = 1;  // share of the sample
};

/// A sample that sees a black mesh.
struct SeenMesh {
  std::uint32_t sample;  // which of the block's
  std::uint32_t mesh;    // as MeshHit::mesh, less ClothScene::surfaces()
  double t;              // mm along the eye ray
  Vec3d position;        // world, mm
  float weight = 1;      // share of the sample
};

/// What one eye ray meets, as far as rays had to look for it: the rest follows from the eye ray.
struct Sight {
  std::vector<SeenFar> far;       // in the order of the ray
  float left = 1;                 // share of the sample that goes on past them
  std::optional<ShellHit> fiber;  // what that meets: a fiber
  std::optional<MeshHit> mesh;    // or else a mesh
};

/// Samples first .. last - 1 of every pixel of `block`: sample k is number first + k % per_pixel()
/// of pixel k / per_pixel(), pixels row by row.
struct GBuffer {
  PixelRect block;
  int first = 0;
  int last = 0;
  std::uint64_t frame_width = 0;  // px, of the whole picture
  // [sample] share that meets cloth or a mesh
  std::vector<float> covered;
  // In the order of their samples.
  std::vector<SeenFiber> fibers;
  std::vector<SeenFar> far;
  std::vector<SeenSurface> surfaces;
  std::vector<SeenMesh> meshes;

  int per_pixel() const { return last - first; }
  std::uint32_t sample_count() const {
    return static_cast<std::uint32_t>(block.width * block.height * per_pixel());
  }
  /// Random numbers of one sample, stratified over the samples of its pixel. They are addressed by
  /// the pixel of the whole picture, so they depend neither on the crop nor on the block.
  RandomStream random(std::uint64_t seed, RandomStage stage, std::uint32_t sample) const;
};

/// A picture of a crop in blocks of kBlockEdge x kBlockEdge pixels, row by row; those at the right
/// and below may be smaller.
struct PictureBlocks {
  PixelRect crop;

  int columns() const { return (crop.width + kBlockEdge - 1) / kBlockEdge; }
  int count() const { return columns() * ((crop.height + kBlockEdge - 1) / kBlockEdge); }
  PixelRect at(int index) const {
    const int left = index % columns() * kBlockEdge;  // within the crop
    const int top = index / columns() * kBlockEdge;
    return {crop.x0 + left, crop.y0 + top, std::min(kBlockEdge, crop.width - left),
            std::min(kBlockEdge, crop.height - top)};
  }
};

/// Where pixel `pixel` of a block, row by row, lies in a picture of the crop.
std::size_t place_in_picture(const PixelRect& block, const PixelRect& crop, int pixel);

class FarWay;

class GBufferPass {
 public:
  /// packs: [part of the scene]. bricks: the same, or empty: eye rays then look for the fibers
  /// themselves. far_from: pixels that cover so many repeats of a fabric see nothing but its far
  /// form, those of less than half as many nothing of it; no pixel does where empty. The scene and
  /// the packs outlive the object.
  GBufferPass(const ClothScene& scene, std::vector<const FabricPack*> packs,
              std::vector<std::shared_ptr<const IdBricks>> bricks, std::optional<float> far_from,
              std::uint64_t seed, PixelFilter filter = {});

  GBuffer run(const Camera& camera, const PixelRect& block, int first, int last) const;
  /// The same from what eye rays are known to meet: asked for sample by sample, in order. No ray
  /// is traced.
  using Sights = std::function<Sight(std::uint32_t sample, const EyeRay& ray)>;
  GBuffer restore(const Camera& camera, const PixelRect& block, int first, int last,
                  const Sights& sights) const;

 private:
  std::optional<ShellHit> first_fiber(const SceneRay& ray, FarWay& way) const;
  Sight look(const EyeRay& ray, std::uint32_t sample, float far_draw) const;
  void add(const EyeRay& ray, std::uint32_t sample, Sight&& sight, GBuffer& g_buffer) const;
  /// `see`: Sight(sample, eye ray, draw between fibers and far form)
  template <class See>
  GBuffer fill(const Camera& camera, const PixelRect& block, int first, int last, See&& see) const;

  const ClothScene* scene_;
  std::vector<const FabricPack*> packs_;
  std::vector<std::shared_ptr<const IdBricks>> bricks_;
  std::optional<float> far_from_;
  std::uint64_t seed_;
  PixelFilter filter_;
};

/// Makes room for the layers of each pixel's first sample.
void keep_first_samples(FrameBuffers& frame);
/// Writes them for the pixels of the G-buffer, whose samples begin with the first one.
void store_first_samples(const ClothScene& scene, const GBuffer& g_buffer, const Camera& camera,
                         const PixelRect& crop, FrameBuffers& frame);

}  // namespace heddle

#endif  // HEDDLE_RENDER_G_BUFFER_H_
