#include "formats/image_file.h"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTestFile.h>
#include <fmt/format.h>
#include <half.h>
#include <png.h>

#include <algorithm>
#include <cassert>
#include <span>

#include "formats/atomic_file.h"
#include "formats/input_error.h"

namespace heddle {

namespace {

constexpr int kMaxExtent = 16384;
constexpr std::size_t kMaxChannels = 1024;
constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << 30;  // over all channels: 4 GiB of memory
constexpr std::uint64_t kMaxDeflateRatio = 1400;               // 1032 : 1, times 4/3 where PXR24 drops a byte

Imf::PixelType pixel_type(ChannelType type) {
  switch (type) {
    case ChannelType::kHalf:
      return Imf::HALF;
    case ChannelType::kFloat:
      return Imf::FLOAT;
    default:
      return Imf::UINT;
  }
}

/// Methods whose output is at most kMaxDeflateRatio times as long as their input.
bool is_deflate_like(Imf::Compression compression) {
  return compression == Imf::NO_COMPRESSION || compression == Imf::RLE_COMPRESSION ||
         compression == Imf::ZIPS_COMPRESSION || compression == Imf::ZIP_COMPRESSION ||
         compression == Imf::PXR24_COMPRESSION;
}

template <class T>
Imf::Slice slice_of(Imf::PixelType type, const T* values, const Imath::Box2i& window, int width) {
  return Imf::Slice::Make(type, values, window, sizeof(T), sizeof(T) * static_cast<std::size_t>(width));
}

/// OpenEXR writes into a file under construction, whose errors reach the caller even where the library swallows them.
class OutputStream : public Imf::OStream {
 public:
  OutputStream(const std::string& name, AtomicFile& file) : Imf::OStream(name.c_str()), file_(&file) {}
  void write(const char bytes[], int count) override {
    file_->write(std::as_bytes(std::span(bytes, static_cast<std::size_t>(count))));
  }
  std::uint64_t tellp() override { return file_->position(); }
  void seekp(std::uint64_t position) override { file_->seek(position); }

 private:
  AtomicFile* file_;
};

void write_exr_to(Imf::OStream& stream, const Image& image) {
  const Imath::Box2i window({0, 0}, {image.width - 1, image.height - 1});
  Imf::Header header(window, window);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());  // the default is Rec. 709 with white point D65
  for (const auto& [key, text] : image.metadata) header.insert(key, Imf::StringAttribute(text));

  Imf::FrameBuffer pixels;
  std::vector<std::vector<Imath::half>> halves;
  halves.reserve(image.channels.size());
  for (const auto& [name, channel] : image.channels) {
    const Imf::PixelType type = pixel_type(channel.type);
    header.channels().insert(name, Imf::Channel(type));
    if (channel.type == ChannelType::kHalf) {
      std::vector<Imath::half>& rounded = halves.emplace_back();
      rounded.reserve(channel.values.size());
      for (const float value : channel.values) rounded.emplace_back(std::clamp(value, -65504.0f, 65504.0f));
      pixels.insert(name, slice_of(type, rounded.data(), window, image.width));
    } else if (channel.type == ChannelType::kFloat) {
      pixels.insert(name, slice_of(type, channel.values.data(), window, image.width));
    } else {
      pixels.insert(name, slice_of(type, channel.ids.data(), window, image.width));
    }
  }
  Imf::OutputFile file(stream, header);
  file.setFrameBuffer(pixels);
  file.writePixels(image.height);
}

Image read_exr_from(const std::filesystem::path& path) {
  const auto fail = [](const std::string& reason) { throw FileError(reason); };
  bool tiled = false;
  bool deep = false;
  bool multi_part = false;
  if (!Imf::isOpenExrFile(path.c_str(), tiled, deep, multi_part)) fail("no OpenEXR file");
  if (deep || multi_part) fail("deep and multi-part files are not supported");
  Imf::Header::setMaxImageSize(kMaxExtent,
                               kMaxExtent);  // checked before the library allocates its line table
  Imf::Header::setMaxTileSize(kMaxExtent, kMaxExtent);

  Imf::InputFile file(path.c_str());
  const Imf::Header& header = file.header();
  const Imath::Box2i window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1 || width > kMaxExtent || height > kMaxExtent) {
    fail(fmt::format("{} x {} pixels (at most {} x {})", width, height, kMaxExtent, kMaxExtent));
  }
  std::uint64_t channels = 0;
  std::uint64_t bytes_per_pixel = 0;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
      fail(fmt::format("channel {} is subsampled", it.name()));
    }
    ++channels;
    bytes_per_pixel += it.channel().type == Imf::HALF ? 2 : 4;
  }
  const std::uint64_t pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  if (channels == 0 || channels > kMaxChannels)
    fail(fmt::format("{} channels (1 to {})", channels, kMaxChannels));
  if (pixels * channels > kMaxSamples)
    fail(fmt::format("{} values (at most {})", pixels * channels, kMaxSamples));
  if (is_deflate_like(header.compression()) &&
      pixels * bytes_per_pixel / kMaxDeflateRatio > std::filesystem::file_size(path)) {
    fail("too short for its size in pixels");
  }
  if (!file.isComplete()) fail("incomplete");

  Image image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  Imf::FrameBuffer buffer;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    ImageChannel& channel = image.channels[it.name()];
    if (it.channel().type == Imf::UINT) {
      channel.type = ChannelType::kUint;
      channel.ids.resize(pixels);
      buffer.insert(it.name(), slice_of(Imf::UINT, channel.ids.data(), window, image.width));
    } else {
      channel.type = it.channel().type == Imf::HALF ? ChannelType::kHalf : ChannelType::kFloat;
      channel.values.resize(pixels);
      buffer.insert(it.name(), slice_of(Imf::FLOAT, channel.values.data(), window, image.width));
    }
  }
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  for (auto it = header.begin(); it != header.end(); ++it) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute())) {
      image.metadata[it.name()] = text->value();
    }
  }
  return image;
}

}  // namespace

void write_exr(const std::filesystem::path& path, const Image& image) {
  assert(image.width > 0 && image.height > 0 && !image.channels.empty());
  for ([[maybe_unused]] const auto& [name, channel] : image.channels) {
    assert((channel.type == ChannelType::kUint ? channel.ids.size() : channel.values.size()) ==
           static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  }
  AtomicFile file(path);
  OutputStream stream(path.string(), file);
  try {
    write_exr_to(stream, image);
  } catch (const std::exception& error) {
    file.check();
    throw FileError(fmt::format("{}: cannot write: {}", path.string(), error.what()));
  }
  file.commit();
}

Image read_exr(const std::filesystem::path& path) {
  try {
    return read_exr_from(path);
  } catch (const std::exception& error) {
    throw FileError(fmt::format("{}: cannot read as an OpenEXR image: {}", path.string(), error.what()));
  }
}

void write_png(const std::filesystem::path& path, int width, int height,
               const std::vector<std::uint8_t>& rgb) {
  assert(width > 0 && height > 0);
  assert(rgb.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  // This interface of libpng keeps its long jumps inside and returns 0 on an error.
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0) {
    throw FileError(fmt::format("{}: cannot write: {}", path.string(), image.message));
  }
  write_file_atomically(path, std::span<const std::byte>(bytes).first(size));
}

}  // namespace heddle
