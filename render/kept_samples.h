#ifndef HEDDLE_RENDER_KEPT_SAMPLES_H_
#define HEDDLE_RENDER_KEPT_SAMPLES_H_
// All samples of a picture in compact form, for relighting: what the eye rays meet, which lights
// reach that, and the light of each group. They lie in chunks of a file (formats/chunk_file.h), one
// for every kBlockSamples samples of a block of pixels, block by block.
//
// Nothing is rounded. A fiber takes some 15 bytes. Its place along the eye ray is kept in full, the
// tetrahedron as the step from the hit before. The corners of the tetrahedron say where in the
// fabric that is, up to a few units of the last digit, and these are kept. Eye rays are drawn again
// from their random numbers, and all else follows from them. Tested in
// tests/render/precomputed_renderer_test.cpp.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/chunk_file.h"
#include "render/camera.h"
#include "render/cloth_scene.h"
#include "render/g_buffer.h"
#include "render/light_visibility.h"
#include "render/pixel_sums.h"

namespace heddle {

/// A block of kBlockEdge x kBlockEdge pixels takes this many samples at a time. 2048 samples fill a
/// G-buffer of 400 KB, and give a close-up enough samples per cell to sort.
inline constexpr int kBlockSamples = 8;

/// Chunks of a block with so many samples per pixel.
constexpr std::size_t chunks_of_block(int spp) {
  return static_cast<std::size_t>((spp - 1) / kBlockSamples) + 1;
}

/// Mark of files of kept samples, and what they are called.
inline constexpr std::string_view kKeptMark = "HEDDLEGB";
inline constexpr std::string_view kKeptKind = "G-buffer of Heddle";

/// What is kept of one light group at the samples of a chunk.
struct KeptGroup {
  LightVisibility visibility;    // without LightVisibility::direction
  std::vector<EyeSample> light;  // [sample] without background and alpha; empty: not kept
};

/// The bytes of a chunk.
std::string encode_samples(const ClothScene& scene, const GBuffer& g_buffer,
                           std::span<const KeptGroup> groups);

/// How a picture's samples are kept in a file, or taken from one.
struct SampleStore {
  ChunkFileWriter* to = nullptr;
  bool keeps_light = false;
  const ChunkFile* from = nullptr;
  /// What of a group that comes from the file is still true; each holds those before.
  enum class Use : std::uint8_t { kSights, kVisibility, kLight };
  std::vector<Use> use = {};    // [group]
  std::size_t kept_groups = 0;  // that the file has
};

/// The samples of a block from `first` on, read from a file: first what the eye rays meet, then the
/// groups in their order. Errors: FileError where it does not belong to the scene.
class KeptChunk {
 public:
  /// crop, spp: of the picture. The scene and the file outlive the object.
  KeptChunk(const ClothScene& scene, const ChunkFile& file, const PixelRect& block,
            const PixelRect& crop, int first, int spp);

  /// What the next sample's eye ray meets.
  Sight next_sight(std::uint32_t sample, const EyeRay& ray);
  /// The next group's, of the G-buffer that the sights made. Light is empty where none is kept.
  KeptGroup next_group(const GBuffer& g_buffer);

 private:
  ShellHit next_hit(const EyeRay& ray, bool of_fiber);
  [[noreturn]] void fail() const;
  std::uint8_t byte();
  std::uint64_t number();
  std::int64_t step();
  /// `value`, if it is below `count`.
  std::uint32_t index(std::uint64_t value, std::uint64_t count) const;
  template <class T>
  T raw();

  const ClothScene* scene_;
  const ChunkFile* file_;
  std::string bytes_;
  std::size_t at_ = 0;
  std::uint32_t last_part_ = 0;
  std::uint32_t last_tet_ = 0;
};

/// Bytes that samples take, about: each sees one fiber, and of no group is light 0.
/// lights: of all groups together.
std::uint64_t kept_bytes(std::uint64_t samples, std::size_t lights, std::size_t groups_with_light);

}  // namespace heddle

#endif  // HEDDLE_RENDER_KEPT_SAMPLES_H_
