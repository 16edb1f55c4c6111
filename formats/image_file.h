#ifndef HEDDLE_FORMATS_IMAGE_FILE_H_
#define HEDDLE_FORMATS_IMAGE_FILE_H_
// Multi-channel images: OpenEXR (scan lines, ZIP) with named channels and string metadata, and
// PNG. Row-major, row 0 at the top. Equal content gives equal bytes (no time stamps). Errors:
// FileError. Tested in tests/formats/image_file_test.cpp.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace heddle {

enum class ChannelType : std::uint8_t { kHalf, kFloat, kUint };

struct ImageChannel {
  ChannelType type = ChannelType::kHalf;
  std::vector<float> values;       // [height * width] for kHalf and kFloat
  std::vector<std::uint32_t> ids;  // [height * width] for kUint
};

struct Image {
  int width = 0;
  int height = 0;
  // "R", "single.R", "segment", ... ; layers are named LAYER.CHANNEL
  std::map<std::string, ImageChannel> channels;
  std::map<std::string, std::string> metadata;  // string attributes
  // The frame that the image is a part of, and where in it its upper left pixel lies: OpenEXR's
  // display window, with its corner as origin. Without a width: the image is all of it.
  struct Frame {
    int x0 = 0;
    int y0 = 0;
    int width = 0;
    int height = 0;
  };
  Frame frame = {};
};

/// Pixels along an edge; pictures that are larger are refused.
inline constexpr int kMaxExtent = 16384;

/// Writes atomically. Half channels are clamped to the largest finite half (65504).
void write_exr(const std::filesystem::path& path, const Image& image);
/// Reads flat scan-line or tiled single-part files up to kMaxExtent x kMaxExtent and 1024 channels;
/// refuses deep and multi-part.
Image read_exr(const std::filesystem::path& path);

/// What the first bytes of a PNG file say.
struct PngHeader {
  int width = 0;
  int height = 0;
  int channels = 0;  // 1 grey, 2 grey and alpha, 3 RGB (or a palette), 4 RGB and alpha
};
PngHeader read_png_header(const std::filesystem::path& path);

/// 8-bit pixels as shown on a screen.
struct RgbPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  // [height][width][3]
};
/// Any kind of PNG; transparency lies on white. At most `max_extent` pixels along an edge.
RgbPicture read_png(const std::filesystem::path& path, int max_extent);
/// The same for the bytes of a file; `name` stands for it in messages.
RgbPicture parse_png(std::span<const std::byte> bytes, const std::string& name, int max_extent);

/// [height][width][3] bytes, or 4 with an alpha that colours are not multiplied by; written
/// atomically. text: keywords (1 to 79 Latin-1 characters) and what they say, as tEXt chunks.
void write_png(const std::filesystem::path& path, int width, int height,
               const std::vector<std::uint8_t>& rgb,
               const std::map<std::string, std::string>& text = {});
/// Numbers and not colours, without any chunk about colour: [height][width] of 8 bits, or
/// [height][width][3]; or [height][width] of 16 bits. Written atomically.
void write_data_png(const std::filesystem::path& path, int width, int height,
                    const std::vector<std::uint8_t>& samples);
void write_data_png(const std::filesystem::path& path, int width, int height,
                    const std::vector<std::uint16_t>& grey);
/// What the tEXt chunks of a PNG file say, by keyword. Their checksums hold.
std::map<std::string, std::string> read_png_text(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_IMAGE_FILE_H_
