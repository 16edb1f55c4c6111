#ifndef HEDDLE_RENDER_SURFACE_BUILT_IN_CONFIG_H_
#define HEDDLE_RENDER_SURFACE_BUILT_IN_CONFIG_H_
// What surface_presets.cmake makes of the configs of surface fabrics.

#include <span>
#include <string_view>

namespace heddle {

struct BuiltInConfig {
  std::string_view name;
  std::string_view model;
  std::string_view text;  // TOML
};

/// Sorted by name.
std::span<const BuiltInConfig> built_in_surface_configs();

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_BUILT_IN_CONFIG_H_
