#include "pipeline/stand_in_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include "formats/atomic_file.h"
#include "formats/image_file.h"
#include "pipeline/chart/xml_text.h"
#include "pipeline/json_file.h"
#include "render/tone_map.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::array<std::string_view, 15> kNames = {
    "base_color.png",      "opacity.png",          "normal.png",          "tangent.png",
    "roughness_along.png", "roughness_across.png", "height.png",          "preview.png",
    "gltf_base_color.png", "gltf_roughness.png",   "gltf_anisotropy.png", "stand_in.mtlx",
    "stand_in.gltf",       "stand_in.bin",         "stand_in.json"};

/// Along each side of the piece of cloth in the glTF file.
constexpr int kRepeats = 4;

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

std::uint8_t byte_of_signed(double value) {
  return byte_of(0.5 + 0.5 * value);
}

/// An alpha of GGX as renderers take roughness.
double roughness_of(double alpha) {
  return std::sqrt(alpha);
}

/// One map under construction, texel by texel.
using Samples = std::vector<std::uint8_t>;

void append(Samples& samples, std::initializer_list<std::uint8_t> values) {
  samples.insert(samples.end(), values);
}

/// What KHR_materials_anisotropy calls strength: alpha across = mix(alpha along, 1, strength^2).
double gltf_anisotropy(const StandInTexel& texel) {
  if (!(texel.alpha_along < 1)) return 0;
  return std::sqrt((texel.alpha_across - texel.alpha_along) / (1 - texel.alpha_along));
}

void write_maps(const fs::path& folder, const StandIn& stand_in) {
  const FlatMaps& maps = stand_in.maps();
  std::vector<Rgb> colors;
  for (std::size_t k = 0; k < maps.texel_count(); ++k)
    colors.push_back(stand_in.texel(k).base_color.cast<float>());
  const Samples color = tone_map(colors, {});
  Samples opacity, normal, tangent, along, across, color_alpha, roughness, anisotropy;
  const auto [low, high] = maps.relief_range_mm();
  std::vector<std::uint16_t> relief;
  for (std::size_t k = 0; k < maps.texel_count(); ++k) {
    const StandInTexel texel = stand_in.texel(k);
    const std::uint8_t cover = byte_of(texel.opacity);
    const auto x = static_cast<double>(maps.along[k].x());
    const auto y = static_cast<double>(maps.along[k].y());
    const std::uint8_t rough_along = byte_of(roughness_of(texel.alpha_along));
    append(opacity, {cover});
    append(normal, {byte_of_signed(texel.normal.x()), byte_of_signed(texel.normal.y()),
                    byte_of_signed(texel.normal.z())});
    append(tangent, {byte_of_signed(x), byte_of_signed(y), byte_of_signed(0)});
    append(along, {rough_along});
    append(across, {byte_of(roughness_of(texel.alpha_across))});
    append(color_alpha, {color[3 * k], color[3 * k + 1], color[3 * k + 2], cover});
    append(roughness, {255, rough_along, 0});
    append(anisotropy, {byte_of_signed(x), byte_of_signed(y), byte_of(gltf_anisotropy(texel))});
    const float range = std::max(high - low, 1e-9F);
    relief.push_back(
        static_cast<std::uint16_t>(std::lround(65535 * (maps.relief_mm[k] - low) / range)));
  }
  write_png(folder / "base_color.png", maps.width, maps.height, color);
  write_png(folder / "gltf_base_color.png", maps.width, maps.height, color_alpha);
  const auto write = [&](const char* name, const auto& samples) {
    write_data_png(folder / name, maps.width, maps.height, samples);
  };
  write("opacity.png", opacity);
  write("normal.png", normal);
  write("tangent.png", tangent);
  write("roughness_along.png", along);
  write("roughness_across.png", across);
  write("height.png", relief);
  write("gltf_roughness.png", roughness);
  write("gltf_anisotropy.png", anisotropy);
}

void write_preview(const fs::path& folder, const FlatMaps& maps, const std::vector<Rgb>& picture) {
  constexpr int kGap = 8;
  const auto width = static_cast<std::size_t>(maps.width);
  std::vector<Rgb> both;
  for (std::size_t row = 0; row < static_cast<std::size_t>(maps.height); ++row) {
    const auto begin = static_cast<std::ptrdiff_t>(row * width);
    const auto end = static_cast<std::ptrdiff_t>((row + 1) * width);
    both.insert(both.end(), maps.picture.begin() + begin, maps.picture.begin() + end);
    both.insert(both.end(), kGap, Rgb::Ones());
    both.insert(both.end(), picture.begin() + begin, picture.begin() + end);
  }
  write_png(folder / "preview.png", 2 * maps.width + kGap, maps.height, tone_map(both, {}));
}

std::string color_text(const Rgbd& color) {
  return fmt::format("{:.5g}, {:.5g}, {:.5g}", color[0], color[1], color[2]);
}

// Names of nodes are fixed. The size of the tile stands twice: as the constant that it is, and as
// the default of what users set.
constexpr char kMaterialX[] = R"(<?xml version="1.0"?>
<materialx version="1.38" colorspace="lin_rec709">
  <!-- {comment}: {name}. The maps show one repeat of {width:.6g} x {height:.6g} mm.
       uv_size_mm is the size of one unit of UV on the mesh, in mm; by default it is one repeat. -->
  <nodegraph name="NG_cloth">
    <input name="uv_size_mm" type="vector2" value="{width:.6g}, {height:.6g}" />
    <texcoord name="uv" type="vector2" />
    <multiply name="uv_mm" type="vector2">
      <input name="in1" type="vector2" nodename="uv" />
      <input name="in2" type="vector2" interfacename="uv_size_mm" />
    </multiply>
    <divide name="uv_repeats" type="vector2">
      <input name="in1" type="vector2" nodename="uv_mm" />
      <input name="in2" type="vector2" value="{width:.6g}, {height:.6g}" />
    </divide>
{images}    <convert name="opacity_color" type="color3">
      <input name="in" type="float" nodename="opacity" />
    </convert>
    <normalmap name="normal_world" type="vector3">
      <input name="in" type="vector3" nodename="normal" />
    </normalmap>
    <normalmap name="tangent_world" type="vector3">
      <input name="in" type="vector3" nodename="tangent" />
    </normalmap>
    <multiply name="roughness_product" type="float">
      <input name="in1" type="float" nodename="roughness_along" />
      <input name="in2" type="float" nodename="roughness_across" />
    </multiply>
    <sqrt name="specular_roughness" type="float">
      <input name="in" type="float" nodename="roughness_product" />
    </sqrt>
    <divide name="roughness_ratio" type="float">
      <input name="in1" type="float" nodename="roughness_along" />
      <input name="in2" type="float" nodename="roughness_across" />
    </divide>
    <multiply name="alpha_ratio" type="float">
      <input name="in1" type="float" nodename="roughness_ratio" />
      <input name="in2" type="float" nodename="roughness_ratio" />
    </multiply>
    <subtract name="specular_anisotropy" type="float">
      <input name="in1" type="float" value="1" />
      <input name="in2" type="float" nodename="alpha_ratio" />
    </subtract>
    <multiply name="subsurface_color" type="color3">
      <input name="in1" type="color3" nodename="base_color" />
      <input name="in2" type="color3" value="{tint}" />
    </multiply>
    <clamp name="subsurface_color_1" type="color3">
      <input name="in" type="color3" nodename="subsurface_color" />
    </clamp>
    <output name="base_color_out" type="color3" nodename="base_color" />
    <output name="subsurface_color_out" type="color3" nodename="subsurface_color_1" />
    <output name="opacity_out" type="color3" nodename="opacity_color" />
    <output name="normal_out" type="vector3" nodename="normal_world" />
    <output name="tangent_out" type="vector3" nodename="tangent_world" />
    <output name="roughness_out" type="float" nodename="specular_roughness" />
    <output name="anisotropy_out" type="float" nodename="specular_anisotropy" />
  </nodegraph>
  <standard_surface name="SR_cloth" type="surfaceshader">
    <input name="base" type="float" value="1" />
    <input name="base_color" type="color3" nodegraph="NG_cloth" output="base_color_out" />
    <input name="specular" type="float" value="1" />
    <input name="specular_color" type="color3" value="{specular_color}" />
    <input name="specular_IOR" type="float" value="{ior:.5g}" />
    <input name="specular_roughness" type="float" nodegraph="NG_cloth" output="roughness_out" />
    <input name="specular_anisotropy" type="float" nodegraph="NG_cloth" output="anisotropy_out" />
    <!-- The gloss is widest across the fibers, a quarter turn from their tangent. -->
    <input name="specular_rotation" type="float" value="0.25" />
    <input name="subsurface" type="float" value="{subsurface:.5g}" />
    <input name="subsurface_color" type="color3" nodegraph="NG_cloth" output="subsurface_color_out" />
    <input name="thin_walled" type="boolean" value="true" />
    <input name="sheen" type="float" value="{sheen:.5g}" />
    <input name="sheen_color" type="color3" value="{sheen_color}" />
    <input name="sheen_roughness" type="float" value="{sheen_roughness:.5g}" />
    <input name="opacity" type="color3" nodegraph="NG_cloth" output="opacity_out" />
    <input name="normal" type="vector3" nodegraph="NG_cloth" output="normal_out" />
    <input name="tangent" type="vector3" nodegraph="NG_cloth" output="tangent_out" />
  </standard_surface>
  <surfacematerial name="M_cloth" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="SR_cloth" />
  </surfacematerial>
</materialx>
)";

std::string material_x(const std::string& name, const StandIn& stand_in) {
  struct Image {
    const char* name;
    const char* type;
    const char* colorspace;
  };
  constexpr std::array<Image, 6> kImages = {
      {{"base_color", "color3", " colorspace=\"srgb_texture\""},
       {"opacity", "float", ""},
       {"normal", "vector3", ""},
       {"tangent", "vector3", ""},
       {"roughness_along", "float", ""},
       {"roughness_across", "float", ""}}};
  std::string images;
  for (const Image& image : kImages) {
    images += fmt::format(
        "    <image name=\"{0}\" type=\"{1}\">\n"
        "      <input name=\"file\" type=\"filename\" value=\"{0}.png\"{2} />\n"
        "      <input name=\"texcoord\" type=\"vector2\" nodename=\"uv_repeats\" />\n"
        "    </image>\n",
        image.name, image.type, image.colorspace);
  }
  // Two hyphens would end the comment.
  std::string title = xml_text(name);
  std::replace(title.begin(), title.end(), '-', ' ');
  const StandInParameters& p = stand_in.parameters();
  return fmt::format(kMaterialX, fmt::arg("comment", "A stand-in for cloth"),
                     fmt::arg("name", title), fmt::arg("width", stand_in.maps().width_mm),
                     fmt::arg("height", stand_in.maps().height_mm), fmt::arg("images", images),
                     fmt::arg("tint", color_text(p.subsurface_tint)),
                     fmt::arg("specular_color", color_text(p.specular_color)),
                     fmt::arg("ior", p.ior()), fmt::arg("subsurface", p.subsurface),
                     fmt::arg("sheen", p.sheen), fmt::arg("sheen_color", color_text(p.sheen_color)),
                     fmt::arg("sheen_roughness", p.sheen_roughness));
}

Json gltf_material(const std::string& name, const StandIn& stand_in) {
  const StandInParameters& p = stand_in.parameters();
  const double reflected = 1 - p.subsurface;
  const auto texture = [](int index) { return Json{{"index", index}}; };
  Json material = {
      {"name", name},
      {"doubleSided", true},
      {"pbrMetallicRoughness",
       {{"baseColorTexture", texture(0)},
        {"baseColorFactor", {reflected, reflected, reflected, 1.0}},
        {"metallicFactor", 0.0},
        {"roughnessFactor", 1.0},
        {"metallicRoughnessTexture", texture(2)}}},
      {"normalTexture", texture(1)},
      {"extensions",
       {{"KHR_materials_anisotropy",
         {{"anisotropyStrength", 1.0},
          {"anisotropyRotation", kPi / 2},
          {"anisotropyTexture", texture(3)}}},
        {"KHR_materials_ior", {{"ior", p.ior()}}},
        {"KHR_materials_sheen",
         {{"sheenColorFactor", numbers_of(p.sheen * p.sheen_color)},
          {"sheenRoughnessFactor", std::sqrt(p.sheen_roughness)}}},
        {"KHR_materials_specular", {{"specularColorFactor", numbers_of(p.specular_color)}}}}}};
  // A few gaps do not pay for what blending costs a renderer.
  constexpr double kOpaque = 0.995;
  material["alphaMode"] = stand_in.maps().cover() < kOpaque ? "BLEND" : "OPAQUE";
  return material;
}

void append_floats(std::string& bytes, std::span<const float> values) {
  static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");
  const std::size_t at = bytes.size();
  bytes.resize(at + values.size_bytes());
  std::memcpy(bytes.data() + at, values.data(), values.size_bytes());
}

/// A flat piece of kRepeats x kRepeats repeats, in metres, facing +z, and its buffer.
Json gltf_of(const std::string& name, const StandIn& stand_in, std::string& buffer) {
  const float width = kRepeats * stand_in.maps().width_mm / 1000;
  const float height = kRepeats * stand_in.maps().height_mm / 1000;
  struct Attribute {
    const char* name;
    const char* type;
    std::size_t components;
    std::vector<float> values;
  };
  const auto repeats = static_cast<float>(kRepeats);
  // Images have their origin at the upper left corner.
  const std::vector<Attribute> attributes = {
      {"POSITION", "VEC3", 3, {0, 0, 0, width, 0, 0, width, height, 0, 0, height, 0}},
      {"NORMAL", "VEC3", 3, {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}},
      {"TANGENT", "VEC4", 4, {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}},
      {"TEXCOORD_0", "VEC2", 2, {0, repeats, repeats, repeats, repeats, 0, 0, 0}}};
  Json views = Json::array();
  Json accessors = Json::array();
  Json places = Json::object();
  constexpr int kFloat = 5126;
  constexpr int kUnsignedShort = 5123;
  constexpr int kVertices = 34962;
  constexpr int kIndices = 34963;
  for (const Attribute& attribute : attributes) {
    places[attribute.name] = accessors.size();
    Json accessor = {{"bufferView", views.size()},
                     {"componentType", kFloat},
                     {"count", 4},
                     {"type", attribute.type}};
    if (std::string_view(attribute.name) == "POSITION") {
      accessor["min"] = {0.0, 0.0, 0.0};
      accessor["max"] = {width, height, 0.0};
    }
    accessors.push_back(accessor);
    views.push_back({{"buffer", 0},
                     {"byteOffset", buffer.size()},
                     {"byteLength", attribute.values.size() * sizeof(float)},
                     {"target", kVertices}});
    append_floats(buffer, attribute.values);
  }
  constexpr std::array<char, 12> kTriangles = {0, 0, 1, 0, 2, 0, 0, 0, 2, 0, 3, 0};
  const std::size_t indices = accessors.size();
  accessors.push_back({{"bufferView", views.size()},
                       {"componentType", kUnsignedShort},
                       {"count", kTriangles.size() / 2},
                       {"type", "SCALAR"}});
  views.push_back({{"buffer", 0},
                   {"byteOffset", buffer.size()},
                   {"byteLength", kTriangles.size()},
                   {"target", kIndices}});
  buffer.append(kTriangles.data(), kTriangles.size());
  Json images = Json::array();
  Json textures = Json::array();
  for (const char* file :
       {"gltf_base_color.png", "normal.png", "gltf_roughness.png", "gltf_anisotropy.png"}) {
    textures.push_back({{"sampler", 0}, {"source", images.size()}});
    images.push_back({{"uri", file}});
  }
  constexpr int kRepeat = 10497;
  constexpr int kLinear = 9729;
  constexpr int kLinearMipmaps = 9987;
  const Json sampler = {{"magFilter", kLinear},
                        {"minFilter", kLinearMipmaps},
                        {"wrapS", kRepeat},
                        {"wrapT", kRepeat}};
  const Json primitive = {{"attributes", places}, {"indices", indices}, {"material", 0}};
  return {{"asset", {{"version", "2.0"}, {"generator", "heddle export"}}},
          {"extensionsUsed",
           {"KHR_materials_anisotropy", "KHR_materials_ior", "KHR_materials_sheen",
            "KHR_materials_specular"}},
          {"scene", 0},
          {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
          {"nodes", Json::array({{{"mesh", 0}, {"name", name}}})},
          {"meshes", Json::array({{{"primitives", Json::array({primitive})}}})},
          {"materials", Json::array({gltf_material(name, stand_in)})},
          {"textures", textures},
          {"images", images},
          {"samplers", Json::array({sampler})},
          {"accessors", accessors},
          {"bufferViews", views},
          {"buffers", Json::array({{{"uri", "stand_in.bin"}, {"byteLength", buffer.size()}}})}};
}

}  // namespace

bool is_stand_in_file(std::string_view name) {
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

void write_stand_in(const fs::path& folder, const std::string& name, const StandIn& stand_in,
                    const std::vector<Rgb>& picture, const Json& report) {
  write_maps(folder, stand_in);
  write_preview(folder, stand_in.maps(), picture);
  write_file_atomically(folder / "stand_in.mtlx", material_x(name, stand_in));
  std::string buffer;
  const Json gltf = gltf_of(name, stand_in, buffer);
  write_file_atomically(folder / "stand_in.bin", buffer);
  write_file_atomically(folder / "stand_in.gltf", gltf.dump(2) + "\n");
  write_file_atomically(folder / "stand_in.json", report.dump(2) + "\n");
}

}  // namespace heddle
