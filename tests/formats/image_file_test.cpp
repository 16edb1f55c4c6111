#include "formats/image_file.h"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfThreading.h>
#include <ImfTiledOutputFile.h>
#include <png.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>

#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class ImageFileFormat : public FileFixture {};

Image sample_image(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  const int n = width * height;
  for (const char* name : {"R", "G", "B", "single.R"}) {
    ImageChannel& channel = image.channels[name];
    for (int i = 0; i < n; ++i)
      channel.values.push_back(static_cast<float>((i * 37 + name[0]) % 256) / 256.0f);
  }
  ImageChannel& depth = image.channels["depth.Z"];
  depth.type = ChannelType::kFloat;
  for (int i = 0; i < n; ++i) depth.values.push_back(1.0f / static_cast<float>(i + 3));
  ImageChannel& segment = image.channels["segment"];
  segment.type = ChannelType::kUint;
  for (int i = 0; i < n; ++i) segment.ids.push_back(4294967295u - static_cast<std::uint32_t>(i));
  image.metadata = {{"heddle/method", "path"}, {"heddle/seed", "18446744073709551615"}};
  return image;
}

void expect_equal(const Image& a, const Image& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.metadata, b.metadata);
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const auto& [name, channel] : a.channels) {
    ASSERT_TRUE(b.channels.contains(name)) << name;
    const ImageChannel& other = b.channels.at(name);
    EXPECT_EQ(channel.type, other.type) << name;
    EXPECT_EQ(channel.values, other.values) << name;
    EXPECT_EQ(channel.ids, other.ids) << name;
  }
}

TEST_F(ImageFileFormat, RoundTripOfEveryChannelType) {
  // Heights below, at and above a block of 16 scan lines.
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 16}, {13, 35}}) {
    const Image image = sample_image(width, height);
    write_exr(folder_ / "a.exr", image);
    expect_equal(image, read_exr(folder_ / "a.exr"));
  }
}

TEST_F(ImageFileFormat, HalvesAreClampedToFiniteValues) {
  Image image;
  image.width = 5;
  image.height = 1;
  const float inf = std::numeric_limits<float>::infinity();
  image.channels["R"].values = {70000.0f, -1e30f, inf, -inf, 65504.0f};
  write_exr(folder_ / "a.exr", image);
  EXPECT_EQ(read_exr(folder_ / "a.exr").channels["R"].values,
            (std::vector<float>{65504, -65504, 65504, -65504, 65504}));
}

TEST_F(ImageFileFormat, EqualImagesGiveEqualBytesForAnyNumberOfThreads) {
  const Image image = sample_image(70, 90);
  const int before = Imf::globalThreadCount();
  Imf::setGlobalThreadCount(0);
  write_exr(folder_ / "a.exr", image);
  Imf::setGlobalThreadCount(3);
  write_exr(folder_ / "b.exr", image);
  const Image read = read_exr(folder_ / "b.exr");
  Imf::setGlobalThreadCount(before);
  EXPECT_EQ(bytes_of(folder_ / "a.exr"), bytes_of(folder_ / "b.exr"));
  expect_equal(image, read);
}

TEST_F(ImageFileFormat, HeaderSaysRec709AndZip) {
  write_exr(folder_ / "a.exr", sample_image(4, 4));
  Imf::InputFile file((folder_ / "a.exr").c_str());
  EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
  ASSERT_TRUE(Imf::hasChromaticities(file.header()));
  const Imf::Chromaticities c = Imf::chromaticities(file.header());
  // ITU-R BT.709-6, table 1.
  EXPECT_EQ(c.red, Imath::V2f(0.64f, 0.33f));
  EXPECT_EQ(c.green, Imath::V2f(0.30f, 0.60f));
  EXPECT_EQ(c.blue, Imath::V2f(0.15f, 0.06f));
  EXPECT_EQ(c.white, Imath::V2f(0.3127f, 0.3290f));
}

TEST_F(ImageFileFormat, ReadsTiledFilesAndShiftedWindows) {
  const Imath::Box2i window({-7, 20}, {12, 44});
  Imf::Header header(window, window);
  header.channels().insert("R", Imf::Channel(Imf::FLOAT));
  header.setTileDescription(Imf::TileDescription(8, 8));
  std::vector<float> values(20 * 25);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  Imf::FrameBuffer pixels;
  pixels.insert("R", Imf::Slice::Make(Imf::FLOAT, values.data(), window));
  {
    Imf::TiledOutputFile file((folder_ / "t.exr").c_str(), header);
    file.setFrameBuffer(pixels);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  const Image image = read_exr(folder_ / "t.exr");
  EXPECT_EQ(image.width, 20);
  EXPECT_EQ(image.height, 25);
  EXPECT_EQ(image.channels.at("R").values, values);
}

TEST_F(ImageFileFormat, TruncatedFilesAreRefused) {
  write_exr(folder_ / "a.exr", sample_image(9, 40));
  const std::string bytes = bytes_of(folder_ / "a.exr");
  for (std::size_t size = 0; size < bytes.size(); size += size < 600 ? 1 : 13) {
    const auto path = put("t.exr", bytes.substr(0, size));
    EXPECT_NE(error_of([&] { read_exr(path); }), "no error") << size;
  }
}

TEST_F(ImageFileFormat, FlippedBitsNeverCrash) {
  write_exr(folder_ / "a.exr", sample_image(9, 40));
  const std::string bytes = bytes_of(folder_ / "a.exr");
  int refused = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string flipped = bytes;
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (at % 8)));
    const auto path = put("t.exr", flipped);
    refused += error_of([&] { read_exr(path); }) != "no error";
  }
  EXPECT_GT(refused, 100);
}

TEST_F(ImageFileFormat, GarbageAndAbsentFilesAreRefused) {
  EXPECT_NE(error_of([&] { read_exr(folder_ / "none.exr"); }).find("none.exr: cannot read"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_exr(folder_); }), "no error");
  EXPECT_NE(
      error_of([&] { read_exr(put("g.exr", std::string(4096, 'x'))); }).find("no OpenEXR file"),
      std::string::npos);
  EXPECT_NE(
      error_of([&] { read_exr(put("g.exr", "\x76\x2f\x31\x01\x02" + std::string(4096, '\x7f'))); }),
      "no error");
}

TEST_F(ImageFileFormat, SizesAreCheckedBeforeMemoryIsTaken) {
  write_exr(folder_ / "a.exr", sample_image(9, 40));
  const std::string bytes = bytes_of(folder_ / "a.exr");
  const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
  const std::size_t at = bytes.find(name) + name.size();
  ASSERT_LT(at, bytes.size());
  const auto with_window = [&](std::array<std::int32_t, 4> window) {
    std::string patched = bytes;
    std::memcpy(patched.data() + at, window.data(), 16);
    const auto path = put("t.exr", patched);
    return error_of([&] { read_exr(path); });
  };
  const std::int32_t big = std::numeric_limits<std::int32_t>::max();
  EXPECT_EQ(with_window({0, 0, 8, 39}), "no error");
  EXPECT_NE(with_window({0, 0, 16384, 39}).find("16385 x 40 pixels (at most 16384 x 16384)"),
            std::string::npos);
  EXPECT_NE(with_window({0, 0, big, big}), "no error");
  EXPECT_NE(with_window({-big, -big, big, big}), "no error");
  EXPECT_NE(with_window({0, 0, -1, -1}), "no error");
  EXPECT_NE(with_window({0, 0, 16383, 16383}), "no error");
  // The same number of blocks, so that their table is fine; 14 MB of pixels cannot come out of this
  // file.
  EXPECT_NE(with_window({0, 0, 16383, 39}).find("too short"), std::string::npos);

  Imf::Header many(16384, 65);
  for (int i = 0; i < 1024; ++i)
    many.channels().insert(std::to_string(i), Imf::Channel(Imf::FLOAT));
  { Imf::OutputFile file((folder_ / "a.exr").c_str(), many); }
  EXPECT_NE(error_of([&] { read_exr(folder_ / "a.exr"); }).find("1090519040 values (at most"),
            std::string::npos);
}

const Imf::Compression kCompressions[] = {
    Imf::NO_COMPRESSION,   Imf::RLE_COMPRESSION,   Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
    Imf::PIZ_COMPRESSION,  Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION,  Imf::B44A_COMPRESSION,
    Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION};

/// A picture of one value throughout, in the channels that a method treats each in its own way.
void write_constant(const std::filesystem::path& path, Imf::Compression compression, int width,
                    int height, float value, bool tiled) {
  Imf::Header header(width, height);
  header.compression() = compression;
  Imf::FrameBuffer pixels;
  for (const char* name : {"R", "G", "B", "A", "Z", "id"}) {
    const Imf::PixelType type = *name == 'i' ? Imf::UINT : (*name == 'Z' ? Imf::FLOAT : Imf::HALF);
    header.channels().insert(name, Imf::Channel(type));
  }
  const std::vector<float> values(
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value);
  const std::vector<Imath::half> halves(values.begin(), values.end());
  const std::vector<std::uint32_t> ids(values.size(), 7);
  const Imath::Box2i window({0, 0}, {width - 1, height - 1});
  for (const char* name : {"R", "G", "B", "A"})
    pixels.insert(name, Imf::Slice::Make(Imf::HALF, halves.data(), window));
  pixels.insert("Z", Imf::Slice::Make(Imf::FLOAT, values.data(), window));
  pixels.insert("id", Imf::Slice::Make(Imf::UINT, ids.data(), window));
  if (tiled) {
    header.setTileDescription(Imf::TileDescription(100, 300));
    Imf::TiledOutputFile file(path.c_str(), header);
    file.setFrameBuffer(pixels);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  } else {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(pixels);
    file.writePixels(height);
  }
}

TEST_F(ImageFileFormat, EveryCompressionIsReadHoweverWellItCompresses) {
  for (const Imf::Compression compression : kCompressions) {
    for (const float value : {0.0F, 1.0F}) {
      for (const bool tiled : {false, true}) {
        write_constant(folder_ / "c.exr", compression, 512, 600, value, tiled);
        const Image image = read_exr(folder_ / "c.exr");
        ASSERT_EQ(image.channels.size(), 6u);
        for (const auto& [name, channel] : image.channels) {
          const std::size_t count =
              channel.type == ChannelType::kUint
                  ? static_cast<std::size_t>(std::count(channel.ids.begin(), channel.ids.end(), 7u))
                  : static_cast<std::size_t>(
                        std::count(channel.values.begin(), channel.values.end(), value));
          EXPECT_EQ(count, 512u * 600u) << compression << " " << tiled << " " << name;
        }
      }
    }
  }
}

TEST_F(ImageFileFormat, WhatTheBytesCannotHoldIsRefusedForEveryCompression) {
  for (const Imf::Compression compression : kCompressions) {
    Imf::Header header(16384, 16384);
    header.compression() = compression;
    for (const char* name : {"R", "G", "B", "A"})
      header.channels().insert(name, Imf::Channel(Imf::HALF));
    { Imf::OutputFile file((folder_ / "a.exr").c_str(), header); }
    EXPECT_NE(error_of([&] { read_exr(folder_ / "a.exr"); }).find("too short for its size"),
              std::string::npos)
        << compression;
    // Tiles of a pixel: their table alone would take 2 GB.
    header = Imf::Header(8, 8);
    header.compression() = compression;
    header.channels().insert("R", Imf::Channel(Imf::HALF));
    header.setTileDescription(Imf::TileDescription(1, 1));
    { Imf::TiledOutputFile file((folder_ / "a.exr").c_str(), header); }
    std::string bytes = bytes_of(folder_ / "a.exr");
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const std::array<std::int32_t, 4> window = {0, 0, 16383, 16383};
    std::memcpy(bytes.data() + bytes.find(name) + name.size(), window.data(), 16);
    EXPECT_NE(error_of([&] { read_exr(put("t.exr", bytes)); }).find("too short for its size"),
              std::string::npos)
        << compression;
  }
}

/// Bytes of a line of /proc/self/status.
std::size_t memory_status(const std::string& name) {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(name + ":")) return 1024 * std::stoul(line.substr(name.size() + 1));
  }
  return 0;
}

// One good chunk to which every entry of the table points, and as many bytes behind it as 2^28
// pixels may come from.
TEST_F(ImageFileFormat, MemoryIsUsedAsDataProveToBeThere) {
  Imf::Header header(16384, 16384);
  header.compression() = Imf::DWAB_COMPRESSION;
  header.channels().insert("R", Imf::Channel(Imf::HALF));
  const std::vector<Imath::half> line(16384);
  {
    Imf::OutputFile file((folder_ / "a.exr").c_str(), header);
    Imf::FrameBuffer pixels;
    pixels.insert(
        "R",
        Imf::Slice(Imf::HALF, const_cast<char*>(reinterpret_cast<const char*>(line.data())), 2, 0));
    file.setFrameBuffer(pixels);
    file.writePixels(256);
  }
  std::string bytes = bytes_of(folder_ / "a.exr");
  // The table's first entry is the place of the first chunk, which follows the table.
  constexpr std::size_t kTableBytes = 64 * 8;
  std::size_t table = 0;
  std::uint64_t chunk = 0;
  for (; chunk != table + kTableBytes; ++table) std::memcpy(&chunk, bytes.data() + table + 1, 8);
  for (std::size_t at = table; at < table + kTableBytes; at += 8)
    std::memcpy(bytes.data() + at, &chunk, 8);
  bytes.resize(bytes.size() + 100'000);
  const std::size_t before = memory_status("VmRSS");
  const std::string error = error_of([&] { read_exr(put("t.exr", bytes)); });
  EXPECT_NE(error, "no error");
  EXPECT_LT(memory_status("VmHWM"), before + 300'000'000) << error;
}

TEST_F(ImageFileFormat, AttributesLongerThanTheFileAreRefused) {
  Image image = sample_image(9, 40);
  image.metadata["note"] = "text";
  write_exr(folder_ / "a.exr", image);
  std::string bytes = bytes_of(folder_ / "a.exr");
  const std::string name("note\0string\0", 12);
  const std::size_t at = bytes.find(name) + name.size();
  ASSERT_LT(at, bytes.size());
  const std::size_t before = memory_status("VmRSS");
  for (const std::int32_t size :
       {std::numeric_limits<std::int32_t>::max(), static_cast<std::int32_t>(bytes.size()), -1}) {
    std::memcpy(bytes.data() + at, &size, 4);
    EXPECT_NE(error_of([&] {
                read_exr(put("t.exr", bytes));
              }).find("an attribute passes the end of the file"),
              std::string::npos);
  }
  EXPECT_LT(memory_status("VmHWM"), before + 200'000'000);
}

TEST_F(ImageFileFormat, PicturesThatTheMachineCannotHoldAreRefusedWithNumbers) {
  write_constant(folder_ / "c.exr", Imf::ZIP_COMPRESSION, 2048, 2048, 0, false);
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &old), 0);
  rlimit lower = old;
  lower.rlim_cur = memory_status("VmSize") + 50'000'000;
  ASSERT_EQ(setrlimit(RLIMIT_AS, &lower), 0);
  const std::string error = error_of([&] { read_exr(folder_ / "c.exr"); });
  ASSERT_EQ(setrlimit(RLIMIT_AS, &old), 0);
  EXPECT_NE(error.find(
                "c.exr: cannot read as an OpenEXR image: 2048 x 2048 pixels, 6 channels: needs 10"),
            std::string::npos)
      << error;
}

TEST_F(ImageFileFormat, MultiPartDeepAndSubsampledFilesAreRefused) {
  const auto path = folder_ / "m.exr";
  Imf::Header part(4, 4);
  part.channels().insert("R", Imf::Channel(Imf::HALF));
  part.setType(Imf::SCANLINEIMAGE);
  Imf::Header parts[2] = {part, part};
  parts[0].setName("a");
  parts[1].setName("b");
  { Imf::MultiPartOutputFile file(path.c_str(), parts, 2); }
  EXPECT_NE(error_of([&] { read_exr(path); }).find("deep and multi-part"), std::string::npos);

  Imf::Header deep(4, 4);
  deep.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  deep.setType(Imf::DEEPSCANLINE);
  deep.compression() = Imf::ZIPS_COMPRESSION;
  { Imf::DeepScanLineOutputFile file(path.c_str(), deep); }
  EXPECT_NE(error_of([&] { read_exr(path); }).find("deep and multi-part"), std::string::npos);

  Imf::Header subsampled(4, 4);
  subsampled.channels().insert("R", Imf::Channel(Imf::FLOAT, 2, 2));
  { Imf::OutputFile file(path.c_str(), subsampled); }
  EXPECT_NE(error_of([&] { read_exr(path); }).find("channel R is subsampled"), std::string::npos);

  Imf::Header unwritten(4, 4);
  unwritten.channels().insert("R", Imf::Channel(Imf::FLOAT));
  { Imf::OutputFile file(path.c_str(), unwritten); }
  EXPECT_NE(error_of([&] { read_exr(path); }).find("incomplete"), std::string::npos);

  Imf::Header many(1, 1);
  for (int i = 0; i < 1025; ++i)
    many.channels().insert(std::to_string(i), Imf::Channel(Imf::FLOAT));
  { Imf::OutputFile file(path.c_str(), many); }
  EXPECT_NE(error_of([&] { read_exr(path); }).find("1025 channels"), std::string::npos);
}

TEST_F(ImageFileFormat, FailedWritesNameTheTarget) {
  EXPECT_NE(
      error_of([&] { write_exr(folder_ / "no" / "a.exr", sample_image(2, 2)); }).find("a.exr"),
      std::string::npos);
  // A string cannot take the place of a standard attribute.
  Image image = sample_image(2, 2);
  image.metadata["compression"] = "none";
  EXPECT_NE(error_of([&] { write_exr(folder_ / "a.exr", image); }).find("a.exr: cannot write"),
            std::string::npos);
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(ImageFileFormat, APartOfAFrameKeepsItsPlace) {
  Image image;
  image.width = 3;
  image.height = 2;
  image.frame = {5, 7, 20, 10};
  image.channels["R"] = {ChannelType::kFloat, {1, 2, 3, 4, 5, 6}, {}};
  write_exr(folder_ / "part.exr", image);
  const Imf::InputFile file((folder_ / "part.exr").c_str());
  EXPECT_EQ(file.header().displayWindow(), Imath::Box2i({0, 0}, {19, 9}));
  EXPECT_EQ(file.header().dataWindow(), Imath::Box2i({5, 7}, {7, 8}));
  const Image read = read_exr(folder_ / "part.exr");
  EXPECT_EQ(read.channels.at("R").values, image.channels.at("R").values);
  EXPECT_EQ(read.frame.x0, 5);
  EXPECT_EQ(read.frame.y0, 7);
  EXPECT_EQ(read.frame.width, 20);
  EXPECT_EQ(read.frame.height, 10);
  image.frame = {};
  write_exr(folder_ / "whole.exr", image);
  EXPECT_EQ(read_exr(folder_ / "whole.exr").frame.width, 0);
}

TEST_F(ImageFileFormat, PngPixelsComeBack) {
  std::vector<std::uint8_t> rgb;
  for (int k = 0; k < 3 * 5 * 7; ++k) rgb.push_back(static_cast<std::uint8_t>(37 * k));
  write_png(folder_ / "p.png", 5, 7, rgb);
  const RgbPicture picture = read_png(folder_ / "p.png", 7);
  EXPECT_EQ(picture.width, 5);
  EXPECT_EQ(picture.height, 7);
  EXPECT_EQ(picture.rgb, rgb);
  EXPECT_NE(
      error_of([&] { read_png(folder_ / "p.png", 6); }).find("5 x 7 pixels; expected at most"),
      std::string::npos);
  const std::string bytes = bytes_of(folder_ / "p.png");
  for (std::size_t size = 0; size < bytes.size() - 12; ++size) {
    EXPECT_NE(error_of([&] { read_png(put("cut.png", bytes.substr(0, size)), 7); }), "no error")
        << size;
  }
}

TEST_F(ImageFileFormat, PngTextComesBack) {
  const std::vector<std::uint8_t> rgb(3 * 2 * 2, 77);
  write_png(folder_ / "plain.png", 2, 2, rgb);
  EXPECT_TRUE(read_png_text(folder_ / "plain.png").empty());
  const std::map<std::string, std::string> text = {{"Software", "x"}, {"a.b", "1.5 stops"}};
  write_png(folder_ / "t.png", 2, 2, rgb, text);
  EXPECT_EQ(read_png_text(folder_ / "t.png"), text);
  // Other readers see the same pixels, and no fault of a checksum.
  EXPECT_EQ(read_png(folder_ / "t.png", 2).rgb, rgb);
  const std::string bytes = bytes_of(folder_ / "t.png");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (size == bytes.size() - 12) continue;  // without its end, all chunks are there
    EXPECT_NE(error_of([&] { read_png_text(put("cut.png", bytes.substr(0, size))); }), "no error")
        << size;
  }
  std::string damaged = bytes;
  damaged[damaged.find("1.5")] = '2';
  EXPECT_NE(error_of([&] { read_png_text(put("cut.png", damaged)); }).find("a damaged text"),
            std::string::npos);
}

TEST_F(ImageFileFormat, PngRoundTripAndEqualBytes) {
  const int width = 7;
  const int height = 5;
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < 3 * width * height; ++i) rgb.push_back(static_cast<std::uint8_t>(i * 29));
  write_png(folder_ / "a.png", width, height, rgb);
  write_png(folder_ / "b.png", width, height, rgb);
  EXPECT_EQ(bytes_of(folder_ / "a.png"), bytes_of(folder_ / "b.png"));

  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, (folder_ / "a.png").c_str()), 0);
  EXPECT_EQ(image.width, 7u);
  EXPECT_EQ(image.height, 5u);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> read(rgb.size());
  ASSERT_NE(png_image_finish_read(&image, nullptr, read.data(), 0, nullptr), 0);
  EXPECT_EQ(read, rgb);
  EXPECT_NE(error_of([&] { write_png(folder_ / "no" / "a.png", width, height, rgb); }), "no error");
}

// Numbers come back as they are, and nothing in the file asks a program to convert them.
TEST_F(ImageFileFormat, DataPngsHaveNoColourChunks) {
  const std::vector<std::uint8_t> grey = {0, 1, 127, 128, 254, 255};
  const std::vector<std::uint16_t> deep = {0, 1, 255, 256, 40000, 65535};
  const std::vector<std::uint8_t> rgb = {1, 2, 3, 4, 5, 6};
  write_data_png(folder_ / "grey.png", 3, 2, grey);
  write_data_png(folder_ / "deep.png", 2, 3, deep);
  write_data_png(folder_ / "rgb.png", 2, 1, rgb);
  EXPECT_EQ(read_png_header(folder_ / "grey.png").channels, 1);
  EXPECT_EQ(read_png(folder_ / "rgb.png", 2).rgb, rgb);
  for (const char* name : {"grey.png", "deep.png", "rgb.png"}) {
    const std::string bytes = bytes_of(folder_ / name);
    for (const char* chunk : {"sRGB", "gAMA", "cHRM"})
      EXPECT_EQ(bytes.find(chunk), std::string::npos) << name << chunk;
  }
  const std::vector<std::uint8_t> read_grey = read_png(folder_ / "grey.png", 3).rgb;
  for (std::size_t k = 0; k < grey.size(); ++k) EXPECT_EQ(read_grey[3 * k], grey[k]);
  // 16 bits, by libpng's plain interface: the other one would convert.
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
      std::fopen((folder_ / "deep.png").c_str(), "rb"), std::fclose);
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file.get());
  png_read_png(png, info, PNG_TRANSFORM_SWAP_ENDIAN, nullptr);
  EXPECT_EQ(png_get_bit_depth(png, info), 16);
  for (std::size_t k = 0; k < deep.size(); ++k) {
    std::uint16_t value = 0;
    std::memcpy(&value, png_get_rows(png, info)[k / 2] + 2 * (k % 2), 2);
    EXPECT_EQ(value, deep[k]);
  }
  png_destroy_read_struct(&png, &info, nullptr);
}

// Colours with an alpha are stored beside it, not multiplied by it.
TEST_F(ImageFileFormat, PngWithAlpha) {
  const std::vector<std::uint8_t> rgba = {200, 100, 50, 0, 10, 20, 30, 255};
  write_png(folder_ / "a.png", 2, 1, rgba);
  EXPECT_EQ(read_png_header(folder_ / "a.png").channels, 4);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, (folder_ / "a.png").c_str()), 0);
  image.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> read(rgba.size());
  ASSERT_NE(png_image_finish_read(&image, nullptr, read.data(), 0, nullptr), 0);
  EXPECT_EQ(read, rgba);
}

}  // namespace
}  // namespace heddle
