#include "pipeline/picture_request.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/input_error.h"

namespace heddle {

PixelRect parse_crop(const std::vector<int>& corners, const CameraConfig& camera) {
  const bool inside = 0 <= corners[0] && corners[0] < corners[2] &&
                      corners[2] <= camera.width &&  //
                      0 <= corners[1] && corners[1] < corners[3] && corners[3] <= camera.height;
  if (!inside) {
    throw ConfigError(
        fmt::format("--crop: expected x0,y0,x1,y1 with x0 < x1 <= {} and y0 < y1 <= {}; got {}",
                    camera.width, camera.height, fmt::join(corners, ",")));
  }
  return {corners[0], corners[1], corners[2] - corners[0], corners[3] - corners[1]};
}

const ViewConfig& find_view(const SceneConfig& scene, const std::string& name) {
  if (name.empty()) return scene.views.front();
  const auto found = std::find_if(scene.views.begin(), scene.views.end(),
                                  [&](const ViewConfig& view) { return view.name == name; });
  if (found != scene.views.end()) return *found;
  std::string known;
  for (const ViewConfig& view : scene.views) known += (known.empty() ? "" : ", ") + view.name;
  throw ConfigError(fmt::format("--view: no view called {}; the scene has {}", name, known));
}

}  // namespace heddle
