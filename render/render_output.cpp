#include "render/render_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "formats/input_error.h"
#include "render/pixel_sums.h"

namespace heddle {

namespace {

constexpr std::array<const char*, 3> kColorChannels = {"R", "G", "B"};

std::string channel_name(const std::string& layer, const std::string& channel) {
  return layer.empty() ? channel : layer + "." + channel;
}

template <class Triples>
void add_triples(Image& image, const Triples& values, ChannelType type,
                 const std::array<std::string, 3>& names) {
  if (values.empty()) return;
  for (int k = 0; k < 3; ++k) {
    ImageChannel channel{type, {}, {}};
    channel.values.reserve(values.size());
    for (const auto& value : values) channel.values.push_back(value[k]);
    image.channels[names[static_cast<std::size_t>(k)]] = std::move(channel);
  }
}

void add_color(Image& image, const std::string& layer, const std::vector<Rgb>& values,
               ChannelType type) {
  add_triples(image, values, type,
              {channel_name(layer, "R"), channel_name(layer, "G"), channel_name(layer, "B")});
}

}  // namespace

std::uint64_t picture_bytes(int width_px, int height_px, int spp, bool with_fiber_layers) {
  const std::uint64_t colors = spp >= 2 ? 6 : 3;
  const std::uint64_t fibers =
      with_fiber_layers ? 2 * sizeof(std::uint32_t) + 2 * sizeof(Vec3) + sizeof(float) : 0;
  const std::uint64_t frame = colors * sizeof(Rgb) + sizeof(float) + fibers;
  const std::uint64_t image = frame;  // channel by channel
  const std::uint64_t pixel = frame + std::max<std::uint64_t>(sizeof(PixelSums), image);
  return pixel * static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
}

std::size_t block_of_pixel(int x, int y, int width_px) {
  const int columns = (width_px + kBlockEdge - 1) / kBlockEdge;
  return static_cast<std::size_t>(y / kBlockEdge * columns + x / kBlockEdge);
}

bool add_samples(const std::vector<int>& more, const FrameBuffers& frame,
                 std::vector<int>& wanted) {
  bool any = false;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const auto x = static_cast<int>(k % static_cast<std::size_t>(frame.width));
    const auto y = static_cast<int>(k / static_cast<std::size_t>(frame.width));
    const int added = more.size() == 1 ? more[0] : more[block_of_pixel(x, y, frame.width)];
    wanted[k] += added;
    any = any || added > 0;
  }
  return any;
}

void set_samples(const std::vector<int>& done, FrameBuffers& frame) {
  const auto [fewest, most] = std::minmax_element(done.begin(), done.end());
  frame.spp = *most;
  frame.samples.clear();
  if (*fewest != *most) frame.samples = done;
}

Image image_of(const FrameBuffers& frame, const std::map<std::string, std::string>& metadata) {
  Image image;
  image.width = frame.width;
  image.height = frame.height;
  image.metadata = metadata;
  add_color(image, "", frame.beauty, ChannelType::kHalf);
  image.channels["A"] = {ChannelType::kHalf, frame.alpha, {}};
  add_color(image, "single", frame.single, ChannelType::kHalf);
  add_color(image, "multiple", frame.multiple, ChannelType::kHalf);
  add_color(image, "half0", frame.half0, ChannelType::kHalf);
  add_color(image, "half1", frame.half1, ChannelType::kHalf);
  add_color(image, "Variance", frame.variance, ChannelType::kFloat);
  if (!frame.samples.empty()) {
    image.channels["samples"] = {
        ChannelType::kUint, {}, {frame.samples.begin(), frame.samples.end()}};
  }
  add_triples(image, frame.fabric_position, ChannelType::kFloat, {"u", "v", "w"});
  add_triples(image, frame.tangent, ChannelType::kFloat, {"tangent.X", "tangent.Y", "tangent.Z"});
  if (!frame.depth.empty()) image.channels["Z"] = {ChannelType::kFloat, frame.depth, {}};
  if (!frame.segment.empty()) image.channels["segment"] = {ChannelType::kUint, {}, frame.segment};
  if (!frame.cell.empty()) image.channels["cell"] = {ChannelType::kUint, {}, frame.cell};
  return image;
}

std::vector<Rgb> layer_of(const Image& image, const std::string& layer, const std::string& name) {
  std::vector<Rgb> colors(static_cast<std::size_t>(image.width) *
                          static_cast<std::size_t>(image.height));
  for (int c = 0; c < 3; ++c) {
    const std::string channel = channel_name(layer, kColorChannels[static_cast<std::size_t>(c)]);
    const auto found = image.channels.find(channel);
    if (found == image.channels.end() || found->second.type == ChannelType::kUint) {
      throw FileError(fmt::format("{}: no colour channel '{}'", name, channel));
    }
    for (std::size_t k = 0; k < colors.size(); ++k) colors[k][c] = found->second.values[k];
  }
  return colors;
}

}  // namespace heddle
