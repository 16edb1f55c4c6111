// What breaks up the repeat of a cloth is worth, and what it costs in accuracy. Not a test: it
// prints a table. For every way of laying the cloth (as woven, blocks scattered, drift of the
// yarns, tints, all of them) it renders a close-up straight from above, path-traced and by `exact`:
//
//   heddle_uneven_cloth FABRIC [--cache DIR] [--tiles N] [--pixels P] [--spp S] [--drift PERCENT]
//     [--across MM] [--along MM] [--tint PERCENT]
//
// peak: the autocorrelation of the path-traced picture's luminance at the tile's period along the
// weft and along the warp; the largest within 2 pixels of it. One half of the samples is correlated
// with the other, so noise does not count. 1 is wallpaper.
// error: of `exact` against path tracing of the same cloth (paths end where they leave it),
// relative RMSE per pixel, sqrt(mean of (F1 - R1)(F2 - R2)) / mean R over two halves of the
// samples; and of means over 8 x 8 pixels.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "fibers/cloth/yarn_paths.h"
#include "pipeline/job.h"
#include "pipeline/scene_job.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

struct Setup {
  std::string fabric;
  int tiles = 8;    // across the picture
  int pixels = 32;  // per tile
  int spp = 64;
  double drift_percent = 3;
  double across_mm = 2;
  double along_mm = 20;
  double tint_percent = 15;
};

struct Halves {
  std::vector<Rgb> even;
  std::vector<Rgb> odd;
};

/// A scene of the fabric with more keys for its cloth.
std::string scene_text(const Setup& setup, double width_mm, const std::string& keys) {
  const double distance = 400;
  const double wide = setup.tiles * width_mm;
  return fmt::format(
      "name = \"uneven\"\n[camera]\nposition_mm = [0, 0, {0}]\nlook_at_mm = [0, 0, 0]\n"
      "up = [0, 1, 0]\nfov_deg = {1:.9f}\nfov_axis = \"horizontal\"\nresolution_px = [{2}, {2}]\n"
      "[[light]]\ntype = \"directional\"\ndirection = [0.6, 0.35, 0.8]\nirradiance = [2, 2, 2]\n"
      "[[light]]\ntype = \"sg\"\naxis = [-0.5, 0.4, 1]\nsharpness = 10\nirradiance = [1, 1, 1]\n"
      "[[cloth]]\nflat_mm = [{3}, {3}]\nfabric = \"{4}\"\nunderlay = true\n{5}",
      distance, degrees(2 * std::atan(0.5 * wide / distance)), setup.tiles * setup.pixels, 2 * wide,
      fs::absolute(setup.fabric).string(), keys);
}

Halves picture(const fs::path& scene, const Setup& setup, RenderMethod method, std::uint64_t seed,
               StageContext& context) {
  SceneJob job(scene, context);
  PictureRequest request = job.request(job.config().views.front());
  request.method = method;
  request.spp = setup.spp;
  request.seed = seed;
  request.local = method == RenderMethod::kPath;
  const PixelRect all = request.crop;
  SceneJob::Crops crops = job.render_crops(request, std::span(&all, 1));
  return {std::move(crops.frames[0].half0), std::move(crops.frames[0].half1)};
}

double luminance(const Rgb& value) {
  return static_cast<double>(value.matrix().dot(Vec3(0.2126F, 0.7152F, 0.0722F)));
}

/// Correlation of the picture with itself moved by (dx, dy) pixels.
double correlation(const Halves& halves, int size, int dx, int dy) {
  double mean = 0;
  for (const Rgb& value : halves.even) mean += luminance(value) / (size * size);
  const auto covariance = [&](int x, int y) {
    double sum = 0;
    int count = 0;
    for (int row = 0; row + y < size; ++row) {
      for (int column = 0; column + x < size; ++column, ++count) {
        const auto from = static_cast<std::size_t>(row * size + column);
        const auto to = static_cast<std::size_t>((row + y) * size + column + x);
        sum += (luminance(halves.even[from]) - mean) * (luminance(halves.odd[to]) - mean);
      }
    }
    return sum / count;
  };
  return covariance(dx, dy) / covariance(0, 0);
}

double peak(const Halves& halves, int size, int dx, int dy) {
  double best = -1;
  for (int x = std::max(0, dx - 2); x <= dx + 2; ++x) {
    for (int y = std::max(0, dy - 2); y <= dy + 2; ++y) {
      if (std::hypot(x - dx, y - dy) <= 2) best = std::max(best, correlation(halves, size, x, y));
    }
  }
  return best;
}

/// Means over blocks of pixels.
std::vector<Rgb> coarse(const std::vector<Rgb>& values, int size, int edge) {
  const int blocks = size / edge;
  std::vector<Rgb> means(static_cast<std::size_t>(blocks * blocks), Rgb::Zero());
  for (int row = 0; row < blocks * edge; ++row) {
    for (int column = 0; column < blocks * edge; ++column) {
      means[static_cast<std::size_t>(row / edge * blocks + column / edge)] +=
          values[static_cast<std::size_t>(row * size + column)] / static_cast<float>(edge * edge);
    }
  }
  return means;
}

double relative_rmse(const Halves& fast, const Halves& reference, int size, int edge) {
  const std::vector<Rgb> f0 = coarse(fast.even, size, edge);
  const std::vector<Rgb> f1 = coarse(fast.odd, size, edge);
  const std::vector<Rgb> r0 = coarse(reference.even, size, edge);
  const std::vector<Rgb> r1 = coarse(reference.odd, size, edge);
  double squares = 0;
  double mean = 0;
  for (std::size_t k = 0; k < f0.size(); ++k) {
    squares += static_cast<double>(((f0[k] - r0[k]) * (f1[k] - r1[k])).mean());
    mean += static_cast<double>((r0[k] + r1[k]).mean()) / 2;
  }
  const double count = static_cast<double>(f0.size());
  return std::sqrt(std::max(0.0, squares / count)) / (mean / count);
}

void measure(const Setup& setup, StageContext& context) {
  const FabricDocument fabric = read_fabric_document(setup.fabric, {});
  const FabricConfig& cloth = fabric.config;
  const double width = warp_places(cloth).period_mm;
  const double height = weft_places(cloth).period_mm;
  const int size = setup.tiles * setup.pixels;
  const int lag_x = setup.pixels;
  const int lag_y = static_cast<int>(std::lround(setup.pixels * height / width));
  const std::string scattered = "blocks = { order = \"scattered\" }\n";
  const std::string drift =
      fmt::format("yarn_drift = {{ spacing_rms_percent = {}, across_mm = {}, along_mm = {} }}\n",
                  setup.drift_percent, setup.across_mm, setup.along_mm);
  const std::string tint = fmt::format("yarn_tint = {{ rms_percent = {} }}\n", setup.tint_percent);
  const std::pair<const char*, std::string> ways[] = {{"as woven", ""},
                                                      {"blocks scattered", scattered},
                                                      {"yarn drift", drift},
                                                      {"yarn tint", tint},
                                                      {"all", scattered + drift + tint}};
  fmt::print("{}: tile {:.3f} x {:.3f} mm, {} spp, {} x {} pixels\n", cloth.name, width, height,
             setup.spp, size, size);
  fmt::print("{:<18} {:>12} {:>12} {:>16} {:>12}\n", "", "peak, weft", "peak, warp",
             "error per pixel", "8 x 8 pixels");
  const fs::path file =
      fs::temp_directory_path() / fmt::format("heddle_uneven_{}.toml", ::getpid());
  for (const auto& [name, keys] : ways) {
    std::ofstream(file) << scene_text(setup, width, keys);
    const Halves path = picture(file, setup, RenderMethod::kPath, 1, context);
    const Halves exact = picture(file, setup, RenderMethod::kExact, 2, context);
    fmt::print("{:<18} {:>12.3f} {:>12.3f} {:>14.2f} % {:>10.2f} %\n", name,
               peak(path, size, lag_x, 0), peak(path, size, 0, lag_y),
               100 * relative_rmse(exact, path, size, 1),
               100 * relative_rmse(exact, path, size, 8));
  }
  fs::remove(file);
}

int run(int argc, char** argv) {
  Setup setup;
  CommonOptions options;
  CLI::App app("What breaks up the repeat of a cloth");
  app.add_option("fabric", setup.fabric)->required();
  app.add_option("--cache", options.cache);
  app.add_option("--tiles", setup.tiles);
  app.add_option("--pixels", setup.pixels);
  app.add_option("--spp", setup.spp);
  app.add_option("--drift", setup.drift_percent);
  app.add_option("--across", setup.across_mm);
  app.add_option("--along", setup.along_mm);
  app.add_option("--tint", setup.tint_percent);
  CLI11_PARSE(app, argc, argv);
  try {
    Job job(options);
    measure(setup, job.context());
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
