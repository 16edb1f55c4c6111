#include "pipeline/output_folder.h"

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "pipeline/cache.h"

namespace heddle {

namespace fs = std::filesystem;

fs::path without_slash(const fs::path& folder) {
  return folder.has_filename() ? folder : folder.parent_path();
}

void require_place_for_folder(const fs::path& folder, const std::string& kind,
                              const std::function<bool(std::string_view)>& is_of_kind) {
  const fs::path place = without_slash(folder);
  if (fs::exists(place)) {
    if (!fs::is_directory(place)) throw FileError(place.string() + ": exists and is not a folder");
    for (const auto& entry : fs::directory_iterator(place)) {
      if (is_of_kind(entry.path().filename().native())) continue;
      throw FileError(entry.path().string() + ": is no part of " + kind +
                      ", and would be lost with its folder; remove it or choose another name");
    }
  }
  make_folder(place.parent_path());
  require_writable(place.parent_path() / (place.filename().string() + "~"));
}

}  // namespace heddle
