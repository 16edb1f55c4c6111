#ifndef HEDDLE_PIPELINE_FABRIC_REPORT_H_
#define HEDDLE_PIPELINE_FABRIC_REPORT_H_
// What `heddle info` says of a fabric config and of fibers: the cloth in the words and units of the
// trade, and its geometry. Tested in tests/pipeline/fabric_report_test.cpp.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "fibers/tracing/tile_scene.h"
#include "pipeline/stages.h"

namespace heddle {

/// Four digits are enough for people.
double rounded(double value);

/// Adds counts, sizes, densities and interpenetration of the fibers.
void describe_exemplar(const TileScene& fibers, std::uint64_t seed, nlohmann::ordered_json& report);

/// Weave, threads and yarns, then the exemplar that the config gives; `fibers` where it is at hand,
/// else it is made. Errors: ConfigError naming
/// the file where yarns jam.
nlohmann::ordered_json fabric_report(const FabricDocument& fabric,
                                     const TileScene* fibers = nullptr);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_FABRIC_REPORT_H_
