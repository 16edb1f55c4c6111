#include "fibers/tracing/block_layout.h"

#include "fibers/math/random.h"
#include "fibers/math/wrapped.h"

namespace heddle {
namespace {

int place_of(std::int64_t place, int count) {
  return static_cast<int>(wrapped<std::int64_t>(place, count));
}

}  // namespace

BlockLayout::Block BlockLayout::at(std::int64_t column, std::int64_t row) const {
  Block block =
      pattern[static_cast<std::size_t>(place_of(row, rows)) * static_cast<std::size_t>(columns) +
              static_cast<std::size_t>(place_of(column, columns))];
  if (block.column != kByOrder) return block;
  const std::array<int, 2>& blocks = tile_blocks[block.exemplar];
  if (order == BlockOrder::kScattered) {
    RandomStream random(seed, RandomStage::kBlockOrder, static_cast<std::uint64_t>(column),
                        static_cast<std::uint64_t>(row));
    block.column = static_cast<int>(random.index(static_cast<std::uint64_t>(blocks[0])));
    block.row = static_cast<int>(random.index(static_cast<std::uint64_t>(blocks[1])));
  } else {
    block.column = place_of(column, blocks[0]);
    block.row = place_of(row, blocks[1]);
  }
  return block;
}

}  // namespace heddle
