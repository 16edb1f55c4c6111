#ifndef HEDDLE_RENDER_RENDER_OUTPUT_H_
#define HEDDLE_RENDER_RENDER_OUTPUT_H_
// The buffers of a picture and their form as image layers, row-major, row 0 at the top. What each
// layer holds, and its unit: channel_note() and docs/layers.md.
//
// Where light groups or lobes are kept, sums of layers hold in half precision (layer_sums.h):
//   R = background + sum of C_NAME = background + single + multiple,  single = reflected +
//   transmitted
// Tested in tests/render/render_output_test.cpp.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "formats/cryptomatte.h"
#include "formats/image_file.h"

namespace heddle {

/// Light from some of the lights.
struct LightGroupLayer {
  std::string name;
  std::vector<Rgb> light;  // [pixel] single + multiple
};

struct FrameBuffers {
  FrameBuffers() = default;
  FrameBuffers(int width_px, int height_px)
      : width(width_px),
        height(height_px),
        beauty(pixel_count(), Rgb::Zero()),
        single(pixel_count(), Rgb::Zero()),
        multiple(pixel_count(), Rgb::Zero()),
        alpha(pixel_count(), 0.0F) {}

  int width = 0;
  int height = 0;
  int spp = 0;
  std::vector<Rgb> beauty;    // [pixel] single + multiple + background
  std::vector<Rgb> single;    // [pixel]
  std::vector<Rgb> multiple;  // [pixel]
  std::vector<float> alpha;   // [pixel] share of eye rays that meet cloth or a mesh

  // Where they are asked for, else empty.
  std::vector<LightGroupLayer> light_groups;
  std::vector<Rgb> transmitted;  // [pixel] part of single that came through the fiber (TT)
  std::vector<Rgb> background;   // [pixel] part of beauty; with either of these two

  // With 2 samples per pixel or more, else empty.
  std::vector<Rgb> half0;     // [pixel] beauty of the even samples
  std::vector<Rgb> half1;     // [pixel] beauty of the odd samples
  std::vector<Rgb> variance;  // [pixel] of the mean in `beauty`, estimated

  // [pixel] samples, where pixels have different numbers of them; spp is then the largest.
  std::vector<int> samples;

  // Precomputed methods, and where layers of the scene are asked for; else empty: what the first
  // sample of each pixel sees.
  std::vector<std::uint32_t> segment;  // [pixel]
  std::vector<std::uint32_t> cell;     // [pixel]
  std::vector<Vec3> fabric_position;   // [pixel] mm
  std::vector<float> depth;            // [pixel] mm
  std::vector<Vec3> tangent;           // [pixel]

  // Where layers of the scene are asked for (scene_layers.h), else empty.
  std::vector<Vec3> position;  // [pixel] of the first sample, world, mm
  std::vector<Vec2> uv;        // [pixel] of the first sample
  std::vector<Rgb> albedo;     // [pixel] mean over the samples
  std::vector<Vec3> normal;    // [pixel] mean over the samples, towards the eye
  std::vector<Cryptomatte> mattes;

  /// Makes room for light groups and parts; one group keeps none.
  void keep_parts(std::size_t groups, bool with_transmitted);
  int samples_of(std::size_t pixel) const { return samples.empty() ? spp : samples[pixel]; }
  std::size_t pixel_count() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

/// Asked with the picture so far, once the requested samples are done. Returns how many more per
/// pixel (even numbers if paths are traced): one number for all, or one for each block of
/// kBlockEdge x kBlockEdge pixels, row by row. Nothing but 0 ends the picture. A pixel's result is
/// the same as if all its samples had been asked for at once.
using MoreSamples = std::function<std::vector<int>(const FrameBuffers&)>;
inline constexpr int kBlockEdge = 16;

/// Place of a pixel's block among those of a picture.
std::size_t block_of_pixel(int x, int y, int width_px);

/// Adds what MoreSamples returned to the samples wanted of each pixel. Returns whether anything is
/// wanted.
bool add_samples(const std::vector<int>& more, const FrameBuffers& frame, std::vector<int>& wanted);

/// After the samples of each pixel are done.
void set_samples(const std::vector<int>& done, FrameBuffers& frame);

/// What a picture keeps beside its beauty.
struct KeptLayers {
  bool of_fibers = false;  // of the first sample
  std::size_t light_groups = 1;
  bool transmitted = false;
  bool of_scene = false;  // albedo, N, P, UV
  bool mattes = false;
};

/// Bytes of memory that a picture takes at its peak. That is the frame, with either the sums of its
/// pixels or the image that is written, whichever is more.
std::uint64_t picture_bytes(int width_px, int height_px, int spp, const KeptLayers& kept);

Image image_of(const FrameBuffers& frame, const std::map<std::string, std::string>& metadata);

/// What a channel holds and in which unit, for people: "radiance of all light, linear Rec. 709";
/// empty for channels that are not ours.
std::string channel_note(const std::string& channel);

/// The colours of a layer ("" = beauty, "half0", ...) back from an image. Errors: FileError where a
/// channel is missing; `name` is the file named in the message.
std::vector<Rgb> layer_of(const Image& image, const std::string& layer, const std::string& name);

}  // namespace heddle

#endif  // HEDDLE_RENDER_RENDER_OUTPUT_H_
