#include "fibers/cloth/yarn_file.h"

#include <vector>

namespace heddle {
namespace {

PlyShape read_ply(const TomlTable& table) {
  const NumberRange length{.min = 0, .max = 50, .exclusive_min = true};
  return {table.number("centre_mm", {.min = 0, .max = 50}), table.number("radial_mm", length),
          table.number("tangential_mm", length)};
}

// As if the yarn had been measured in a unit so many times as long. Its fibers stay as thick.
void scale_lengths(double scale, YarnConfig& yarn) {
  PlyShape& ply = *yarn.ply_mm;
  for (double* length : {&ply.centre, &ply.radial, &ply.tangential}) *length *= scale;
  std::vector<double*> rates = {&yarn.yarn_turns_per_mm, &yarn.ply_turns_per_mm, &yarn.hairs.per_mm,
                                &yarn.loops.per_mm, &yarn.neps.per_mm};
  std::vector<MeanAndDeviation*> lengths = {&yarn.hairs.start_mm, &yarn.hairs.rise_mm,
                                            &yarn.hairs.along_mm, &yarn.loops.height_mm,
                                            &yarn.neps.diameter_mm};
  for (Slubs& slubs : yarn.slubs) {
    rates.push_back(&slubs.per_mm);
    lengths.push_back(&slubs.length_mm);
  }
  for (double* rate : rates) *rate /= scale;
  for (MeanAndDeviation* length : lengths) {
    length->mean *= scale;
    length->deviation *= scale;
  }
}

}  // namespace

void read_irregularities(const TomlTable& table, YarnConfig& yarn) {
  yarn.migration_per_turn = table.number("migration_per_turn", {.min = 0, .max = 100}, 1);
  if (const auto density = table.optional_table("density")) {
    yarn.density.epsilon = density->number("epsilon", {.min = 0, .max = 0.5});
    yarn.density.beta = density->number("beta", {.min = 0, .max = 20});
  }
  if (const auto hairs = table.optional_table("hairs")) yarn.hairs = read_hairs(*hairs);
  if (const auto loops = table.optional_table("loops")) yarn.loops = read_loops(*loops);
  for (const TomlTable& slubs : table.tables("slubs")) yarn.slubs.push_back(read_slubs(slubs));
  if (const auto neps = table.optional_table("neps")) yarn.neps = read_neps(*neps);
}

void read_yarn_file(const TomlTable& table, double fiber_radius_mm, YarnConfig& yarn) {
  const TomlTable file = TomlTable::load(table.content_file("from"));
  yarn.plies = static_cast<int>(file.integer("plies", 1, 12));
  yarn.fibers_per_ply = static_cast<int>(file.integer("fibers_per_ply", 1, 2000));
  const NumberRange twist{.min = -5000, .max = 5000};
  yarn.yarn_turns_per_mm = 1e-3 * file.number("yarn_twist_per_m", twist);
  yarn.ply_turns_per_mm = 1e-3 * file.number("ply_twist_per_m", twist);
  yarn.migration = file.number("migration", {.min = 0, .max = 1});
  yarn.wander_rms = radians(file.number("wander_rms_deg", {.min = 0, .max = 30}, 0));
  yarn.ply_mm = read_ply(file.table("ply"));
  read_irregularities(file, yarn);
  file.finish();
  scale_lengths(table.number("scale", {.min = 0.01, .max = 100}, 1), yarn);
  const double round = 2 * (reach_of(*yarn.ply_mm) + fiber_radius_mm);
  const NumberRange section{.min = 1e-3, .max = 100};
  yarn.width_mm = table.optional_number("width_mm", section).value_or(round);
  yarn.height_mm = table.optional_number("height_mm", section).value_or(round);
  for (const char* key : {"width_mm", "height_mm"}) {
    if ((key[0] == 'w' ? yarn.width_mm : yarn.height_mm) <= 2 * fiber_radius_mm)
      table.fail(key, "expected more than the thickness of one fiber");
  }
}

}  // namespace heddle
