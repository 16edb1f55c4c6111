#include "fibers/cloth/fabric_config.h"

#include <fmt/format.h>

#include <algorithm>

#include "fibers/cloth/exemplar.h"
#include "fibers/cloth/weave_config.h"

namespace heddle {
namespace {

constexpr double kMmPerUm = 1e-3;

void check_tile(const TomlTable& weave, std::string_view key, double size_mm) {
  if (size_mm <= kMaxTileMm) return;
  weave.fail(key, fmt::format("expected a tile of at most {} mm, found {:g} mm: yarns of a repeat "
                              "x repeats x spacing_mm",
                              kMaxTileMm, size_mm));
}

ThreadSystem read_system(const TomlTable& table, const std::string& name, FabricConfig& config) {
  ThreadSystem system;
  system.spacing_mm = table.number("spacing_mm", {.min = 1e-3, .max = 100});
  const YarnConfig yarn = read_yarn(table, name, config.fibers);
  if (yarn.width_mm > system.spacing_mm)
    table.fail("width_mm", "expected at most spacing_mm: neighbouring yarns overlap");
  system.sequence = {static_cast<int>(config.yarns.size())};
  config.yarns.push_back(yarn);
  return system;
}

void read_woven(const TomlTable& document, FabricConfig& config) {
  const TomlTable weave = document.table("weave");
  config.weave = read_weave(weave);
  config.repeats_x = static_cast<int>(weave.integer("repeats_x", 1, 64));
  config.repeats_y = static_cast<int>(weave.integer("repeats_y", 1, 64));
  config.crimp_warp = weave.number("crimp_warp", {.min = 0, .max = 1});
  config.warp = read_system(document.table("warp"), "warp", config);
  config.weft = read_system(document.table("weft"), "weft", config);
  check_tile(weave, "repeats_x", config.weave.ends * config.repeats_x * config.warp.spacing_mm);
  check_tile(weave, "repeats_y", config.weave.picks * config.repeats_y * config.weft.spacing_mm);
}

int fiber_named(const TomlTable& table, const FabricConfig& config) {
  const std::string name = table.string("fiber");
  for (std::size_t k = 0; k < config.fibers.size(); ++k) {
    if (config.fibers[k].name == name) return static_cast<int>(k);
  }
  table.fail("fiber", "expected the name of a [fiber.NAME] table");
}

void read_knitted(const TomlTable& table, FabricConfig& config) {
  config.knit = read_knit(table);
  config.yarns.push_back(read_yarn(table, "knit", config.fibers));
  config.knit->sequence = {static_cast<int>(config.yarns.size()) - 1};
}

void read_found(const TomlTable& table, FabricConfig& config) {
  config.curves = read_curves_config(table);
  if (config.curves->as_yarns) {
    config.yarns.push_back(read_yarn(table, "curves", config.fibers));
    config.curves->sequence = {static_cast<int>(config.yarns.size()) - 1};
  } else {
    config.curves->fiber = fiber_named(table, config);
  }
}

}  // namespace

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
  if (document.has("knit")) {
    read_knitted(document.table("knit"), config);
  } else if (document.has("curves")) {
    read_found(document.table("curves"), config);
  } else {
    read_woven(document, config);
  }
  if (const auto pile = document.optional_table("pile")) {
    config.pile = read_pile(*pile);
    config.pile->fiber = fiber_named(*pile, config);
  }
  return config;
}

}  // namespace heddle
