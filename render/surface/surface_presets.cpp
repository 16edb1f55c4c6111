#include "render/surface/surface_presets.h"

#include <fmt/format.h>

#include "formats/input_error.h"
#include "render/surface/built_in_config.h"

namespace heddle {

std::vector<std::string> surface_preset_names(std::string_view model) {
  std::vector<std::string> names;
  for (const BuiltInConfig& config : built_in_surface_configs()) {
    if (model.empty() || config.model == model) names.emplace_back(config.name);
  }
  return names;
}

TomlTable surface_preset(std::string_view name) {
  for (const BuiltInConfig& config : built_in_surface_configs()) {
    if (config.name == name) return TomlTable::parse(config.text, fmt::format("{}.toml", name));
  }
  throw ConfigError(fmt::format("no surface fabric called {}; known: {}", name,
                                fmt::join(surface_preset_names(), ", ")));
}

}  // namespace heddle
