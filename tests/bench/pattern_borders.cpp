// How wrong a patterned cloth is where its fabrics meet, against path tracing of the cloth woven as
// a whole. Not a test: it prints a table.
//
//   heddle_pattern_borders GROUND FIGURE [--cache DIR] [--blocks N] [--sample M] [--spp S]
//     [--pixels P]
//
// GROUND and FIGURE are fabrics that differ in their weave only. An ornament of N x N blocks is
// seen straight from above, P pixels per crossing. The reference is path-traced with the sample
// being the ornament itself, so that every yarn lies as woven. Against it:
//   other seed        the same woven with other random numbers: what the fibers' wander alone makes
//   cut, path         borders as in Khungurn 2017, section 6.4; the error of its geometry
//   cut, exact        the same from precomputed data
//   woven, path       blocks of a sample of at most M blocks (pipeline/border_sample.h)
//   woven, exact      the same from precomputed data
// Errors are relative RMSE of means over crossings and over blocks, noise taken out by two halves
// of the samples: over all, over blocks with a neighbour of the other fabric, and over the rest.
// The difference of the means of the whole picture is the last column.

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

namespace heddle {
namespace {

namespace fs = std::filesystem;

struct BorderSetup {
  std::string ground;
  std::string figure;
  int blocks = 6;
  int sample = 16;
  int spp = 64;
  int pixels = 2;  // per crossing
};

/// A lozenge with a hole, and a stem.
bool is_figure(int column, int row, int size) {
  const double x = std::abs(column + 0.5 - 0.5 * size) / size;
  const double y = std::abs(row + 0.5 - 0.5 * size) / size;
  return (x + y < 0.42 && x + y > 0.12) || (column == size / 2 && row < size / 4);
}

struct BorderHalves {
  std::vector<Rgb> even;
  std::vector<Rgb> odd;
};

class Ornament {
 public:
  Ornament(const BorderSetup& setup, const fs::path& folder, StageContext& context)
      : setup_(setup), folder_(folder), context_(&context) {
    const FabricConfig fabric = read_fabric_document(setup.ground, {}).config;
    ends_ = fabric.weave.ends;
    picks_ = fabric.weave.picks;
    width_ = setup.blocks * ends_ * fabric.warp.spacing_mm;
    height_ = setup.blocks * picks_ * fabric.weft.spacing_mm;
    std::vector<std::uint8_t> rgb;
    for (int row = 0; row < setup.blocks; ++row) {
      for (int column = 0; column < setup.blocks; ++column) {
        for (int c = 0; c < 3; ++c)
          rgb.push_back(is_figure(column, setup.blocks - 1 - row, setup.blocks) ? 255 : 0);
      }
    }
    write_png(folder / "ornament.png", setup.blocks, setup.blocks, rgb);
  }

  int columns() const { return setup_.blocks * ends_; }  // crossings
  int rows() const { return setup_.blocks * picks_; }
  int ends() const { return ends_; }
  int picks() const { return picks_; }

  bool at_border(int column, int row) const {
    const auto at = [&](int x, int y) {
      const int n = setup_.blocks;
      return is_figure((x + n) % n, (y + n) % n, n);
    };
    for (const auto& [x, y] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      if (at(column + x, row + y) != at(column, row)) return true;
    }
    return false;
  }

  /// Means over crossings, [row upwards][column].
  BorderHalves picture(const std::string& borders, int sample, RenderMethod method,
                       std::uint64_t seed, std::optional<std::uint64_t> fabric_seed = {}) const {
    const fs::path file = folder_ / "ornament.toml";
    std::ofstream(file) << text(borders, sample);
    context_->fabric_seed = fabric_seed;
    SceneJob job(file, *context_);
    PictureRequest request = job.request(job.config().views.front());
    request.method = method;
    request.spp = setup_.spp;
    request.seed = seed;
    request.local = method == RenderMethod::kPath;
    const PixelRect all = request.crop;
    const SceneJob::Crops crops = job.render_crops(request, std::span(&all, 1));
    context_->fabric_seed.reset();
    return {crossings(crops.frames[0].half0), crossings(crops.frames[0].half1)};
  }

 private:
  std::string text(const std::string& borders, int sample) const {
    const double distance = 600;
    const auto fabric = [](const std::string& file, const char* color) {
      return fmt::format("[[cloth.pattern.fabric]]\ncolor = \"{}\"\nfile = \"{}\"\n", color,
                         fs::absolute(file).string());
    };
    return fmt::format(
               "name = \"ornament\"\n[camera]\nposition_mm = [{0}, {1}, {2}]\n"
               "look_at_mm = [{0}, {1}, 0]\nup = [0, 1, 0]\nfov_deg = {3:.9f}\n"
               "fov_axis = \"horizontal\"\nresolution_px = [{4}, {5}]\n[[light]]\n"
               "type = \"directional\"\ndirection = [0.5, 0.4, 0.8]\nirradiance = [3, 3, 3]\n"
               "[[cloth]]\nflat_mm = [{6}, {6}]\nunderlay = true\n[cloth.pattern]\n"
               "picture = \"ornament.png\"\nborders = \"{7}\"\nsample_blocks = {8}\n",
               0.5 * width_, 0.5 * height_, distance,
               degrees(2 * std::atan(0.5 * width_ / distance)), columns() * setup_.pixels,
               static_cast<int>(std::lround(columns() * setup_.pixels * height_ / width_)),
               4 * std::max(width_, height_), borders, sample) +
           fabric(setup_.ground, "#000000") + fabric(setup_.figure, "#ffffff");
  }

  std::vector<Rgb> crossings(const std::vector<Rgb>& pixels) const {
    const int wide = columns() * setup_.pixels;
    const int high = static_cast<int>(pixels.size()) / wide;
    std::vector<Rgb> sums(static_cast<std::size_t>(columns() * rows()), Rgb::Zero());
    std::vector<float> counts(sums.size(), 0.0F);
    for (int y = 0; y < high; ++y) {
      for (int x = 0; x < wide; ++x) {
        const int row = (high - 1 - y) * rows() / high;
        const auto at = static_cast<std::size_t>(row * columns() + x / setup_.pixels);
        sums[at] += pixels[static_cast<std::size_t>(y * wide + x)];
        counts[at] += 1;
      }
    }
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] /= counts[k];
    return sums;
  }

  BorderSetup setup_;
  fs::path folder_;
  StageContext* context_;
  int ends_;
  int picks_;
  double width_;
  double height_;
};

struct BorderErrors {
  double all, border, inside;
};

BorderErrors errors_of(const Ornament& ornament, const BorderHalves& f, const BorderHalves& r,
                       bool by_block) {
  const int columns = by_block ? ornament.columns() / ornament.ends() : ornament.columns();
  const int rows = by_block ? ornament.rows() / ornament.picks() : ornament.rows();
  const auto coarse = [&](const std::vector<Rgb>& values) {
    std::vector<Rgb> means(static_cast<std::size_t>(columns * rows), Rgb::Zero());
    for (int row = 0; row < ornament.rows(); ++row) {
      for (int column = 0; column < ornament.columns(); ++column) {
        const int y = row * rows / ornament.rows();
        const int x = column * columns / ornament.columns();
        means[static_cast<std::size_t>(y * columns + x)] +=
            values[static_cast<std::size_t>(row * ornament.columns() + column)] *
            static_cast<float>(columns * rows) /
            static_cast<float>(ornament.columns() * ornament.rows());
      }
    }
    return means;
  };
  const std::vector<Rgb> f0 = coarse(f.even);
  const std::vector<Rgb> f1 = coarse(f.odd);
  const std::vector<Rgb> r0 = coarse(r.even);
  const std::vector<Rgb> r1 = coarse(r.odd);
  double squares[2] = {0, 0};
  double counts[2] = {0, 0};
  double mean = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto k = static_cast<std::size_t>(row * columns + column);
      const int blocks_x = ornament.columns() / ornament.ends();
      const int blocks_y = ornament.rows() / ornament.picks();
      const int place =
          ornament.at_border(column * blocks_x / columns, row * blocks_y / rows) ? 1 : 0;
      squares[place] += static_cast<double>(((f0[k] - r0[k]) * (f1[k] - r1[k])).mean());
      counts[place] += 1;
      mean += static_cast<double>((r0[k] + r1[k]).mean()) / 2;
    }
  }
  mean /= counts[0] + counts[1];
  const auto error = [&](double sum, double count) {
    return 100 * std::sqrt(std::max(0.0, sum / std::max(1.0, count))) / mean;
  };
  return {error(squares[0] + squares[1], counts[0] + counts[1]), error(squares[1], counts[1]),
          error(squares[0], counts[0])};
}

double mean_of(const BorderHalves& halves) {
  double sum = 0;
  for (std::size_t k = 0; k < halves.even.size(); ++k)
    sum += static_cast<double>((halves.even[k] + halves.odd[k]).mean());
  return sum;
}

void measure_borders(const BorderSetup& setup, const fs::path& folder, StageContext& context) {
  const Ornament ornament(setup, folder, context);
  const int whole = setup.blocks * setup.blocks;
  const BorderHalves reference = ornament.picture("woven", whole, RenderMethod::kPath, 1);
  fmt::print("{} x {} blocks, sample of {}, {} spp; errors in %\n", setup.blocks, setup.blocks,
             setup.sample, setup.spp);
  fmt::print("{:<14}  crossings: {:>6} {:>7} {:>7}   blocks: {:>6} {:>7} {:>7}   {:>6}\n", "",
             "all", "border", "inside", "all", "border", "inside", "mean");
  const auto print = [&](const char* name, const BorderHalves& picture) {
    const BorderErrors fine = errors_of(ornament, picture, reference, false);
    const BorderErrors coarse = errors_of(ornament, picture, reference, true);
    fmt::print(
        "{:<14}             {:>6.1f} {:>7.1f} {:>7.1f}           {:>6.1f} {:>7.1f} {:>7.1f}   "
        "{:>+6.2f}\n",
        name, fine.all, fine.border, fine.inside, coarse.all, coarse.border, coarse.inside,
        100 * (mean_of(picture) / mean_of(reference) - 1));
    std::fflush(stdout);
  };
  print("other seed", ornament.picture("woven", whole, RenderMethod::kPath, 2, 77));
  print("cut, path", ornament.picture("cut", 4, RenderMethod::kPath, 2));
  print("cut, exact", ornament.picture("cut", 4, RenderMethod::kExact, 2));
  print("woven, path", ornament.picture("woven", setup.sample, RenderMethod::kPath, 2));
  print("woven, exact", ornament.picture("woven", setup.sample, RenderMethod::kExact, 2));
}

int run_borders(int argc, char** argv) {
  BorderSetup setup;
  CommonOptions options;
  CLI::App app("Errors at the borders of a pattern");
  app.add_option("ground", setup.ground)->required();
  app.add_option("figure", setup.figure)->required();
  app.add_option("--cache", options.cache);
  app.add_option("--blocks", setup.blocks);
  app.add_option("--sample", setup.sample);
  app.add_option("--spp", setup.spp);
  app.add_option("--pixels", setup.pixels);
  CLI11_PARSE(app, argc, argv);
  const fs::path folder = fs::temp_directory_path() / fmt::format("heddle_borders_{}", ::getpid());
  fs::create_directories(folder);
  int status = 0;
  try {
    Job job(options);
    measure_borders(setup, folder, job.context());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    status = 1;
  }
  fs::remove_all(folder);
  return status;
}

}  // namespace
}  // namespace heddle

int main(int argc, char** argv) {
  return heddle::run_borders(argc, argv);
}
