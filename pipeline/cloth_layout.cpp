#include "pipeline/cloth_layout.h"

#include <fmt/format.h>

#include <cmath>

#include "fibers/math/wrapped.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

/// Blocks that differ by less count as equally large: at a metre from the origin, a tenth of a
/// fiber's radius.
constexpr double kSameSize = 1e-6;

}  // namespace

std::optional<BlockLayout> block_layout(const ClothConfig& cloth,
                                        std::span<const FabricConfig* const> fabrics,
                                        const std::string& scene) {
  if (!cloth.blocks || fabrics.empty()) return {};
  const std::array<int, 2>& size = cloth.blocks->size_repeats;
  BlockLayout layout;
  layout.order = cloth.blocks->order;
  layout.seed = cloth.blocks->seed;
  for (const FabricConfig* fabric : fabrics) {
    if (fabric->knit || fabric->curves) {
      throw ConfigError(fmt::format("{}: blocks are repeats of a weave, and {} is not woven", scene,
                                    fabric->name));
    }
    if (fabric->repeats_x % size[0] != 0 || fabric->repeats_y % size[1] != 0) {
      throw ConfigError(fmt::format(
          "{}: blocks of {} x {} repeats do not divide the tile of {}, which has {} x {}", scene,
          size[0], size[1], fabric->name, fabric->repeats_x, fabric->repeats_y));
    }
    const auto [fit_x, fit_y] = fabric->fitting_blocks;
    if (layout.order == BlockOrder::kScattered && fit_x > 0 &&
        (size[0] % fit_x != 0 || size[1] % fit_y != 0)) {
      throw ConfigError(fmt::format(
          "{}: scattered blocks of {} x {} repeats would not fit each other: those of {} that do "
          "have {} x {} (fitting_repeats)",
          scene, size[0], size[1], fabric->name, fit_x, fit_y));
    }
    layout.tile_blocks.push_back({fabric->repeats_x / size[0], fabric->repeats_y / size[1]});
    const double width = size[0] * fabric->weave.ends * fabric->warp.spacing_mm;
    const double height = size[1] * fabric->weave.picks * fabric->weft.spacing_mm;
    if (fabric == fabrics.front()) {
      layout.width_mm = width;
      layout.height_mm = height;
    } else if (std::abs(width - layout.width_mm) > kSameSize * layout.width_mm ||
               std::abs(height - layout.height_mm) > kSameSize * layout.height_mm) {
      throw ConfigError(
          fmt::format("{}: the fabrics of a pattern need blocks of one size; {} x {} repeats of {} "
                      "are {:.6g} x "
                      "{:.6g} mm, those of {} are {:.6g} x {:.6g} mm",
                      scene, size[0], size[1], fabrics.front()->name, layout.width_mm,
                      layout.height_mm, fabric->name, width, height));
    }
  }
  if (!cloth.pattern) return layout;
  const PatternConfig& pattern = *cloth.pattern;
  layout.columns = pattern.columns;
  layout.rows = pattern.rows;
  layout.pattern.clear();
  for (int row = 0; row < pattern.rows; ++row) {
    for (int column = 0; column < pattern.columns; ++column) {
      const int from_row = wrapped(row - pattern.corner_blocks[1], pattern.rows);
      const int from_column = wrapped(column - pattern.corner_blocks[0], pattern.columns);
      const std::size_t from =
          static_cast<std::size_t>(from_row) * static_cast<std::size_t>(pattern.columns) +
          static_cast<std::size_t>(from_column);
      layout.pattern.push_back(
          {pattern.blocks[from], BlockLayout::kByOrder, BlockLayout::kByOrder});
    }
  }
  return layout;
}

}  // namespace heddle
