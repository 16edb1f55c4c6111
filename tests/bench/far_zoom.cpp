// A zoom onto flat cloth from 0.1 to 30 repeats of the weave per pixel, by fibers and with the far
// form. Not a test: it prints a table and writes a strip of pictures.
//
//   heddle_far_zoom FABRIC [--cache DIR] [--pixels P] [--spp S] [-o STRIP.png]
//
// For every distance, pictures of P x P pixels under a Gaussian light (sharpness 150), 30 degrees
// off the cloth's normal: `exact` with 64 S samples as reference, and S samples of `exact` with
// `far_from = 1`. mean: of the second over the first. error: relative RMSE per pixel of the second,
// less the reference's noise; a third of that noise where it is smaller. noise: of one sample of
// `exact`, relative. gain: time that `exact` needs for the same error over the time of the second,
// from both pictures' times. The strip holds the pictures with the far form side by side.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "formats/image_file.h"
#include "pipeline/job.h"
#include "pipeline/scene_job.h"
#include "pipeline/swatch_picture.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

struct ZoomSetup {
  std::string fabric;
  int pixels = 24;
  int spp = 4;
  std::string strip;
};

std::string zoom_scene(const ZoomSetup& setup, const std::string& render_keys) {
  return fmt::format(
      "name = \"zoom\"\n[camera]\nposition_mm = [0, -50, 86.6]\nlook_at_mm = [0, 0, 0]\n"
      "up = [0, 1, 0]\nfov_deg = 1\nfov_axis = \"horizontal\"\nresolution_px = [{0}, {0}]\n"
      "[[light]]\ntype = \"sg\"\naxis = [-0.5, 0.4, 1]\nsharpness = 150\nirradiance = [1, 1, 1]\n"
      "[[cloth]]\nflat_mm = [20000, 20000]\nfabric = \"{1}\"\nunderlay = true\n[render]\n{2}",
      setup.pixels, fs::absolute(setup.fabric).string(), render_keys);
}

SceneJob::Crops zoom_picture(SceneJob& job, double distance, double wide, int spp,
                             std::uint64_t seed) {
  PictureRequest request = job.request(job.config().views.front());
  request.camera.position = distance / 100 * Vec3d(0, -50, 86.6025403784);
  request.camera.fov = 2 * std::atan(0.5 * wide / distance);
  request.spp = spp;
  request.seed = seed;
  const PixelRect all = request.crop;
  return job.render_crops(request, std::span(&all, 1));
}

double mean_of_frame(const FrameBuffers& frame) {
  double sum = 0;
  for (const Rgb& value : frame.beauty) sum += static_cast<double>(value.mean());
  return sum / static_cast<double>(frame.pixel_count());
}

double mean_variance(const FrameBuffers& frame) {
  double sum = 0;
  for (const Rgb& value : frame.variance) sum += static_cast<double>(value.mean());
  return sum / static_cast<double>(frame.pixel_count());
}

void zoom(const ZoomSetup& setup, StageContext& context) {
  const fs::path file = fs::temp_directory_path() / fmt::format("heddle_zoom_{}.toml", ::getpid());
  std::ofstream(file) << zoom_scene(setup, "");
  SceneJob by_fibers(file, context);
  std::ofstream(file) << zoom_scene(setup, "far_from = 1\n");
  SceneJob with_far(file, context);
  fs::remove(file);
  FabricStages stages(setup.fabric, context);
  const Exemplar tile = read_exemplar(stages.synth().path);
  const FabricConfig& config = stages.document().config;
  const double repeat = std::sqrt(static_cast<double>(tile.width_mm) * tile.height_mm /
                                  (config.repeats_x * config.repeats_y));
  fmt::print("{}: repeat {:.3f} mm, {} samples\n", config.name, repeat, setup.spp);
  fmt::print("{:>12} {:>9} {:>9} {:>9} {:>8}\n", "repeats/px", "mean", "error", "noise", "gain");
  constexpr int kSteps = 16;
  std::vector<FrameBuffers> frames;
  for (int step = 0; step < kSteps; ++step) {
    const double scale = 0.1 * std::pow(300.0, step / (kSteps - 1.0));
    const double wide = scale * repeat * setup.pixels;
    const double distance = 4 * wide;
    const SceneJob::Crops reference = zoom_picture(by_fibers, distance, wide, 64 * setup.spp, 1);
    if (step == 0) zoom_picture(with_far, 1e3 * distance, 1e3 * wide, 1, 2);  // builds its tables
    SceneJob::Crops far = zoom_picture(with_far, distance, wide, setup.spp, 2);
    const FrameBuffers& truth = reference.frames[0];
    const double mean = mean_of_frame(truth);
    double squares = 0;
    for (std::size_t k = 0; k < truth.pixel_count(); ++k) {
      squares += static_cast<double>((far.frames[0].beauty[k] - truth.beauty[k]).square().mean()) /
                 static_cast<double>(truth.pixel_count());
    }
    const double own_noise = mean_variance(truth);
    // Where the reference's noise hides the error, what it could be at most.
    const double error = std::sqrt(std::max(squares - own_noise, 0.1 * own_noise)) / mean;
    const double one_sample = std::sqrt(own_noise * truth.spp) / mean;
    const double time_per_sample = reference.rendering.core_seconds / truth.spp;
    const double gain =
        one_sample * one_sample / (error * error) * time_per_sample / far.rendering.core_seconds;
    fmt::print("{:>12.3f} {:>8.4f} {:>7.2f} % {:>7.1f} % {:>8.1f}\n", scale,
               mean_of_frame(far.frames[0]) / mean, 100 * error, 100 * one_sample, gain);
    std::fflush(stdout);
    frames.push_back(std::move(far.frames[0]));
  }
  if (setup.strip.empty()) return;
  // Four rows of four pictures.
  const int edge = 4 * setup.pixels;
  std::vector<Rgb> colors(static_cast<std::size_t>(edge) * edge);
  for (int y = 0; y < edge; ++y) {
    for (int x = 0; x < edge; ++x) {
      const int step = y / setup.pixels * 4 + x / setup.pixels;
      colors[static_cast<std::size_t>(y * edge + x)] =
          frames[static_cast<std::size_t>(step)]
              .beauty[static_cast<std::size_t>(y % setup.pixels * setup.pixels + x % setup.pixels)];
    }
  }
  write_swatch(setup.strip, colors, edge);
}

int run(int argc, char** argv) {
  ZoomSetup setup;
  CommonOptions options;
  CLI::App app("Fibers and the far form of a fabric over a zoom");
  app.add_option("fabric", setup.fabric)->required();
  app.add_option("--cache", options.cache);
  app.add_option("--pixels", setup.pixels);
  app.add_option("--spp", setup.spp);
  app.add_option("-o", setup.strip);
  CLI11_PARSE(app, argc, argv);
  try {
    Job job(options);
    zoom(setup, job.context());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  return heddle::run(argc, argv);
}
