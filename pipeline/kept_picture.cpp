#include "pipeline/kept_picture.h"

#include <fmt/format.h>

#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "formats/input_error.h"
#include "pipeline/version.h"
#include "render/kept_samples.h"

namespace heddle {
namespace {

using Json = nlohmann::ordered_json;

// Of the bytes of chunks.
constexpr int kLayout = 1;

}  // namespace

std::string kept_text(const KeptPicture& kept) {
  Json json = {{"layout", kLayout},
               {"program_version", kProgramVersion},
               {"scene", kept.scene},
               {"view", kept.view},
               {"method", render_method_name(kept.method)},
               {"spp", kept.spp},
               {"seed", kept.seed},
               {"crop", {kept.crop.x0, kept.crop.y0, kept.crop.width, kept.crop.height}},
               {"order", kept.order ? Json(*kept.order) : Json()},
               {"has_light", kept.has_light},
               {"parts", Json::array()},
               {"groups", Json::array()}};
  for (const auto& [name, hash] : kept.parts) json["parts"].push_back({name, hash});
  for (const KeptPicture::Group& group : kept.groups)
    json["groups"].push_back({group.visibility, group.light});
  return json.dump();
}

KeptPicture read_kept(const ChunkFile& file) {
  KeptPicture kept;
  try {
    const Json json = Json::parse(file.description());
    if (json.at("layout") != kLayout) {
      throw FileError(fmt::format("{}: kept by another version of the program ({})",
                                  file.path().string(),
                                  json.at("program_version").get<std::string>()));
    }
    kept.scene = json.at("scene");
    kept.view = json.at("view");
    kept.method = render_method_of(json.at("method").get<std::string>()).value();
    kept.spp = json.at("spp");
    kept.seed = json.at("seed");
    const auto crop = json.at("crop").get<std::array<int, 4>>();
    kept.crop = {crop[0], crop[1], crop[2], crop[3]};
    if (!json.at("order").is_null()) kept.order = json.at("order").get<int>();
    kept.has_light = json.at("has_light");
    for (const Json& part : json.at("parts")) kept.parts.emplace_back(part.at(0), part.at(1));
    for (const Json& group : json.at("groups")) kept.groups.push_back({group.at(0), group.at(1)});
  } catch (const FileError&) {
    throw;
  } catch (const std::exception&) {
    throw FileError(file.path().string() + ": its description is none of a G-buffer");
  }
  return kept;
}

void require_same_parts(const std::vector<std::pair<std::string, std::string>>& of_scene,
                        const KeptPicture& kept, const std::string& scene,
                        const std::string& file) {
  const std::map<std::string, std::string> now(of_scene.begin(), of_scene.end());
  const std::map<std::string, std::string> then(kept.parts.begin(), kept.parts.end());
  std::string different;
  const auto note = [&](const std::string& name) {
    different += (different.empty() ? "" : ", ") + name;
  };
  for (const auto& [name, hash] : kept.parts) {
    const auto own = now.find(name);
    if (own == now.end() || own->second != hash) note(name);
  }
  for (const auto& [name, hash] : of_scene) {
    if (!then.contains(name)) note(name);
  }
  if (different.empty()) return;
  throw ConfigError(
      fmt::format("{}: differs from what {} was kept from in more than its lights: {}. Render it "
                  "again with --keep.",
                  scene, file, different));
}

void require_all_chunks(const KeptPicture& kept, const CameraConfig& camera,
                        const ChunkFile& file) {
  const PixelRect& crop = kept.crop;
  const bool is_inside = crop.x0 >= 0 && crop.y0 >= 0 && crop.width > 0 && crop.height > 0 &&
                         crop.width <= camera.width - crop.x0 &&
                         crop.height <= camera.height - crop.y0;
  if (is_inside && kept.spp > 0 &&
      file.count() ==
          static_cast<std::size_t>(PictureBlocks{crop}.count()) * chunks_of_block(kept.spp))
    return;
  throw FileError(file.path().string() + ": does not hold the samples that it says");
}

}  // namespace heddle
