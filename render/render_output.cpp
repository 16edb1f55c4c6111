#include "render/render_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "formats/input_error.h"
#include "render/layer_sums.h"
#include "render/pixel_sums.h"

namespace heddle {

namespace {

// Before the names of light groups in names of layers.
constexpr char kLightGroupPrefix[] = "C_";
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

std::uint64_t picture_bytes(int width_px, int height_px, int spp, const KeptLayers& kept) {
  const bool groups = kept.light_groups > 1;
  const std::uint64_t colors = (spp >= 2 ? 6U : 3U) + (groups ? kept.light_groups : 0U) +
                               (kept.transmitted ? 1U : 0U) +
                               (groups || kept.transmitted ? 1U : 0U) + (kept.of_scene ? 1U : 0U);
  const std::uint64_t fibers = kept.of_fibers || kept.of_scene
                                   ? 2 * sizeof(std::uint32_t) + 2 * sizeof(Vec3) + sizeof(float)
                                   : 0;
  const std::uint64_t scene = kept.of_scene ? 2 * sizeof(Vec3) + sizeof(Vec2) : 0;
  const std::uint64_t mattes = kept.mattes ? 3 * sizeof(Cryptomatte::Ranks) : 0;
  const std::uint64_t frame = colors * sizeof(Rgb) + sizeof(float) + fibers + scene + mattes;
  const std::uint64_t image = frame;  // channel by channel
  const std::uint64_t parts =
      groups || kept.transmitted ? 2 + (groups ? kept.light_groups : 0U) : 0U;
  const std::uint64_t sums = sizeof(PixelSums) + parts * sizeof(Rgbd);
  const std::uint64_t pixel = frame + std::max(sums, image);
  return pixel * static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
}

void FrameBuffers::keep_parts(std::size_t groups, bool with_transmitted) {
  if (groups > 1) light_groups.resize(groups);
  for (LightGroupLayer& group : light_groups) group.light.resize(pixel_count(), Rgb::Zero());
  if (with_transmitted) transmitted.resize(pixel_count(), Rgb::Zero());
  if (groups > 1 || with_transmitted) background.resize(pixel_count(), Rgb::Zero());
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

namespace {

/// Colours rounded so that the sums of render_output.h hold.
struct AddedColors {
  std::vector<Rgb> beauty, single, multiple, background, reflected, transmitted;
  std::vector<std::vector<Rgb>> light_groups;
};

AddedColors added_colors(const FrameBuffers& frame) {
  AddedColors colors{frame.beauty, frame.single, frame.multiple, frame.background, {}, {}, {}};
  for (const LightGroupLayer& group : frame.light_groups)
    colors.light_groups.push_back(group.light);
  colors.transmitted = frame.transmitted;
  colors.reflected.resize(frame.transmitted.size());
  std::vector<float> lights(1 + colors.light_groups.size());
  for (std::size_t k = 0; k < frame.pixel_count(); ++k) {
    for (int c = 0; c < 3; ++c) {
      std::array<float, 3> parts = {colors.background[k][c], colors.single[k][c],
                                    colors.multiple[k][c]};
      lights[0] = parts[0];
      for (std::size_t g = 0; g < colors.light_groups.size(); ++g)
        lights[1 + g] = colors.light_groups[g][k][c];
      const std::span<float> sets[] = {parts, lights};
      round_to_add_up(colors.beauty[k][c], {sets, colors.light_groups.empty() ? 1U : 2U});
      colors.background[k][c] = parts[0];
      colors.single[k][c] = parts[1];
      colors.multiple[k][c] = parts[2];
      for (std::size_t g = 0; g < colors.light_groups.size(); ++g)
        colors.light_groups[g][k][c] = lights[1 + g];
      if (colors.transmitted.empty()) continue;
      std::array<float, 2> lobes = {frame.single[k][c] - frame.transmitted[k][c],
                                    frame.transmitted[k][c]};
      round_parts(parts[1], lobes);
      colors.reflected[k][c] = lobes[0];
      colors.transmitted[k][c] = lobes[1];
    }
  }
  return colors;
}

void add_light(const FrameBuffers& frame, Image& image) {
  if (frame.background.empty()) {
    add_color(image, "", frame.beauty, ChannelType::kHalf);
    add_color(image, "single", frame.single, ChannelType::kHalf);
    add_color(image, "multiple", frame.multiple, ChannelType::kHalf);
    return;
  }
  const AddedColors colors = added_colors(frame);
  add_color(image, "", colors.beauty, ChannelType::kHalf);
  add_color(image, "single", colors.single, ChannelType::kHalf);
  add_color(image, "multiple", colors.multiple, ChannelType::kHalf);
  add_color(image, "background", colors.background, ChannelType::kHalf);
  add_color(image, "reflected", colors.reflected, ChannelType::kHalf);
  add_color(image, "transmitted", colors.transmitted, ChannelType::kHalf);
  for (std::size_t g = 0; g < colors.light_groups.size(); ++g) {
    add_color(image, kLightGroupPrefix + frame.light_groups[g].name, colors.light_groups[g],
              ChannelType::kHalf);
  }
}

struct LayerNote {
  std::string_view layer;
  bool has_names;  // is the layer's name a beginning of those of several?
  const char* note;
};

constexpr LayerNote kNotes[] = {
    {"RGB", false, "radiance of all light, linear Rec. 709"},
    {"A", false, "share of the pixel that shows cloth or a mesh"},
    {"single", false, "radiance of light that was scattered once"},
    {"multiple", false, "radiance of light that was scattered more often"},
    {"reflected", false, "part of single that fibers and surfaces reflect (lobe R)"},
    {"transmitted", false, "part of single that comes through fibers (lobe TT)"},
    {"background", false, "radiance seen past all cloth and meshes"},
    {kLightGroupPrefix, true, "radiance of the lights of this group"},
    {"half0", false, "radiance of the even samples"},
    {"half1", false, "radiance of the odd samples"},
    {"Variance", false, "of the mean in R, G, B, radiance squared"},
    {"samples", false, "eye rays through the pixel"},
    {"segment", false, "id of the fiber segment in its exemplar; 4294967295: none"},
    {"cell", false, "id of the segment's cell of multiple scattering; 4294967295: none"},
    {"u", false, "place on the fabric along the weft, mm"},
    {"v", false, "place on the fabric along the warp, mm"},
    {"w", false, "height over the fabric's middle plane, mm"},
    {"tangent", false, "direction of the fiber, world space"},
    {"Z", false, "depth along the view direction, mm; 0: nothing"},
    {"P", false, "place in world space, mm"},
    {"N", false, "normal of the cloth towards the eye, world space; mean over the pixel"},
    {"UV", false, "texture coordinates of the mesh; of a flat cloth, 0 to 1 over it"},
    {"albedo", false, "share of light that the fiber or surface scatters; mean over the pixel"},
    {"Crypto", true, "Cryptomatte: ids and the shares of the pixel that they cover"},
};

}  // namespace

std::string channel_note(const std::string& channel) {
  const bool is_beauty = channel == "R" || channel == "G" || channel == "B";
  const std::string layer = is_beauty ? "RGB" : channel.substr(0, channel.rfind('.'));
  for (const LayerNote& note : kNotes) {
    if (note.has_names ? layer.starts_with(note.layer) : layer == note.layer) return note.note;
  }
  return "";
}

Image image_of(const FrameBuffers& frame, const std::map<std::string, std::string>& metadata) {
  Image image;
  image.width = frame.width;
  image.height = frame.height;
  image.metadata = metadata;
  add_light(frame, image);
  image.channels["A"] = {ChannelType::kHalf, frame.alpha, {}};
  add_color(image, "half0", frame.half0, ChannelType::kHalf);
  add_color(image, "half1", frame.half1, ChannelType::kHalf);
  add_color(image, "Variance", frame.variance, ChannelType::kFloat);
  if (!frame.samples.empty()) {
    image.channels["samples"] = {
        ChannelType::kUint, {}, {frame.samples.begin(), frame.samples.end()}};
  }
  add_triples(image, frame.fabric_position, ChannelType::kFloat, {"u", "v", "w"});
  add_triples(image, frame.tangent, ChannelType::kFloat, {"tangent.X", "tangent.Y", "tangent.Z"});
  add_triples(image, frame.position, ChannelType::kFloat, {"P.X", "P.Y", "P.Z"});
  add_triples(image, frame.normal, ChannelType::kHalf, {"N.X", "N.Y", "N.Z"});
  add_color(image, "albedo", frame.albedo, ChannelType::kHalf);
  for (int k = 0; k < 2 && !frame.uv.empty(); ++k) {
    ImageChannel& channel = image.channels[k == 0 ? "UV.U" : "UV.V"];
    channel.type = ChannelType::kFloat;
    for (const Vec2& uv : frame.uv) channel.values.push_back(uv[k]);
  }
  for (const Cryptomatte& matte : frame.mattes) add_cryptomatte(matte, image);
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
