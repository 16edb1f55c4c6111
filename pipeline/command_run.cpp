#include <fmt/format.h>

#include "formats/atomic_file.h"
#include "pipeline/artifact_record.h"
#include "pipeline/commands.h"
#include "pipeline/job.h"
#include "pipeline/picture_compare.h"
#include "pipeline/scene_job.h"
#include "pipeline/warnings.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

/// A picture from the cache, rendered if it is not there, and copied to `target` with its .png and
/// .json.
void provide_picture(SceneJob& scene, const PictureRequest& request, const fs::path& target,
                     Job& job) {
  const std::string title = target.stem().string();
  StageContext& context = job.context();
  Stage stage;
  stage.name = "picture";
  stage.key = scene.picture_key(request);
  const fs::path folder = context.cache.artifact(stage.name, stage.key, "");
  const fs::path cached = folder / "picture.exr";
  StageResult result{
      .fabric = scene.config().name, .stage = title, .key = stage.key, .artifact = cached};
  if (!is_sound(stage, context)) {
    const Stopwatch watch;
    publish_artifact(
        folder, context.cache.record(stage.name, stage.key), [&](const fs::path& temporary) {
          const PictureResult picture = scene.render(request, title);
          make_folder(temporary);
          write_picture(temporary / cached.filename(), picture, picture_report(picture), {});
          return BuildCost{watch.elapsed(), working_threads()};
        });
    result.built = true;
    result.seconds = watch.elapsed().seconds;
  } else {
    for (const Warning& warning : read_warnings(fs::path(cached).replace_extension(".json"))) {
      context.console->warn(warning_text(warning));
    }
  }
  for (const char* extension : {".exr", ".png", ".json"}) {
    write_file_atomically(fs::path(target).replace_extension(extension),
                          read_whole_file(fs::path(cached).replace_extension(extension)));
  }
  // The one in the cache serves any look.
  const ScreenLook& look = scene.config().look;
  if (look != ScreenLook{})
    write_screen_picture(fs::path(target).replace_extension(".png"), read_exr(cached), look);
  context.report(std::move(result));
  job.add_artifact(target);
}

/// The rectangle of a full frame.
Image cropped(const Image& full, const PixelRect& crop) {
  Image result;
  result.width = crop.width;
  result.height = crop.height;
  result.metadata = full.metadata;
  for (const auto& [name, channel] : full.channels) {
    ImageChannel part{channel.type, {}, {}};
    for (int y = crop.y0; y < crop.y0 + crop.height; ++y) {
      const auto row = static_cast<std::ptrdiff_t>(y) * full.width + crop.x0;
      const auto copy = [&](const auto& from, auto& to) {
        if (!from.empty()) to.insert(to.end(), from.begin() + row, from.begin() + row + crop.width);
      };
      copy(channel.values, part.values);
      copy(channel.ids, part.ids);
    }
    result.channels[name] = std::move(part);
  }
  return result;
}

}  // namespace

int run_command(const RunOptions& options, const CommonOptions& common) {
  Job job(common);
  SceneJob scene(options.scene, job.context(), variant_of_order(options.scene, options.order));
  const fs::path folder =
      options.output.empty() ? fs::path("out") / options.scene.stem() : options.output;
  make_folder(folder);
  require_writable(folder / (options.scene.stem().string() + ".exr"));  // before hours of work

  for (const ViewConfig& view : scene.config().views) {
    const std::string name = view.name.empty() ? options.scene.stem().string() : view.name;
    const fs::path picture = folder / (name + ".exr");
    provide_picture(scene, scene.request_with_layers(view), picture, job);
    if (!view.reference) continue;
    const fs::path reference = folder / (name + "-reference.exr");
    provide_picture(scene, scene.reference_request(view), reference, job);

    const fs::path difference = folder / (name + "-difference.exr");
    const PictureComparison comparison = compare_images(
        cropped(read_exr(picture), view.reference->crop), picture.filename().string(),
        read_exr(reference), reference.filename().string(), "");
    write_difference(difference, comparison);
    write_file_atomically(fs::path(difference).replace_extension(".json"),
                          comparison_report(comparison).dump(2) + "\n");
    job.console().say(fmt::format("{}: {}", name, comparison_text(comparison)));
    job.add_artifact(difference);
  }
  job.finish();
  return 0;
}

}  // namespace heddle
