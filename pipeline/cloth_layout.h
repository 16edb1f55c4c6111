#ifndef HEDDLE_PIPELINE_CLOTH_LAYOUT_H_
#define HEDDLE_PIPELINE_CLOTH_LAYOUT_H_
// What a scene says of the blocks of a cloth, and what its fabrics say of their weaves, put
// together. Tested in tests/pipeline/cloth_layout_test.cpp.

#include <optional>
#include <span>
#include <string>

#include "fibers/cloth/fabric_config.h"
#include "fibers/tracing/block_layout.h"
#include "render/scene_config.h"

namespace heddle {

/// Nothing where the cloth has no blocks. fabrics: those of fabric_files(cloth). Errors:
/// ConfigError naming `scene`, with the numbers, where blocks are not equally large or do not
/// divide a tile.
std::optional<BlockLayout> block_layout(const ClothConfig& cloth,
                                        std::span<const FabricConfig* const> fabrics,
                                        const std::string& scene);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CLOTH_LAYOUT_H_
