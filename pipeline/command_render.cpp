#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/scene_job.h"

namespace heddle {
namespace {

PixelRect parse_crop(const std::vector<int>& corners, const CameraConfig& camera) {
  const bool inside = 0 <= corners[0] && corners[0] < corners[2] && corners[2] <= camera.width &&  //
                      0 <= corners[1] && corners[1] < corners[3] && corners[3] <= camera.height;
  if (!inside) {
    throw ConfigError(fmt::format("--crop: expected x0,y0,x1,y1 with x0 < x1 <= {} and y0 < y1 <= {}; got {}",
                                  camera.width, camera.height, fmt::join(corners, ",")));
  }
  return {corners[0], corners[1], corners[2] - corners[0], corners[3] - corners[1]};
}

const ViewConfig& find_view(const SceneConfig& scene, const std::string& name) {
  if (name.empty()) return scene.views.front();
  const auto found =
      std::find_if(scene.views.begin(), scene.views.end(), [&](const ViewConfig& view) { return view.name == name; });
  if (found != scene.views.end()) return *found;
  std::string known;
  for (const ViewConfig& view : scene.views) known += (known.empty() ? "" : ", ") + view.name;
  throw ConfigError(fmt::format("--view: no view called {}; the scene has {}", name, known));
}

void apply_overrides(const RenderOptions& options, PictureRequest& request) {
  if (!options.method.empty()) request.method = *render_method_of(options.method);
  if (options.spp) request.spp = *options.spp;
  if (!options.crop.empty()) request.crop = parse_crop(options.crop, request.camera);
  const bool path = request.method == RenderMethod::kPath;
  if (!path && (options.seconds || options.local || options.bounces || !options.estimator.empty())) {
    throw ConfigError("--seconds, --local, --bounces and --estimator belong to --method path");
  }
  if (path && request.spp % 2 != 0)
    throw ConfigError("--spp: expected an even number for --method path: it keeps two halves");
  static const std::map<std::string, LightEstimator> estimators = {{"", LightEstimator::kCombined},
                                                                   {"mis", LightEstimator::kCombined},
                                                                   {"light", LightEstimator::kShadowRays},
                                                                   {"bcsdf", LightEstimator::kEscapes}};
  request.seconds = options.seconds;
  request.local = options.local;
  request.bounces = options.bounces;
  request.estimator = estimators.at(options.estimator);
}

}  // namespace

int render_command(const RenderOptions& options, const CommonOptions& common) {
  if (options.output.extension() != ".exr") throw ConfigError("-o: expected a file name that ends in .exr");
  Job job(common);
  SceneJob scene(options.scene, job.context(), {.order = options.order, .fabric = {}, .blend = {}});
  PictureRequest request = scene.request(find_view(scene.config(), options.view));
  apply_overrides(options, request);
  const PictureResult picture = scene.render(request, "render");
  make_folder(options.output.parent_path());
  write_exr(options.output, picture.image);
  write_picture_report(options.output, picture);
  job.add_artifact(options.output);
  job.finish();
  return 0;
}

}  // namespace heddle
