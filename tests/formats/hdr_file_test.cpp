#include "formats/hdr_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class HdrFileFormat : public FileFixture {};

using Pixel = std::array<std::uint8_t, 4>;

std::string header(int width, int height, const std::string& extra = "") {
  return "#?RADIANCE\n# a comment\n" + extra + "FORMAT=32-bit_rle_rgbe\n\n-Y " +
         std::to_string(height) + " +X " + std::to_string(width) + "\n";
}

// Mantissas, and exponents around 128; some pixels black, long even stretches, none that could be
// taken for a code.
std::vector<Pixel> sample(int width, int height) {
  std::vector<Pixel> pixels;
  for (int i = 0; i < width * height; ++i) {
    const int k = i % 50 < 30 ? i / 50 : i;
    pixels.push_back({static_cast<std::uint8_t>(130 + k % 7),
                      static_cast<std::uint8_t>(k * 31 % 256),
                      static_cast<std::uint8_t>(k * 5 % 256),
                      static_cast<std::uint8_t>(k % 9 == 0 ? 0 : 120 + k % 16)});
  }
  return pixels;
}

void append(std::string& bytes, const Pixel& pixel) {
  for (const std::uint8_t value : pixel) bytes += static_cast<char>(value);
}

std::string flat(const std::vector<Pixel>& pixels) {
  std::string bytes;
  for (const Pixel& pixel : pixels) append(bytes, pixel);
  return bytes;
}

// Repeats as long as possible, with two codes where they are longer than 255.
std::string old_runs(const std::vector<Pixel>& pixels, int width) {
  std::string bytes;
  for (std::size_t begin = 0; begin < pixels.size(); begin += static_cast<std::size_t>(width)) {
    const std::size_t end = begin + static_cast<std::size_t>(width);
    for (std::size_t i = begin; i < end;) {
      append(bytes, pixels[i]);
      std::size_t count = 0;
      while (i + 1 + count < end && pixels[i + 1 + count] == pixels[i]) ++count;
      if (count > 0) append(bytes, {1, 1, 1, static_cast<std::uint8_t>(count % 256)});
      if (count > 255) append(bytes, {1, 1, 1, static_cast<std::uint8_t>(count / 256)});
      i += 1 + count;
    }
  }
  return bytes;
}

std::string new_runs(const std::vector<Pixel>& pixels, int width) {
  std::string bytes;
  for (std::size_t begin = 0; begin < pixels.size(); begin += static_cast<std::size_t>(width)) {
    append(bytes,
           {2, 2, static_cast<std::uint8_t>(width / 256), static_cast<std::uint8_t>(width % 256)});
    for (std::size_t c = 0; c < 4; ++c) {
      const std::size_t end = begin + static_cast<std::size_t>(width);
      for (std::size_t i = begin; i < end;) {
        std::size_t count = 1;
        while (count < 127 && i + count < end && pixels[i + count][c] == pixels[i][c]) ++count;
        if (count > 2) {
          bytes += static_cast<char>(128 + count);
          bytes += static_cast<char>(pixels[i][c]);
        } else {
          bytes += static_cast<char>(count);
          for (std::size_t k = 0; k < count; ++k) bytes += static_cast<char>(pixels[i + k][c]);
        }
        i += count;
      }
    }
  }
  return bytes;
}

void expect_pixels(const Image& image, const std::vector<Pixel>& pixels, double exposure = 1) {
  ASSERT_EQ(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
            pixels.size());
  ASSERT_EQ(image.channels.size(), 3U);
  const char* names[] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    const ImageChannel& channel = image.channels.at(names[c]);
    EXPECT_EQ(channel.type, ChannelType::kFloat);
    ASSERT_EQ(channel.values.size(), pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double value =
          pixels[i][3] == 0 ? 0 : pixels[i][c] * std::exp2(pixels[i][3] - 136.0) / exposure;
      EXPECT_FLOAT_EQ(channel.values[i], static_cast<float>(value));
    }
  }
}

TEST_F(HdrFileFormat, AllEncodingsAreOneImage) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {8, 2}, {40, 5}, {1000, 3}}) {
    const std::vector<Pixel> pixels = sample(width, height);
    std::vector<std::string> encodings = {flat(pixels), old_runs(pixels, width)};
    if (width >= 8) encodings.push_back(new_runs(pixels, width));
    for (const std::string& bytes : encodings)
      expect_pixels(read_hdr(put("a.hdr", header(width, height) + bytes)), pixels);
  }
  const std::vector<Pixel> even(900, Pixel{9, 8, 7, 129});
  EXPECT_LT(old_runs(even, 900).size(), 13U);
  expect_pixels(read_hdr(put("a.hdr", header(900, 1) + old_runs(even, 900))), even);
}

TEST_F(HdrFileFormat, ExposuresAreDividedOut) {
  const std::vector<Pixel> pixels = sample(10, 1);
  expect_pixels(read_hdr(put("a.hdr", header(10, 1, "EXPOSURE=2\nGAMMA=1\nEXPOSURE= 0.25 \n") +
                                          flat(pixels))),
                pixels, 0.5);
  for (const char* bad :
       {"EXPOSURE=0\n", "EXPOSURE=-1\n", "EXPOSURE=x\n", "EXPOSURE=nan\n", "EXPOSURE=1e-300\n"}) {
    EXPECT_NE(error_of([&] {
                read_hdr(put("a.hdr", header(10, 1, bad) + flat(pixels)));
              }).find("EXPOSURE"),
              std::string::npos);
  }
}

TEST_F(HdrFileFormat, EveryTruncationAndExtensionIsRefused) {
  const std::vector<Pixel> pixels = sample(20, 3);
  for (const std::string& body : {flat(pixels), old_runs(pixels, 20), new_runs(pixels, 20)}) {
    const std::string whole = header(20, 3) + body;
    EXPECT_EQ(error_of([&] { read_hdr(put("a.hdr", whole)); }), "no error");
    for (std::size_t size = 0; size < whole.size(); ++size) {
      EXPECT_NE(error_of([&] { read_hdr(put("t.hdr", whole.substr(0, size))); }), "no error")
          << size;
    }
    EXPECT_NE(error_of([&] { read_hdr(put("t.hdr", whole + "x")); }).find("after the last line"),
              std::string::npos);
  }
}

TEST_F(HdrFileFormat, FlippedBitsNeverCrash) {
  const std::vector<Pixel> pixels = sample(40, 3);
  for (const std::string& body : {old_runs(pixels, 40), new_runs(pixels, 40)}) {
    const std::string whole = header(40, 3) + body;
    int refused = 0;
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        std::string flipped = whole;
        flipped[at] = static_cast<char>(flipped[at] ^ (1 << bit));
        const auto path = put("t.hdr", flipped);
        refused += error_of([&] { read_hdr(path); }) != "no error";
      }
    }
    EXPECT_GT(refused, 100);
  }
}

TEST_F(HdrFileFormat, RunsBeyondTheLineAreRefused) {
  const auto error_with = [&](int width, const std::string& body) {
    return error_of([&] { read_hdr(put("a.hdr", header(width, 1) + body)); });
  };
  // 128 + 9 and 9 plain values on a line of 8; a count of 0.
  EXPECT_NE(error_with(8, std::string("\x02\x02\x00\x08\x89\x01", 6) + std::string(60, '\x01'))
                .find("beyond"),
            std::string::npos);
  EXPECT_NE(error_with(8, std::string("\x02\x02\x00\x08\x09", 5) + std::string(60, '\x01'))
                .find("beyond"),
            std::string::npos);
  EXPECT_NE(error_with(8, std::string("\x02\x02\x00\x08\x00", 5) + std::string(60, '\x01'))
                .find("beyond"),
            std::string::npos);
  EXPECT_NE(error_with(8, std::string("\x02\x02\x00\x09", 4) + std::string(60, '\x01'))
                .find("another width"),
            std::string::npos);
  EXPECT_NE(error_with(4, "\x09\x09\x09\x80\x01\x01\x01\x04").find("beyond"), std::string::npos);
  EXPECT_NE(error_with(4, "\x01\x01\x01\x04").find("before the first pixel"), std::string::npos);
  std::string shifted = "\x09\x09\x09\x80";
  for (int k = 0; k < 12; ++k) shifted += std::string("\x01\x01\x01\x00", 4);
  EXPECT_NE(error_with(4, shifted).find("beyond"), std::string::npos);
}

TEST_F(HdrFileFormat, HeadersAreCheckedBeforeMemoryIsTaken) {
  const auto error_with = [&](const std::string& bytes) {
    return error_of([&] { read_hdr(put("a.hdr", bytes)); });
  };
  EXPECT_NE(error_with("P6 1 1 255\n").find("no Radiance picture"), std::string::npos);
  EXPECT_NE(error_with("#?RADIANCE\n\n-Y 1 +X 1\n1234").find("no FORMAT"), std::string::npos);
  EXPECT_NE(
      error_with("#?RGBE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n1234").find("xyze is not supported"),
      std::string::npos);
  EXPECT_EQ(error_with("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n1234"), "no error");
  for (const char* size :
       {"+Y 1 +X 1", "-Y 0 +X 1", "-Y 1 +X -1", "-Y 1 +X 1 ", "-Y 1 +X", "+X 1 -Y 1", "-Y 1+X 1"}) {
    EXPECT_NE(error_with(std::string("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n") + size + "\n1234")
                  .find("expected '-Y"),
              std::string::npos)
        << size;
  }
  EXPECT_NE(error_with(header(16385, 1)).find("at most 16384"), std::string::npos);
  EXPECT_NE(error_with(header(999999999, 999999999)).find("at most 16384"), std::string::npos);
  EXPECT_NE(error_with(header(16384, 16384)).find("values (at most"), std::string::npos);
  EXPECT_NE(error_with(header(8192, 8192)).find("too short"), std::string::npos);
  EXPECT_NE(error_of([&] { read_hdr(folder_ / "none.hdr"); }).find("none.hdr"), std::string::npos);
}

}  // namespace
}  // namespace heddle
