#include <fmt/format.h>

#include "formats/chunk_file.h"
#include "formats/file_ending.h"
#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/kept_picture.h"
#include "pipeline/picture_request.h"
#include "pipeline/scene_job.h"
#include "render/kept_samples.h"

namespace heddle {

int relight_command(const RelightOptions& options, const CommonOptions& common) {
  if (lower_case_ending(options.output) != ".exr")
    throw ConfigError("-o: expected a file name that ends in .exr");
  Job job(common);
  require_picture_writable(options.output);
  const ChunkFile file(options.kept, kKeptMark, kKeptKind);
  const KeptPicture kept = read_kept(file);
  SceneJob scene(options.scene, job.context(), variant_of_order(options.scene, kept.order));
  PictureRequest request = scene.request_with_layers(find_view(scene.config(), kept.view));
  request.method = kept.method;
  request.spp = kept.spp;
  request.seed = kept.seed;
  request.crop = kept.crop;
  require_same_parts(scene.parts_but_lights(request), kept, options.scene.string(),
                     options.kept.string());
  require_all_chunks(kept, request.camera, file);
  request.kept_samples = &file;
  request.kept_picture = &kept;
  const PictureResult picture = scene.render(request, "relight");
  write_picture(options.output, picture, picture_report(picture), scene.config().look);
  job.add_artifact(options.output);
  job.finish();
  return 0;
}

}  // namespace heddle
