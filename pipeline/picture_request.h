#ifndef HEDDLE_PIPELINE_PICTURE_REQUEST_H_
#define HEDDLE_PIPELINE_PICTURE_REQUEST_H_
// The options of `render` and `chart` that choose the view and the crop. Errors: ConfigError.
// Tested in tests/pipeline/end_to_end_test.cpp.

#include <string>
#include <vector>

#include "render/scene_config.h"

namespace heddle {

/// corners: x0, y0, x1, y1.
PixelRect parse_crop(const std::vector<int>& corners, const CameraConfig& camera);

/// The scene's first view if `name` is empty.
const ViewConfig& find_view(const SceneConfig& scene, const std::string& name);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PICTURE_REQUEST_H_
