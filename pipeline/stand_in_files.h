#ifndef HEDDLE_PIPELINE_STAND_IN_FILES_H_
#define HEDDLE_PIPELINE_STAND_IN_FILES_H_
// A fabric's stand-in as files for renderers that have no fibers (docs/export.md): maps as PNG, a
// material as MaterialX text, and a piece of cloth as glTF. Tested in
// tests/pipeline/export_test.cpp.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "render/stand_in/stand_in.h"

namespace heddle {

/// Is this the name of a file that write_stand_in makes?
bool is_stand_in_file(std::string_view name);

/// Writes all files into the folder, which exists. `name`: of the fabric. `picture`: of the
/// stand-in, [texel], to lie beside that of the fibers in the maps. `report` goes into
/// stand_in.json.
void write_stand_in(const std::filesystem::path& folder, const std::string& name,
                    const StandIn& stand_in, const std::vector<Rgb>& picture,
                    const nlohmann::ordered_json& report);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_STAND_IN_FILES_H_
