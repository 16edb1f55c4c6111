#include <iostream>
#include <nlohmann/json.hpp>

#include "pipeline/commands.h"
#include "pipeline/pack_check.h"
#include "pipeline/warnings.h"

namespace heddle {

int check_command(const std::filesystem::path& pack, const CommonOptions& common) {
  check_pack(pack);
  const FabricPack opened = load_pack(pack);
  const TileScene tile(opened.exemplar);
  const PackFacts facts = pack_facts(opened, tile);
  const std::vector<Warning> warnings = pack_warnings(opened, tile);
  if (common.json) {
    std::cout << nlohmann::ordered_json{{"sound", true},
                                        {"mean_free_path_um", 1e3 * facts.mean_free_path_mm},
                                        {"cell_mean_free_paths", facts.cell_mean_free_paths},
                                        {"neighbour_angle_deg", degrees(facts.neighbour_angle)},
                                        {"lobe_width_deg", degrees(facts.lobe_width)},
                                        {"warnings", warnings_report(warnings)}}
                     .dump(2)
              << '\n';
  } else if (!common.quiet) {
    std::cout << pack.string() << ": sound\n";
  }
  for (const Warning& warning : warnings) std::cerr << warning_text(warning) << '\n';
  return 0;
}

}  // namespace heddle
