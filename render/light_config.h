#ifndef HEDDLE_RENDER_LIGHT_CONFIG_H_
#define HEDDLE_RENDER_LIGHT_CONFIG_H_
// What a [[light]] of a scene says. Keys, units and ranges: configs/README.md. Errors: ConfigError
// with its place; FileError for pictures of light. Tested in tests/render/scene_config_test.cpp.

#include <filesystem>
#include <vector>

#include "formats/toml_table.h"
#include "render/lights.h"

namespace heddle {

/// Adds the files that the light was read from to `files`.
Light read_light(const TomlTable& table, std::vector<std::filesystem::path>& files);

}  // namespace heddle

#endif  // HEDDLE_RENDER_LIGHT_CONFIG_H_
