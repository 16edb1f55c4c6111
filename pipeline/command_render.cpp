#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "formats/atomic_file.h"
#include "formats/file_ending.h"
#include "formats/image_file.h"
#include "formats/input_error.h"
#include "formats/numbered_file.h"
#include "pipeline/accuracy/probe.h"
#include "pipeline/commands.h"
#include "pipeline/contact_sheet.h"
#include "pipeline/interrupt.h"
#include "pipeline/job.h"
#include "pipeline/picture_request.h"
#include "pipeline/plan/scene_plan.h"
#include "pipeline/render_frames.h"
#include "pipeline/scene_job.h"
#include "render/noise_target.h"
#include "render/render_output.h"

namespace heddle {
namespace {

void apply_overrides(const RenderOptions& options, PictureRequest& request) {
  if (!options.method.empty()) request.method = *render_method_of(options.method);
  if (options.spp) request.spp = *options.spp;
  if (options.noise && options.seconds) throw ConfigError("--noise: not together with --seconds");
  if (options.noise) request.spp = std::max(2, request.spp);
  request.noise = options.noise;
  if (!options.crop.empty()) request.crop = parse_crop(options.crop, request.camera);
  const bool path = traces_paths(request.method);
  if (!path && (options.seconds || options.local || !options.estimator.empty())) {
    throw ConfigError("--seconds, --local and --estimator belong to --method path or path-6");
  }
  if (request.method != RenderMethod::kPath && options.bounces)
    throw ConfigError("--bounces belongs to --method path");
  if (path && request.spp % 2 != 0)
    throw ConfigError(
        "--spp: expected an even number where paths are traced: they keep two halves");
  static const std::map<std::string, LightEstimator> estimators = {
      {"", LightEstimator::kCombined},
      {"mis", LightEstimator::kCombined},
      {"light", LightEstimator::kShadowRays},
      {"bcsdf", LightEstimator::kEscapes}};
  if (!options.keep.empty()) {
    if (path) {
      throw ConfigError(fmt::format(
          "--keep: the method {} finds its light by the way, and has no samples to relight",
          render_method_name(request.method)));
    }
    if (options.noise) throw ConfigError("--keep: not together with --noise; choose --spp");
    request.keep = {std::filesystem::path(options.output).replace_extension(".gbuffer"),
                    options.keep == "light", options.view, options.order};
  }
  request.seconds = options.seconds;
  request.local = options.local;
  request.bounces = options.bounces;
  request.estimator = estimators.at(options.estimator);
}

/// Variance of one sample of a pixel as the picture itself shows it, relative to the squared mean
/// radiance.
Estimate relative_noise_of(const FrameBuffers& frame) {
  const double mean = mean_radiance(std::span(&frame, 1));
  const Estimate variance = sample_variance_of_all(frame);
  const double scale = mean > 0 ? 1 / (mean * mean) : 0;
  return {scale * variance.value, scale * variance.error};
}

/// The cheapest picture that is good enough.
int render_within(double tolerance, const RenderOptions& options, Job& job) {
  const bool by_hand = !options.method.empty() || options.spp || options.seconds || options.local ||
                       options.bounces || options.order || options.noise ||
                       !options.estimator.empty();
  if (by_hand) {
    throw ConfigError(
        "--tolerance chooses method, samples and data: not together with --method, --spp, "
        "--seconds, --noise, --local, --bounces, --estimator or --order");
  }
  const ScenePlan plan = make_plan(
      {.scene = options.scene,
       .view = options.view,
       .crop = options.crop,
       .target = {.tolerance = tolerance, .pictures = options.pictures, .may_build = true}},
      job.context());
  if (!plan.chosen) {
    job.console().warn(plan_text(plan) + "nothing rendered");
    return 1;
  }
  job.console().say(plan_text(plan));
  const Way& way = plan.ways[*plan.chosen];
  SceneJob scene(options.scene, job.context(), way.settings.variant);
  PictureRequest request = plan.request;
  request.layers = scene.config().layers;
  request.light_groups = true;
  request.spp = first_samples(way.candidate, tolerance);
  Estimate noise_square;  // of a sample
  int spp = 0;
  request.more = [&](const FrameBuffers& frame) {
    noise_square = relative_noise_of(frame);
    spp = frame.spp;
    return std::vector<int>{more_samples(way.candidate, noise_square, frame.spp, tolerance)};
  };
  const PictureResult picture = scene.render(request, "render");
  const double noise = std::sqrt(noise_square.value / spp);
  const double error = std::hypot(std::sqrt(std::max(0.0, way.candidate.bias_square.value)), noise);
  const std::string done = fmt::format(
      "{}, {} spp in {:.3g} s: expected error {:.3g} %, of which noise {:.3g} % (measured in the "
      "picture)",
      way.candidate.name, spp, picture.time.seconds, 100 * error, 100 * noise);
  if (error > tolerance) {
    job.console().warn(done + fmt::format("; more than the {:.3g} % asked for", 100 * tolerance));
  } else {
    job.console().say(done);
  }
  nlohmann::ordered_json report = picture_report(picture);
  report["plan"] = plan_json(plan);
  report["expected_error"] = error;
  write_picture(options.output, picture, report, scene.config().look);
  job.add_artifact(options.output);
  job.add_entry("plan", report["plan"]);
  job.add_entry("expected_error", error);
  job.finish();
  return 0;
}

/// How many samples it took to make the picture so quiet.
void say_noise(double noise, const PictureResult& picture, Console& console) {
  const std::string done =
      fmt::format("{:.4g} samples per pixel on the mean, noise of the noisiest block {:.3g} %",
                  picture.mean_samples, 100 * picture.largest_noise);
  if (picture.largest_noise > noise) {
    console.warn(done + fmt::format(": {} samples do not make it quieter", kMostSamplesForNoise));
  } else {
    console.say(done);
  }
}

/// Found out before hours of work.
void require_frames(const SceneConfig& config, const FrameRange& frames) {
  SceneConfig scene = config;
  for (int frame = frames.first; frame <= frames.last; ++frame) show_frame(scene, frame);
}

/// One picture per frame, and a contact sheet of all.
int render_frames(const RenderOptions& options, Job& job) {
  const FrameRange frames = parse_frames(options.frames);
  if (options.tolerance) {
    throw ConfigError(
        "--frames: not together with --tolerance; `heddle plan --pictures` says which "
        "method and samples suit a shot");
  }
  if (options.resume && options.seconds)
    throw ConfigError("--resume: not together with --seconds: no two such pictures are alike");
  const std::filesystem::path pattern = numbered_output(options.output);
  require_picture_writable(numbered_path(pattern, frames.first));
  SceneJob scene(options.scene, job.context(),
                 variant_of_order(options.scene, options.order, frames.first), frames.first);
  require_frames(scene.config(), frames);
  std::vector<SheetFrame> sheet;
  int found = 0;
  for (int frame = frames.first; frame <= frames.last; ++frame) {
    stop_if_interrupted();
    scene.show_frame(frame);
    PictureRequest request = scene.request_with_layers(find_view(scene.config(), options.view));
    apply_overrides(options, request);
    const std::filesystem::path exr = numbered_path(pattern, frame);
    if (options.resume && is_finished_frame(exr, scene.picture_key(request))) {
      ++found;
    } else {
      // What there is to warn of is said once; every frame's report has it.
      const bool quiet = frame > frames.first;
      PictureResult picture = scene.render(request, fmt::format("frame {}", frame), quiet);
      if (options.noise) say_noise(*options.noise, picture, job.console());
      picture.image.metadata["heddle.frame"] = fmt::format("{}", frame);
      // No report of another picture beside the new one, should that be all there is time for.
      std::filesystem::remove(std::filesystem::path(exr).replace_extension(".json"));
      write_picture(exr, picture, picture_report(picture), scene.config().look);
      job.console().say(fmt::format("frame {} of {}-{} in {}", frame, frames.first, frames.last,
                                    duration_text(picture.time.seconds)));
    }
    job.add_artifact(exr);
    sheet.push_back({frame, std::filesystem::path(exr).replace_extension(".png")});
  }
  if (options.resume) {
    job.console().say(
        fmt::format("{} of {} frames were finished before", found, frames.last - frames.first + 1));
  }
  const RgbPicture small = contact_sheet(sheet);
  const std::filesystem::path sheet_file =
      with_number_as(pattern, "sheet").replace_extension(".png");
  write_png(sheet_file, small.width, small.height, small.rgb);
  job.add_artifact(sheet_file);
  job.finish();
  return 0;
}

}  // namespace

int render_command(const RenderOptions& options, const CommonOptions& common) {
  if (lower_case_ending(options.output) != ".exr")
    throw ConfigError("-o: expected a file name that ends in .exr");
  Job job(common);
  if (!options.keep.empty() && (!options.frames.empty() || options.tolerance))
    throw ConfigError("--keep: not together with --frames or --tolerance");
  if (!options.frames.empty()) return render_frames(options, job);
  if (options.resume) throw ConfigError("--resume belongs to --frames");
  require_picture_writable(options.output);  // found out now, not after hours of work
  if (!options.keep.empty())
    require_writable(std::filesystem::path(options.output).replace_extension(".gbuffer"));
  if (options.tolerance) return render_within(*options.tolerance, options, job);
  SceneJob scene(options.scene, job.context(), variant_of_order(options.scene, options.order));
  PictureRequest request = scene.request_with_layers(find_view(scene.config(), options.view));
  apply_overrides(options, request);
  const PictureResult picture = scene.render(request, "render");
  if (options.noise) say_noise(*options.noise, picture, job.console());
  write_picture(options.output, picture, picture_report(picture), scene.config().look);
  job.add_artifact(options.output);
  if (request.keep) job.add_artifact(request.keep->file);
  job.finish();
  return 0;
}

}  // namespace heddle
