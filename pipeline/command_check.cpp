#include <iostream>

#include "pipeline/commands.h"
#include "pipeline/pack_check.h"

namespace heddle {

int check_command(const std::filesystem::path& pack, const CommonOptions& common) {
  check_pack(pack);
  if (common.json) {
    std::cout << "{\"sound\": true}\n";
  } else if (!common.quiet) {
    std::cout << pack.string() << ": sound\n";
  }
  return 0;
}

}  // namespace heddle
