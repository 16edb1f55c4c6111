#include <fmt/format.h>

#include <map>

#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/picture_request.h"
#include "pipeline/scene_job.h"

namespace heddle {
namespace {

void apply_overrides(const RenderOptions& options, PictureRequest& request) {
  if (!options.method.empty()) request.method = *render_method_of(options.method);
  if (options.spp) request.spp = *options.spp;
  if (!options.crop.empty()) request.crop = parse_crop(options.crop, request.camera);
  const bool path = traces_paths(request.method);
  if (!path && (options.seconds || options.local || !options.estimator.empty())) {
    throw ConfigError("--seconds, --local and --estimator belong to --method path or path-6");
  }
  if (request.method != RenderMethod::kPath && options.bounces) throw ConfigError("--bounces belongs to --method path");
  if (path && request.spp % 2 != 0)
    throw ConfigError("--spp: expected an even number where paths are traced: they keep two halves");
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
  SceneJob scene(options.scene, job.context(), {.order = options.order, .fabric = {}, .blend = {}, .surface_method = {}});
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
