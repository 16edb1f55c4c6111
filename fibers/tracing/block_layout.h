#ifndef HEDDLE_FIBERS_TRACING_BLOCK_LAYOUT_H_
#define HEDDLE_FIBERS_TRACING_BLOCK_LAYOUT_H_
// What lies where on the cloth's plane: a grid of equal blocks without end, and for each of them
// which exemplar lies there and which block of its tile (Khungurn 2017, section 2 and 6.4). Block
// (column, row) covers [column, column + 1) x [row, row + 1) block sizes; x runs along the weft, y
// along the warp. Tested in tests/fibers/tracing/cloth_tiling_test.cpp.

#include <array>
#include <cstdint>
#include <vector>

namespace heddle {

/// Which block of an exemplar's tile lies at a place of its.
enum class BlockOrder : std::uint8_t {
  kAligned,    // as in the tile: equal neighbours fit
  kScattered,  // any, drawn for each block: fibers jump at the borders of blocks
};

struct BlockLayout {
  struct Block {
    std::uint32_t exemplar = 0;
    int column = 0;  // of the exemplar's tile
    int row = 0;
  };
  /// In a pattern: the column and row are those that the order gives to the place.
  static constexpr int kByOrder = -1;

  double width_mm = 0;  // of a block
  double height_mm = 0;
  // [exemplar] blocks in its tile along x and y
  std::vector<std::array<int, 2>> tile_blocks;
  // The pattern, repeated without end: [row][column], rows upwards.
  int columns = 1;
  int rows = 1;
  std::vector<Block> pattern = {{0, kByOrder, kByOrder}};
  BlockOrder order = BlockOrder::kAligned;
  std::uint64_t seed = 1;  // of the order

  Block at(std::int64_t column, std::int64_t row) const;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_BLOCK_LAYOUT_H_
