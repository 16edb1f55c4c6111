#include "pipeline/border_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "fibers/math/random.h"
#include "fibers/math/wrapped.h"
#include "formats/content_hash.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

constexpr int kChanges = 4000;       // tried, of single blocks
constexpr double kFourWeight = 0.3;  // of the four nearest neighbours beside all eight

/// The block itself, the four nearest, the corners.
constexpr std::array<std::array<int, 2>, 9> kAround = {
    {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
using Neighbourhood = std::array<std::uint16_t, 9>;

Neighbourhood around(const BlockMap& map, int column, int row, std::size_t count = 9) {
  Neighbourhood result{};
  for (std::size_t k = 0; k < count; ++k)
    result[k] = map.at(column + kAround[k][0], row + kAround[k][1]);
  return result;
}

using Shares = std::map<Neighbourhood, double>;

/// How often each neighbourhood occurs, of all blocks.
Shares shares_of(const BlockMap& map, std::size_t count) {
  Shares shares;
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column)
      shares[around(map, column, row, count)] += 1.0 / (map.columns * map.rows);
  }
  return shares;
}

/// The share of the pattern's blocks that a map holds with their neighbours.
class Fit {
 public:
  explicit Fit(const BlockMap& pattern)
      : eight_(shares_of(pattern, 9)), four_(shares_of(pattern, 5)) {}

  double eight(const BlockMap& map) const { return held(map, eight_, 9); }
  double four(const BlockMap& map) const { return held(map, four_, 5); }
  double of(const BlockMap& map) const { return eight(map) + kFourWeight * four(map); }

 private:
  static double held(const BlockMap& map, const Shares& wanted, std::size_t count) {
    double sum = 0;
    for (const auto& [neighbourhood, share] : shares_of(map, count)) {
      const auto found = wanted.find(neighbourhood);
      if (found != wanted.end()) sum += found->second;
    }
    return sum;
  }
  Shares eight_;
  Shares four_;
};

BlockMap part_of(const BlockMap& pattern, int left, int low, int columns, int rows) {
  BlockMap map{columns, rows, {}};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column)
      map.fabric.push_back(pattern.at(left + column, low + row));
  }
  return map;
}

BlockMap choose_map(const BlockMap& pattern, int most_blocks, std::uint64_t seed) {
  if (pattern.columns * pattern.rows <= most_blocks) return pattern;
  const int columns = std::min(pattern.columns, static_cast<int>(std::sqrt(most_blocks)));
  const int rows = std::min(pattern.rows, most_blocks / columns);
  const Fit fit(pattern);
  // Some thousand places are tried at most.
  const int step = std::max(
      1, static_cast<int>(std::sqrt(static_cast<double>(pattern.columns) * pattern.rows / 2000)));
  BlockMap best;
  double best_fit = -1;
  for (int low = 0; low < pattern.rows; low += step) {
    for (int left = 0; left < pattern.columns; left += step) {
      BlockMap map = part_of(pattern, left, low, columns, rows);
      const double value = fit.of(map);
      if (value <= best_fit) continue;
      best_fit = value;
      best = std::move(map);
    }
  }
  const std::uint16_t fabrics = 1 + *std::max_element(pattern.fabric.begin(), pattern.fabric.end());
  RandomStream random(seed, RandomStage::kBlockOrder, 0, 1);
  for (int k = 0; k < kChanges; ++k) {
    std::uint16_t& block = best.fabric[random.index(best.fabric.size())];
    const std::uint16_t before = block;
    block = static_cast<std::uint16_t>(random.index(fabrics));
    const double value = fit.of(best);
    if (value >= best_fit) {
      best_fit = value;
    } else {
      block = before;
    }
  }
  return best;
}

/// How well a block of the map stands for one of the pattern: its own weave before all, near
/// neighbours before corners.
int likeness(const Neighbourhood& a, const Neighbourhood& b) {
  int sum = 0;
  for (std::size_t k = 0; k < 9; ++k) sum += a[k] == b[k] ? (k == 0 ? 100 : (k < 5 ? 5 : 1)) : 0;
  return sum;
}

/// What a fabric's config says beside its weave.
nlohmann::json beside_weave(const FabricDocument& document) {
  nlohmann::json json = nlohmann::json::parse(document.cloth_text);
  for (const char* key : {"name", "seed", "weave"}) json.erase(key);
  return {json, document.visibility_text, document.transfer_text, document.volume_text,
          document.transfer.order};
}

}  // namespace

std::uint16_t BlockMap::at(int column, int row) const {
  return fabric[static_cast<std::size_t>(wrapped(row, rows)) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(wrapped(column, columns))];
}

BorderSample choose_border_sample(const BlockMap& pattern, int most_blocks, std::uint64_t seed) {
  BorderSample sample;
  sample.map = choose_map(pattern, most_blocks, seed);
  const Fit fit(pattern);
  sample.eight_fit = fit.eight(sample.map);
  sample.four_fit = fit.four(sample.map);
  const bool is_pattern = sample.map.columns == pattern.columns &&
                          sample.map.rows == pattern.rows && sample.map.fabric == pattern.fabric;
  for (int row = 0; row < pattern.rows; ++row) {
    for (int column = 0; column < pattern.columns; ++column) {
      if (is_pattern) {
        sample.block.push_back({column, row});
        continue;
      }
      const Neighbourhood wanted = around(pattern, column, row);
      RandomStream random(seed, RandomStage::kBlockOrder, static_cast<std::uint64_t>(column),
                          static_cast<std::uint64_t>(row) + 2);
      int best = -1;
      std::vector<std::array<int, 2>> equal;
      for (int y = 0; y < sample.map.rows; ++y) {
        for (int x = 0; x < sample.map.columns; ++x) {
          const int value = likeness(wanted, around(sample.map, x, y));
          if (value > best) equal.clear();
          if (value >= best) equal.push_back({x, y});
          best = std::max(best, value);
        }
      }
      sample.block.push_back(equal[random.index(equal.size())]);
    }
  }
  return sample;
}

FabricDocument woven_sample(const BlockMap& map, std::span<const FabricDocument* const> documents,
                            const std::array<int, 2>& size_repeats) {
  FabricDocument sample = *documents.front();
  for (const FabricDocument* document : documents) {
    if (beside_weave(*document) != beside_weave(sample)) {
      throw ConfigError(fmt::format(
          "{}: woven borders need fabrics that differ in their weave only; {} differs in more",
          sample.file.string(), document->file.string()));
    }
  }
  const int ends = size_repeats[0] * sample.config.weave.ends;
  const int picks = size_repeats[1] * sample.config.weave.picks;
  Weave weave;
  weave.notation = "pattern";
  weave.ends = map.columns * ends;
  weave.picks = map.rows * picks;
  std::string matrix;
  for (int pick = 0; pick < weave.picks; ++pick) {
    for (int end = 0; end < weave.ends; ++end) {
      const FabricDocument& document = *documents[map.at(end / ends, pick / picks)];
      weave.warp_up.push_back(document.config.weave.is_warp_up(end, pick) ? 1 : 0);
      matrix += weave.warp_up.back() != 0 ? '1' : '0';
    }
  }
  sample.config.name += ", woven borders";
  sample.config.weave = std::move(weave);
  sample.config.repeats_x = sample.config.repeats_y = 1;
  sample.cloth_text += fmt::format(" {} x {} {}", sample.config.weave.ends,
                                   sample.config.weave.picks, content_hash(matrix));
  return sample;
}

}  // namespace heddle
