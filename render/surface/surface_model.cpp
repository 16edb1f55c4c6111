#include "render/surface/surface_model.h"

#include <fmt/format.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "render/surface/microcylinder.h"
#include "render/surface/woven_cotton.h"
#include "render/surface/woven_yarns.h"

namespace heddle {

std::unique_ptr<const SurfaceModel> read_surface_model(const TomlTable& document) {
  using Read = std::function<std::unique_ptr<const SurfaceModel>(const TomlTable&)>;
  static const std::map<std::string, Read> readers = {
      {"irawan-2012",
       [](const TomlTable& config) {
         return std::make_unique<WovenYarns>(read_woven_yarns(config));
       }},
      {"microcylinder",
       [](const TomlTable& config) {
         return std::make_unique<Microcylinder>(read_microcylinder_fabric(config));
       }},
      {"woven-cotton",
       [](const TomlTable& config) {
         return std::make_unique<WovenCotton>(read_woven_cotton(config));
       }},
  };
  const std::string model = document.string("model");
  const auto reader = readers.find(model);
  if (reader == readers.end()) {
    std::vector<std::string> known;
    for (const auto& [name, read] : readers) known.push_back(name);
    document.fail("model", fmt::format("expected one of {}", fmt::join(known, ", ")));
  }
  std::unique_ptr<const SurfaceModel> result = reader->second(document);
  document.finish();
  return result;
}

}  // namespace heddle
