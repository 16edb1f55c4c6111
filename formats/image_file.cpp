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
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfTestFile.h>
#include <ImfTileDescription.h>
#include <ImfXdr.h>
#include <fmt/format.h>
#include <half.h>
#include <png.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <fstream>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"

namespace heddle {

namespace {

constexpr std::size_t kMaxChannels = 1024;
constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << 30;  // over all channels: 4 GiB of memory
// rows that are decoded before memory for more is used
constexpr int kRowsAtOnce = 64;

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

struct CompressionBound {
  int rows;             // of a chunk of scan lines
  std::uint64_t ratio;  // bytes of pixels that one byte of a chunk can stand for, at most
};

/// Ratios follow from each method's coding; black images reach them (formats/README.md).
CompressionBound bound_of(Imf::Compression compression) {
  constexpr std::uint64_t kDeflate = 1032;
  switch (compression) {
    case Imf::NO_COMPRESSION:
      return {1, 1};
    case Imf::RLE_COMPRESSION:
      return {1, 64};  // runs of 128 bytes in 2
    case Imf::ZIPS_COMPRESSION:
      return {1, kDeflate};
    case Imf::ZIP_COMPRESSION:
      return {16, kDeflate};
    case Imf::PXR24_COMPRESSION:
      return {16, kDeflate * 4 / 3};  // leaves one byte of four out
    case Imf::PIZ_COMPRESSION:
      return {32, 410};  // Huffman codes of 10 bits for 256 values of 2 bytes
    case Imf::B44_COMPRESSION:
    case Imf::B44A_COMPRESSION:
      return {32, 11};  // 4 x 4 values of 2 bytes in 3
    case Imf::DWAA_COMPRESSION:
      // 8 x 8 values of 4 bytes are 4 bytes before deflation; runs as in RLE
      return {32, 64 * kDeflate};
    case Imf::DWAB_COMPRESSION:
      return {256, 64 * kDeflate};
    default:
      throw FileError("an unknown compression");
  }
}

template <class T>
Imf::Slice slice_of(Imf::PixelType type, const T* values, const Imath::Box2i& window, int width) {
  return Imf::Slice::Make(type, values, window, sizeof(T),
                          sizeof(T) * static_cast<std::size_t>(width));
}

/// OpenEXR writes into a file under construction. Its errors reach the caller even if the library
/// swallows them.
class OutputStream : public Imf::OStream {
 public:
  OutputStream(const std::string& name, AtomicFile& file)
      : Imf::OStream(name.c_str()), file_(&file) {}
  void write(const char bytes[], int count) override {
    file_->write(std::as_bytes(std::span(bytes, static_cast<std::size_t>(count))));
  }
  std::uint64_t tellp() override { return file_->position(); }
  void seekp(std::uint64_t position) override { file_->seek(position); }

 private:
  AtomicFile* file_;
};

void write_exr_to(Imf::OStream& stream, const Image& image) {
  const Image::Frame& frame = image.frame;
  const Imath::Box2i window({frame.x0, frame.y0},
                            {frame.x0 + image.width - 1, frame.y0 + image.height - 1});
  const bool is_part = frame.width > 0;
  Imf::Header header(is_part ? Imath::Box2i({0, 0}, {frame.width - 1, frame.height - 1}) : window,
                     window);
  header.compression() = Imf::ZIP_COMPRESSION;
  // the default is Rec. 709 with white point D65
  Imf::addChromaticities(header, Imf::Chromaticities());
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
      for (const float value : channel.values)
        rounded.emplace_back(std::clamp(value, -65504.0f, 65504.0f));
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

/// OpenEXR reports an unreadable file as one of another format.
void require_readable(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (file.get() == std::ifstream::traits_type::eof() && errno != 0) {
    throw FileError(std::generic_category().message(errno));
  }
}

/// The header, with every size checked before the library takes memory for it.
class ExrHeader {
 public:
  explicit ExrHeader(const std::filesystem::path& path)
      : file_bytes_(std::filesystem::file_size(path)) {
    require_readable(path);
    bool deep = false;
    bool multi_part = false;
    if (!Imf::isOpenExrFile(path.c_str(), is_tiled_, deep, multi_part))
      throw FileError("no OpenEXR file");
    if (deep || multi_part) throw FileError("deep and multi-part files are not supported");
    check_attributes(path);
    Imf::StdIFStream stream(path.c_str());
    char magic[4];
    stream.read(magic, sizeof(magic));
    int version = 0;
    Imf::Xdr::read<Imf::StreamIO>(stream, version);
    header_.readFrom(stream, version);
    Imf::Header::setMaxImageSize(kMaxExtent, kMaxExtent);
    Imf::Header::setMaxTileSize(kMaxExtent, kMaxExtent);
    check_extents();
    header_.sanityCheck(is_tiled_);
    check_chunks(stream.tellg());
  }

  const Imf::Header& header() const { return header_; }
  int width() const { return width_; }
  int height() const { return height_; }
  /// Rows to ask for at once. They are whole chunks, so that none is decoded twice. A file of tiles
  /// keeps a row of them.
  int rows_at_once() const {
    return std::min(height_, std::max(kRowsAtOnce, bound_of(header_.compression()).rows));
  }

  /// Bytes needed to read the picture: its values, a few rows of them, and the library's chunks or
  /// tiles.
  std::uint64_t memory() const {
    constexpr std::uint64_t kCopies = 6;  // of a chunk, in the library's decoders
    const auto width = static_cast<std::uint64_t>(width_);
    std::uint64_t library =
        kCopies * width * static_cast<std::uint64_t>(bound_of(header_.compression()).rows);
    if (is_tiled_) {
      const Imf::TileDescription& tile = header_.tileDescription();
      library = std::uint64_t{tile.ySize} * (width + kCopies * tile.xSize);
    }
    return sizeof(float) * channels_ * width *
               static_cast<std::uint64_t>(height_ + rows_at_once()) +
           bytes_per_pixel_ * library;
  }

  std::string text() const {
    return fmt::format("{} x {} pixels, {} channels", width_, height_, channels_);
  }

 private:
  /// Attributes are name, type, size and value; the library takes memory for any size that it
  /// reads.
  void check_attributes(const std::filesystem::path& path) const {
    std::ifstream file(path, std::ios::binary);
    file.seekg(8);  // magic number and version
    const auto skip_text = [&file] {
      std::string text;
      std::getline(file, text, '\0');
      return !text.empty();
    };
    while (skip_text()) {        // the attribute's name
      if (!skip_text()) return;  // its type
      std::int32_t size = 0;
      file.read(reinterpret_cast<char*>(&size), sizeof(size));  // little-endian, as this machine
      const auto at = static_cast<std::uint64_t>(file.tellg());
      if (!file || size < 0 || static_cast<std::uint64_t>(size) > file_bytes_ - at) {
        throw FileError("an attribute passes the end of the file");
      }
      file.seekg(size, std::ios::cur);
    }
  }

  void check_extents() {
    const Imath::Box2i window = header_.dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    if (width < 1 || height < 1 || width > kMaxExtent || height > kMaxExtent) {
      throw FileError(
          fmt::format("{} x {} pixels (at most {} x {})", width, height, kMaxExtent, kMaxExtent));
    }
    width_ = static_cast<int>(width);
    height_ = static_cast<int>(height);
    for (auto it = header_.channels().begin(); it != header_.channels().end(); ++it) {
      if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
        throw FileError(fmt::format("channel {} is subsampled", it.name()));
      }
      ++channels_;
      bytes_per_pixel_ += it.channel().type == Imf::HALF ? 2 : 4;
    }
    if (channels_ == 0 || channels_ > kMaxChannels) {
      throw FileError(fmt::format("{} channels (1 to {})", channels_, kMaxChannels));
    }
    if (pixels() * channels_ > kMaxSamples) {
      throw FileError(fmt::format("{} values (at most {})", pixels() * channels_, kMaxSamples));
    }
  }

  /// Behind the header: a table of 8 bytes per chunk, then the chunks.
  void check_chunks(std::uint64_t table_begin) const {
    const CompressionBound bound = bound_of(header_.compression());
    const auto parts = [](int extent, std::uint64_t part) {
      return (static_cast<std::uint64_t>(extent) + part - 1) / part;
    };
    std::uint64_t chunks = parts(height_, static_cast<std::uint64_t>(bound.rows));
    if (is_tiled_) {
      const Imf::TileDescription& tile = header_.tileDescription();
      chunks = parts(width_, tile.xSize) * parts(height_, tile.ySize);
    }
    const std::uint64_t least =
        table_begin + 8 * chunks + pixels() * bytes_per_pixel_ / bound.ratio;
    if (least > file_bytes_) throw FileError("too short for its size in pixels");
  }

  std::uint64_t pixels() const {
    return static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
  }

  std::uint64_t file_bytes_;
  Imf::Header header_;
  bool is_tiled_ = false;
  int width_ = 0;
  int height_ = 0;
  std::uint64_t channels_ = 0;
  std::uint64_t bytes_per_pixel_ = 0;
};

/// One channel being read: rows are decoded into `rows`, then appended. Memory so grows as the file
/// proves to hold data.
struct ChannelReader {
  std::string name;
  ImageChannel* channel;
  std::vector<float> rows;  // [rows at once][width]
  std::vector<std::uint32_t> id_rows;

  void append(std::size_t count) {
    const auto add = [count](auto& to, const auto& from) {
      if (!from.empty())
        to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
    };
    add(channel->values, rows);
    add(channel->ids, id_rows);
  }
};

std::vector<ChannelReader> channel_readers(const ExrHeader& checked, Image& image) {
  const auto pixels =
      static_cast<std::size_t>(checked.width()) * static_cast<std::size_t>(checked.height());
  const auto rows =
      static_cast<std::size_t>(checked.width()) * static_cast<std::size_t>(checked.rows_at_once());
  std::vector<ChannelReader> readers;
  const Imf::ChannelList& channels = checked.header().channels();
  for (auto it = channels.begin(); it != channels.end(); ++it) {
    ImageChannel& channel = image.channels[it.name()];
    ChannelReader reader{it.name(), &channel, {}, {}};
    if (it.channel().type == Imf::UINT) {
      channel.type = ChannelType::kUint;
      channel.ids.reserve(pixels);
      reader.id_rows.resize(rows);
    } else {
      channel.type = it.channel().type == Imf::HALF ? ChannelType::kHalf : ChannelType::kFloat;
      channel.values.reserve(pixels);
      reader.rows.resize(rows);
    }
    readers.push_back(std::move(reader));
  }
  return readers;
}

Image read_exr_from(const std::filesystem::path& path) {
  const ExrHeader checked(path);
  require_memory(checked.memory(), checked.text());
  Imf::InputFile file(path.c_str());
  if (!file.isComplete()) throw FileError("incomplete");

  Image image;
  image.width = checked.width();
  image.height = checked.height();
  std::vector<ChannelReader> readers = channel_readers(checked, image);
  const Imath::Box2i window = checked.header().dataWindow();
  const Imath::Box2i shown = checked.header().displayWindow();
  if (shown != window) {
    image.frame = {window.min.x - shown.min.x, window.min.y - shown.min.y,
                   shown.max.x - shown.min.x + 1, shown.max.y - shown.min.y + 1};
  }
  for (int row = 0; row < image.height; row += checked.rows_at_once()) {
    const int last = std::min(row + checked.rows_at_once(), image.height) - 1;
    const Imath::Box2i part({window.min.x, window.min.y + row},
                            {window.max.x, window.min.y + last});
    Imf::FrameBuffer buffer;
    for (const ChannelReader& reader : readers) {
      const bool is_id = reader.channel->type == ChannelType::kUint;
      buffer.insert(reader.name, is_id
                                     ? slice_of(Imf::UINT, reader.id_rows.data(), part, image.width)
                                     : slice_of(Imf::FLOAT, reader.rows.data(), part, image.width));
    }
    file.setFrameBuffer(buffer);
    file.readPixels(part.min.y, part.max.y);
    for (ChannelReader& filled : readers) {
      filled.append(static_cast<std::size_t>(last - row + 1) *
                    static_cast<std::size_t>(image.width));
    }
  }
  for (auto it = checked.header().begin(); it != checked.header().end(); ++it) {
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
    throw FileError(
        fmt::format("{}: cannot read as an OpenEXR image: {}", path.string(), error.what()));
  }
}

PngHeader read_png_header(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_whole_file(path);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    throw FileError(
        fmt::format("{}: cannot read as a PNG image: {}", path.string(), image.message));
  }
  const PngHeader header = {static_cast<int>(image.width), static_cast<int>(image.height),
                            static_cast<int>(PNG_IMAGE_SAMPLE_CHANNELS(image.format))};
  png_image_free(&image);
  return header;
}

RgbPicture read_png(const std::filesystem::path& path, int max_extent) {
  return parse_png(read_whole_file(path), path.string(), max_extent);
}

RgbPicture parse_png(std::span<const std::byte> bytes, const std::string& name, int max_extent) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const auto fail = [&](const std::string& reason) {
    png_image_free(&image);
    throw FileError(fmt::format("{}: cannot read as a PNG image: {}", name, reason));
  };
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0)
    fail(image.message);
  const auto limit = static_cast<png_uint_32>(max_extent);
  if (image.width > limit || image.height > limit) {
    fail(fmt::format("{} x {} pixels; expected at most {} x {}", image.width, image.height,
                     max_extent, max_extent));
  }
  // Deflate packs up to 1032 bytes into one; a pixel takes at least one bit.
  if (std::uint64_t{image.width} * image.height / 8 / 1032 > bytes.size())
    fail("too short for its size in pixels");
  image.format = PNG_FORMAT_RGB;
  RgbPicture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  const png_color white{255, 255, 255};
  if (png_image_finish_read(&image, &white, picture.rgb.data(), 0, nullptr) == 0)
    fail(image.message);
  return picture;
}

namespace {

// A PNG is its signature and chunks of length, type, data and checksum; the first one is IHDR.
constexpr std::size_t kPngSignature = 8;
constexpr std::size_t kPngHeaderEnd = kPngSignature + 12 + 13;

/// CRC-32 of IEEE 802.3, over a chunk's type and data.
std::uint32_t png_checksum(std::string_view bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

void append_big_endian(std::string& to, std::uint32_t value) {
  for (const unsigned shift : {24U, 16U, 8U, 0U})
    to += static_cast<char>(static_cast<std::uint8_t>(value >> shift));
}

std::uint32_t big_endian_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k)
    value = value << 8U | static_cast<std::uint8_t>(bytes[at + k]);
  return value;
}

std::string text_chunks(const std::map<std::string, std::string>& text) {
  std::string chunks;
  for (const auto& [keyword, value] : text) {
    assert(!keyword.empty() && keyword.size() < 80);
    std::string body = "tEXt";
    body.append(keyword).push_back('\0');
    body.append(value);
    append_big_endian(chunks, static_cast<std::uint32_t>(body.size() - 4));
    chunks += body;
    append_big_endian(chunks, png_checksum(body));
  }
  return chunks;
}

}  // namespace

std::map<std::string, std::string> read_png_text(const std::filesystem::path& path) {
  read_png_header(path);  // refuses what is no PNG
  const std::vector<std::byte> file = read_whole_file(path);
  const std::string_view bytes(reinterpret_cast<const char*>(file.data()), file.size());
  const auto fail = [&](const char* reason) {
    throw FileError(fmt::format("{}: cannot read as a PNG image: {}", path.string(), reason));
  };
  std::map<std::string, std::string> text;
  for (std::size_t at = kPngSignature; at < bytes.size();) {
    if (bytes.size() - at < 12) fail("a chunk passes the end of the file");
    const std::size_t size = big_endian_at(bytes, at);
    if (size > bytes.size() - at - 12) fail("a chunk passes the end of the file");
    const std::string_view body = bytes.substr(at + 4, 4 + size);
    if (body.starts_with("tEXt")) {
      if (png_checksum(body) != big_endian_at(bytes, at + 8 + size)) fail("a damaged text");
      const std::size_t end = body.find('\0', 4);
      if (end == std::string_view::npos) fail("a text without its keyword");
      text[std::string(body.substr(4, end - 4))] = std::string(body.substr(end + 1));
    }
    at += 12 + size;
  }
  return text;
}

namespace {

/// Removes the chunks that say how samples become colours on a screen.
void erase_color_chunks(std::vector<std::byte>& bytes) {
  for (std::size_t at = kPngSignature; at < bytes.size();) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::string_view type = text.substr(at + 4, 4);
    const std::size_t size = 12 + big_endian_at(text, at);
    if (type == "sRGB" || type == "gAMA" || type == "cHRM") {
      const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(size));
    } else {
      at += size;
    }
  }
}

/// The bytes of a PNG. `samples` are of libpng's `format`.
std::vector<std::byte> png_bytes(const std::filesystem::path& path, int width, int height,
                                 png_uint_32 format, const void* samples) {
  assert(width > 0 && height > 0);
  // This interface of libpng keeps its long jumps inside and returns 0 on an error.
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = format;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, samples, 0, nullptr) == 0) {
    throw FileError(fmt::format("{}: cannot write: {}", path.string(), image.message));
  }
  bytes.resize(size);
  return bytes;
}

std::size_t texels(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

}  // namespace

void write_png(const std::filesystem::path& path, int width, int height,
               const std::vector<std::uint8_t>& rgb,
               const std::map<std::string, std::string>& text) {
  const bool has_alpha = rgb.size() == 4 * texels(width, height);
  assert(has_alpha || rgb.size() == 3 * texels(width, height));
  std::vector<std::byte> bytes =
      png_bytes(path, width, height, has_alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB, rgb.data());
  const std::string chunks = text_chunks(text);
  const auto* begin = reinterpret_cast<const std::byte*>(chunks.data());
  bytes.insert(bytes.begin() + kPngHeaderEnd, begin, begin + chunks.size());
  write_file_atomically(path, std::span<const std::byte>(bytes));
}

void write_data_png(const std::filesystem::path& path, int width, int height,
                    const std::vector<std::uint8_t>& samples) {
  const bool is_grey = samples.size() == texels(width, height);
  assert(is_grey || samples.size() == 3 * texels(width, height));
  std::vector<std::byte> bytes =
      png_bytes(path, width, height, is_grey ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB, samples.data());
  erase_color_chunks(bytes);
  write_file_atomically(path, std::span<const std::byte>(bytes));
}

void write_data_png(const std::filesystem::path& path, int width, int height,
                    const std::vector<std::uint16_t>& grey) {
  assert(grey.size() == texels(width, height));
  std::vector<std::byte> bytes = png_bytes(path, width, height, PNG_FORMAT_LINEAR_Y, grey.data());
  erase_color_chunks(bytes);
  write_file_atomically(path, std::span<const std::byte>(bytes));
}

}  // namespace heddle
