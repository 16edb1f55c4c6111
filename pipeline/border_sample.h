#ifndef HEDDLE_PIPELINE_BORDER_SAMPLE_H_
#define HEDDLE_PIPELINE_BORDER_SAMPLE_H_
// Borders between the weaves of a pattern that are woven, not cut. One piece of cloth, the sample,
// is woven as a whole from several base weaves, and its map of blocks is chosen so that it holds as
// many of the pattern's neighbourhoods as possible: each block with the eight around it. Every
// block of the pattern then shows the sample's block with the same neighbours, or the most similar
// one. Yarns run from weave to weave as they would in the cloth, and visibility and transfer are
// baked with the neighbours that are there. Blocks that fit equally well are drawn at random, which
// breaks up repeats.
//
// The map begins as that rectangle of the pattern which holds the most. Single blocks are then
// changed as long as that helps. A pattern that is not larger than the sample is its own map: the
// cloth is then woven exactly. Tested in tests/pipeline/border_sample_test.cpp.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fibers/cloth/fabric_config.h"
#include "pipeline/stages.h"
#include "render/scene_config.h"

namespace heddle {

/// A map of blocks, periodic: [row][column] which fabric of the pattern, rows upwards.
struct BlockMap {
  int columns = 1;
  int rows = 1;
  std::vector<std::uint16_t> fabric = {0};

  std::uint16_t at(int column, int row) const;
};

struct BorderSample {
  BlockMap map;
  // [row][column] of the pattern: the block of the map that lies there
  std::vector<std::array<int, 2>> block;
  // Share of the pattern's blocks whose eight, and whose four nearest, neighbours are as in the
  // map.
  double eight_fit = 0;
  double four_fit = 0;
};

/// most_blocks: of the map, at least 4.
BorderSample choose_border_sample(const BlockMap& pattern, int most_blocks, std::uint64_t seed);

/// The fabric of the map. documents: of the pattern's fabrics; they may differ in weave, repeats,
/// name and seed only. size_repeats: of a block. Errors: ConfigError naming the fabrics that
/// differ.
FabricDocument woven_sample(const BlockMap& map, std::span<const FabricDocument* const> documents,
                            const std::array<int, 2>& size_repeats);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_BORDER_SAMPLE_H_
