#ifndef HEDDLE_PIPELINE_DRAFT_REPORT_H_
#define HEDDLE_PIPELINE_DRAFT_REPORT_H_
// What `heddle info` says of a weave and of a weaver's draft. Tested in
// tests/pipeline/draft_report_test.cpp.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "fibers/cloth/weave.h"
#include "formats/wif_file.h"

namespace heddle {

/// Adds what is known of the weave: repeat, floats, interlacing, share of the warp, its drawing,
/// and warnings, those of its reader and of cloth that falls apart. Density, cover and colours are
/// added where the weave comes from a draft that states them.
void describe_weave(const Weave& weave, nlohmann::ordered_json& report);

/// The kind, title, shafts and shed of a draft, and its weave.
nlohmann::ordered_json describe_draft(const std::filesystem::path& path);

/// Lines of text: # where the warp is over, . where the weft is, the last pick at the top. Of a
/// large weave the first ends and picks.
std::vector<std::string> draw_weave(const Weave& weave);

/// The same with the threading above it, the tie-up beside that, and the treadling or the lift plan
/// at the right.
std::vector<std::string> draw_draft(const WifDraft& draft);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_DRAFT_REPORT_H_
