#include "formats/hdr_file.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "formats/atomic_file.h"
#include "formats/image_file.h"
#include "formats/input_error.h"
#include "formats/memory_need.h"

namespace heddle {
namespace {

constexpr std::uint64_t kMaxValues = std::uint64_t{1} << 28;
// The new encoding reaches 16 pixels per byte. The old one has no bound, but no real sky is this
// even.
constexpr std::uint64_t kMaxPixelsPerByte = 1024;

using Pixel = std::array<std::uint8_t, 4>;  // three mantissas and their exponent

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  Image read() {
    read_header();
    Image image;
    read_size(image.width, image.height);
    const auto pixels =
        static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height);
    if (3 * pixels > kMaxValues)
      fail(fmt::format("{} values (at most {})", 3 * pixels, kMaxValues));
    if (pixels / kMaxPixelsPerByte > bytes_.size()) fail("too short for its size in pixels");
    require_memory(3 * sizeof(float) * pixels,
                   fmt::format("{} x {} pixels", image.width, image.height));
    std::array<std::vector<float>*, 3> channels;
    const char* names[] = {"R", "G", "B"};
    for (std::size_t c = 0; c < 3; ++c) {
      ImageChannel& channel = image.channels[names[c]];
      channel.type = ChannelType::kFloat;
      channel.values.reserve(pixels);
      channels[c] = &channel.values;
    }
    std::vector<Pixel> line(static_cast<std::size_t>(image.width));
    for (row_ = 0; row_ < image.height; ++row_) {
      read_line(line);
      for (const Pixel& pixel : line) {
        const double scale = pixel[3] == 0 ? 0.0 : std::ldexp(1.0 / exposure_, pixel[3] - 136);
        for (std::size_t c = 0; c < 3; ++c)
          channels[c]->push_back(static_cast<float>(pixel[c] * scale));
      }
    }
    if (at_ != bytes_.size())
      throw FileError(fmt::format("{} bytes after the last line", bytes_.size() - at_));
    for (const std::vector<float>* values : channels) {
      for (const float value : *values) {
        if (!std::isfinite(value)) throw FileError("a value beyond the range of float");
      }
    }
    return image;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw FileError(row_ < 0 ? reason : fmt::format("line {}: {}", row_, reason));
  }

  std::string_view text_line() {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string_view::npos) fail("the header does not end");
    std::string_view line = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  void read_header() {
    const std::string_view first = bytes_.substr(0, bytes_.find_first_of("\r\n"));
    if (first != "#?RADIANCE" && first != "#?RGBE") fail("no Radiance picture");
    text_line();
    bool has_format = false;
    for (std::string_view line = text_line(); !line.empty(); line = text_line()) {
      if (line.starts_with("FORMAT=")) {
        if (line != "FORMAT=32-bit_rle_rgbe")
          fail(fmt::format("{} is not supported", printable(line)));
        has_format = true;
      } else if (line.starts_with("EXPOSURE=")) {
        read_exposure(line.substr(9));
      }
      // Other variables and comments do not change what the pixels mean.
    }
    if (!has_format) fail("no FORMAT");
  }

  void read_exposure(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value > 0))
      fail("EXPOSURE is no positive number");
    exposure_ *= value;
    if (!(exposure_ > 1e-30 && exposure_ < 1e30)) fail("EXPOSURE is out of range");
  }

  void read_size(int& width, int& height) {
    const std::string_view line = text_line();
    const char* const end = line.data() + line.size();
    const auto number = [&](const char*& at, std::string_view key, int& value) {
      if (!std::string_view(at, end).starts_with(key)) return false;
      const auto [stop, error] = std::from_chars(at + key.size(), end, value);
      at = stop;
      return error == std::errc() && value >= 1;
    };
    const char* at = line.data();
    if (!number(at, "-Y ", height) || !number(at, " +X ", width) || at != end) {
      fail(fmt::format("expected '-Y height +X width', found '{}'", printable(line)));
    }
    if (width > kMaxExtent || height > kMaxExtent) {
      fail(fmt::format("{} x {} pixels (at most {} x {})", width, height, kMaxExtent, kMaxExtent));
    }
  }

  static std::string printable(std::string_view text) {
    std::string result;
    for (const char c : text.substr(0, 60)) result += c >= ' ' && c <= '~' ? c : '?';
    return result;
  }

  std::uint8_t byte() {
    if (at_ >= bytes_.size()) fail("the file ends early");
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }
  Pixel pixel() { return {byte(), byte(), byte(), byte()}; }  // braces: left to right

  void read_line(std::vector<Pixel>& line) {
    const Pixel first = pixel();
    // The new encoding does not exist for these widths.
    const bool components = line.size() >= 8 && line.size() <= 32767 && first[0] == 2 &&
                            first[1] == 2 && first[2] < 128;
    if (components) {
      if (static_cast<std::size_t>(first[2]) * 256 + first[3] != line.size())
        fail("a line of another width");
      for (std::size_t c = 0; c < 4; ++c) read_component(line, c);
    } else {
      read_repeats(line, first);
    }
  }

  void read_component(std::vector<Pixel>& line, std::size_t component) {
    for (std::size_t x = 0; x < line.size();) {
      const std::uint8_t code = byte();
      const bool is_run = code > 128;
      const std::size_t count = is_run ? code - 128U : code;
      if (count == 0 || count > line.size() - x) fail("a run beyond the end of the line");
      const std::uint8_t value = is_run ? byte() : std::uint8_t{0};
      for (std::size_t k = 0; k < count; ++k) line[x++][component] = is_run ? value : byte();
    }
  }

  // Flat pixels; (1, 1, 1, n) repeats the pixel before, and each that follows another counts 256
  // times as much.
  void read_repeats(std::vector<Pixel>& line, const Pixel& first) {
    int shift = 0;
    Pixel next = first;
    for (std::size_t x = 0;;) {
      if (next[0] == 1 && next[1] == 1 && next[2] == 1) {
        if (x == 0) fail("a run before the first pixel");
        if (shift > 16) fail("a run beyond the end of the line");
        const std::size_t count = static_cast<std::size_t>(next[3]) << shift;
        if (count > line.size() - x) fail("a run beyond the end of the line");
        const Pixel previous = line[x - 1];
        for (std::size_t k = 0; k < count; ++k) line[x++] = previous;
        shift += 8;
      } else {
        line[x++] = next;
        shift = 0;
      }
      if (x == line.size()) return;
      next = pixel();
    }
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  int row_ = -1;  // -1: in the header
  double exposure_ = 1;
};

}  // namespace

Image read_hdr(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_whole_file(path);
  try {
    return Reader({reinterpret_cast<const char*>(bytes.data()), bytes.size()}).read();
  } catch (const std::runtime_error& error) {
    throw FileError(
        fmt::format("{}: cannot read as a Radiance picture: {}", path.string(), error.what()));
  }
}

}  // namespace heddle
