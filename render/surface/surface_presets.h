#ifndef HEDDLE_RENDER_SURFACE_SURFACE_PRESETS_H_
#define HEDDLE_RENDER_SURFACE_SURFACE_PRESETS_H_
// The surface fabrics that Heddle knows by name. They are the files configs/fabrics/NAME.toml with
// a key `model`, built into the program, so that a name works wherever it runs. Tested in
// tests/render/surface/surface_presets_test.cpp.

#include <string>
#include <string_view>
#include <vector>

#include "formats/toml_table.h"

namespace heddle {

/// Names of all presets, or of those of one model, sorted.
std::vector<std::string> surface_preset_names(std::string_view model = {});

/// The config of a preset, a fresh document; ConfigError that lists the known names where there is
/// none.
TomlTable surface_preset(std::string_view name);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_SURFACE_PRESETS_H_
