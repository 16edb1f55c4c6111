#include "fibers/cloth/fabric_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "fibers/cloth/coarse_fabric.h"
#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/weave_config.h"

namespace heddle {
namespace {

constexpr double kMmPerUm = 1e-3;
constexpr std::size_t kMostRuns = 4096;
constexpr std::size_t kMostYarnsOfSequence = 16384;
constexpr std::size_t kMostNameCharacters = 40;

void check_tile(const TomlTable& weave, std::string_view key, double size_mm) {
  if (size_mm <= kMaxTileMm) return;
  weave.fail(key, fmt::format("expected a tile of at most {} mm, found {:g} mm: yarns of a repeat "
                              "x repeats x spacing_mm",
                              kMaxTileMm, size_mm));
}

/// "24 white" as 24 times "white", "white" as once; nothing where the number is none.
std::optional<std::pair<int, std::string>> parse_run(const std::string& text) {
  int count = 1;
  const char* end = text.data() + text.size();
  const auto number = std::from_chars(text.data(), end, count);
  if (number.ec != std::errc()) return std::pair(1, text);
  const auto name = text.find_first_not_of(' ', static_cast<std::size_t>(number.ptr - text.data()));
  if (count < 1 || name == std::string::npos || number.ptr == text.data() + name) return {};
  return std::pair(count, text.substr(name));
}

/// The yarns of one system in their order, from `sequence`, `yarn` or keys of the yarn itself.
std::vector<int> read_sequence(const TomlTable& table, const std::string& name,
                               FabricConfig& config) {
  const auto index_of = [&](const char* key, const std::string& yarn) {
    std::string known;
    for (std::size_t k = 0; k < config.yarns.size(); ++k) {
      if (config.yarns[k].name == yarn) return static_cast<int>(k);
      known += (known.empty() ? "" : ", ") + config.yarns[k].name;
    }
    table.fail(key, fmt::format("expected names of [yarn.NAME] tables ({}), found \"{}\"", known,
                                yarn.substr(0, kMostNameCharacters)));
  };
  if (table.has("yarn")) return {index_of("yarn", table.string("yarn"))};
  if (table.has("sequence")) {
    std::vector<int> sequence;
    for (const std::string& text : table.strings("sequence", 1, kMostRuns)) {
      const auto run = parse_run(text);
      if (!run || run->first + sequence.size() > kMostYarnsOfSequence) {
        table.fail(
            "sequence",
            fmt::format("expected runs such as \"24 white\" or \"white\", {} yarns in all at "
                        "most, found \"{}\"",
                        kMostYarnsOfSequence, text.substr(0, kMostNameCharacters)));
      }
      sequence.insert(sequence.end(), static_cast<std::size_t>(run->first),
                      index_of("sequence", run->second));
    }
    return sequence;
  }
  config.yarns.push_back(read_yarn(table, name, config.fibers));
  return {static_cast<int>(config.yarns.size()) - 1};
}

/// How often the repeat of the weave must be laid so that whole sequences fit.
int fitting_repeats(int of_weave, std::size_t of_sequence) {
  return std::lcm(of_weave, static_cast<int>(of_sequence)) / of_weave;
}

struct SystemKeys {
  const char* table;
  const char* repeats;
  int of_weave;  // yarns in a repeat of the weave
  int repeat_count;
};

/// Every thread of the weave's repeat in the colour that the draft gives it.
void take_draft_colors(const TomlTable& table, const SystemKeys& keys, FabricConfig& config,
                       ThreadSystem& system) {
  const bool is_warp = std::string_view(keys.table) == "warp";
  const DraftThreads& threads = is_warp ? config.weave.warp : config.weave.weft;
  if (threads.color.empty())
    table.fail("colors", "expected a [weave] draft that gives its threads colours");
  if (keys.of_weave % static_cast<int>(system.sequence.size()) != 0) {
    table.fail("sequence", fmt::format("expected a length that divides the {} threads of the draft",
                                       keys.of_weave));
  }
  std::map<std::pair<int, int>, int> dyed;  // by yarn and fiber
  std::vector<int> sequence;
  for (int k = 0; k < keys.of_weave; ++k) {
    const int plain = system.yarn_at(k);
    YarnConfig yarn = config.yarn(plain);
    const std::array<float, 3>& color = threads.color[static_cast<std::size_t>(k)];
    yarn.fiber = dyed_fiber(yarn.fiber, Rgbd(color[0], color[1], color[2]), config.fibers);
    const auto [found, is_new] =
        dyed.try_emplace({plain, yarn.fiber}, static_cast<int>(config.yarns.size()));
    if (is_new) {
      yarn.name += fmt::format(" in colour {}", dyed.size());
      config.yarns.push_back(std::move(yarn));
    }
    sequence.push_back(found->second);
  }
  system.sequence = std::move(sequence);
}

ThreadSystem read_system(const TomlTable& document, const SystemKeys& keys, FabricConfig& config) {
  const TomlTable table = document.table(keys.table);
  const TomlTable weave = document.table("weave");
  ThreadSystem system;
  system.spacing_mm = table.has("per_cm") ? 10 / table.number("per_cm", {.min = 0.1, .max = 1e4})
                                          : table.number("spacing_mm", {.min = 1e-3, .max = 100});
  if (table.has("per_cm") && table.has("spacing_mm"))
    table.fail("per_cm", "expected either per_cm or spacing_mm");
  system.sequence = read_sequence(table, keys.table, config);
  if (table.has("colors")) {
    table.choice("colors", {"draft"});
    take_draft_colors(table, keys, config, system);
  }
  const int count = keys.of_weave * keys.repeat_count;
  if (count % static_cast<int>(system.sequence.size()) != 0) {
    weave.fail(keys.repeats,
               fmt::format("expected a multiple of {}: {} yarns in the tile do not hold whole "
                           "sequences of {} in [{}]",
                           fitting_repeats(keys.of_weave, system.sequence.size()), count,
                           system.sequence.size(), keys.table));
  }
  double size = 0;
  for (int k = 0; k < count; ++k) size += config.room_mm(system, k);
  check_tile(weave, keys.repeats, size);
  for (int k = 0; k < static_cast<int>(system.sequence.size()); ++k) {
    const YarnConfig& yarn = config.yarn(system.yarn_at(k));
    const double room = config.room_mm(system, k);
    if (yarn.width_mm <= room) continue;
    const std::string what = fmt::format(
        "expected at most spacing_mm, {:.4g} mm here: neighbouring yarns overlap", room);
    if (table.has("width_mm")) table.fail("width_mm", what);
    table.fail(
        table.has("per_cm") ? "per_cm" : "spacing_mm",
        fmt::format("the yarn \"{}\" is {:.4g} mm wide and {:.4g} mm high, and has {:.4g} mm: "
                    "expected at most {:.4g} yarns per cm, or a finer yarn, or less flattening",
                    yarn.name, yarn.width_mm, yarn.height_mm, room, 10 / yarn.width_mm));
  }
  return system;
}

/// Blocks that fit: whole numbers of them in the tile, and of sequences in each.
void read_fitting_blocks(const TomlTable& weave, FabricConfig& config) {
  struct Along {
    const char* key;
    const char* repeats;
    int repeat_count;
    int of_weave;
    const ThreadSystem& system;
  };
  const Along alongs[] = {
      {"fitting_repeats_x", "repeats_x", config.repeats_x, config.weave.ends, config.warp},
      {"fitting_repeats_y", "repeats_y", config.repeats_y, config.weave.picks, config.weft}};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Along& along = alongs[axis];
    const std::optional<std::int64_t> size = weave.optional_integer(along.key, 1, 64);
    if (size.has_value() != weave.has(alongs[1 - axis].key)) {
      weave.fail(size ? along.key : alongs[1 - axis].key,
                 "expected both or none of fitting_repeats_x and fitting_repeats_y");
    }
    if (!size) continue;
    const int own = static_cast<int>(*size);
    if (along.repeat_count % own != 0) {
      weave.fail(along.key, fmt::format("expected a divisor of {}, which is {}", along.repeats,
                                        along.repeat_count));
    }
    const std::size_t sequence = along.system.sequence.size();
    if (static_cast<std::size_t>(own * along.of_weave) % sequence != 0) {
      weave.fail(along.key, fmt::format("expected a multiple of {}: blocks hold whole sequences",
                                        fitting_repeats(along.of_weave, sequence)));
    }
    for (const int k : along.system.sequence) {
      if (config.yarn(k).slubs.empty()) continue;
      weave.fail(along.key, fmt::format("expected no slubs: those of the yarn \"{}\" would end at "
                                        "the blocks' borders",
                                        config.yarn(k).name));
    }
    config.fitting_blocks[axis] = own;
  }
}

void read_woven(const TomlTable& document, FabricConfig& config) {
  const TomlTable weave = document.table("weave");
  config.weave = read_weave(weave);
  config.repeats_x = static_cast<int>(weave.integer("repeats_x", 1, 64));
  config.repeats_y = static_cast<int>(weave.integer("repeats_y", 1, 64));
  config.crimp_warp = weave.number("crimp_warp", {.min = 0, .max = 1}, 0.5);
  config.warp =
      read_system(document, {"warp", "repeats_x", config.weave.ends, config.repeats_x}, config);
  config.weft =
      read_system(document, {"weft", "repeats_y", config.weave.picks, config.repeats_y}, config);
  read_fitting_blocks(weave, config);
}

void read_found(const TomlTable& table, FabricConfig& config) {
  config.curves = read_curves_config(table);
  if (config.curves->as_yarns) {
    config.curves->sequence = read_sequence(table, "curves", config);
  } else {
    config.curves->fiber = find_fiber(table, config.fibers);
  }
}

}  // namespace

double thickest_yarn_mm(const FabricConfig& config, const std::vector<int>& yarns) {
  double thickest = 0;
  for (const int k : yarns)
    thickest = std::max({thickest, config.yarn(k).width_mm, config.yarn(k).height_mm});
  return thickest;
}

FabricConfig read_fabric_config(const TomlTable& document) {
  FabricConfig config;
  config.name = document.string("name");
  config.seed = static_cast<std::uint64_t>(document.integer("seed", 0, 1'000'000'000, 1));
  config.light_from_both_sides = document.choice("light_from", {"face", "both"}, "face") == "both";
  config.segment_mm = kMmPerUm * document.number("segment_um", {.min = 1, .max = 10000});

  const TomlTable fibers = document.table("fiber");
  for (const std::string& name : fibers.table_names())
    config.fibers.push_back(read_fiber(fibers.table(name), name));
  if (config.fibers.empty() || config.fibers.size() > kMaxMaterials) {
    document.fail("fiber", fmt::format("expected 1 to {} tables [fiber.NAME]", kMaxMaterials));
  }
  if (const auto yarns = document.optional_table("yarn")) {
    for (const std::string& name : yarns->table_names()) {
      const TomlTable table = yarns->table(name);
      config.yarns.push_back(read_yarn(table, name, config.fibers));
      config.yarns.back().spacing_mm =
          table.optional_number("spacing_mm", {.min = 1e-3, .max = 100}).value_or(0);
    }
  }
  if (document.has("knit")) {
    config.knit = read_knit(document.table("knit"));
    config.knit->sequence = read_sequence(document.table("knit"), "knit", config);
  } else if (document.has("curves")) {
    read_found(document.table("curves"), config);
  } else {
    read_woven(document, config);
  }
  if (const auto pile = document.optional_table("pile")) {
    config.pile = read_pile(*pile);
    if (config.fitting_blocks[0] > 0)
      document.table("weave").fail("fitting_repeats_x",
                                   "expected no [pile]: it would jump at the blocks' borders");
    config.pile->fiber = find_fiber(*pile, config.fibers);
  }
  if (config.fibers.size() > kMaxMaterials) {
    document.fail("yarn", fmt::format("expected at most {} fibers in different colours, found {}",
                                      kMaxMaterials, config.fibers.size()));
  }
  if (const auto fibers_in_one = document.optional_integer("coarse", 2, 1000))
    make_coarse(config, static_cast<int>(*fibers_in_one));
  return config;
}

}  // namespace heddle
