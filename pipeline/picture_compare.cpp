#include "pipeline/picture_compare.h"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include "formats/input_error.h"
#include "render/render_output.h"

namespace heddle {
namespace {

/// As layer_of, for callers that cannot compare pictures with a missing layer.
std::vector<Rgb> colors_of(const Image& image, const std::string& layer, const std::string& name) {
  try {
    return layer_of(image, layer, name);
  } catch (const FileError& error) {
    throw ConfigError(error.what());
  }
}

/// The seed in the headers of both; empty where they differ or one does not say.
std::string shared_seed(const Image& a, const Image& b) {
  constexpr char kSeed[] = "heddle.seed";
  const auto of_a = a.metadata.find(kSeed);
  const auto of_b = b.metadata.find(kSeed);
  if (of_a == a.metadata.end() || of_b == b.metadata.end() || of_a->second != of_b->second)
    return "";
  return of_a->second;
}

}  // namespace

PictureComparison compare_images(const Image& picture, const std::string& picture_name,
                                 const Image& reference, const std::string& reference_name,
                                 const std::string& layer) {
  if (picture.width != reference.width || picture.height != reference.height) {
    throw ConfigError(fmt::format("not comparable: {} has {} x {} pixels, {} has {} x {}",
                                  picture_name, picture.width, picture.height, reference_name,
                                  reference.width, reference.height));
  }
  const std::vector<Rgb> colors = colors_of(picture, layer, picture_name);
  const std::vector<Rgb> expected = colors_of(reference, layer, reference_name);
  PictureComparison result;
  result.shared_seed = shared_seed(picture, reference);
  result.halves = result.shared_seed.empty() && layer.empty() &&
                  reference.channels.contains("half0.R") && reference.channels.contains("half1.R");
  if (result.halves) {
    const std::vector<Rgb> half0 = colors_of(reference, "half0", reference_name);
    const std::vector<Rgb> half1 = colors_of(reference, "half1", reference_name);
    result.error = compare_pictures(colors, {half0, half1}, {});
  } else {
    result.error = compare_pictures(colors, {expected, expected}, {});
  }

  result.difference.width = picture.width;
  result.difference.height = picture.height;
  result.difference.metadata = {{"comments", picture_name + " minus " + reference_name}};
  const char* const names[] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    ImageChannel channel{ChannelType::kFloat, {}, {}};
    channel.values.reserve(colors.size());
    for (std::size_t k = 0; k < colors.size(); ++k)
      channel.values.push_back(colors[k][c] - expected[k][c]);
    result.difference.channels[names[c]] = std::move(channel);
  }
  const double mean = result.error.mean_reference.mean();
  result.preview = difference_picture(colors, expected, mean > 0 ? mean : 1.0);
  return result;
}

nlohmann::ordered_json comparison_report(const PictureComparison& comparison) {
  const PictureError& error = comparison.error;
  const auto list = [](const Rgbd& color) {
    return nlohmann::ordered_json{color[0], color[1], color[2]};
  };
  return {{"pixels", error.pixels},
          {"relative_rmse", error.relative_rmse},
          {"mean_picture", list(error.mean_picture)},
          {"mean_reference", list(error.mean_reference)},
          {"relative_mean_difference", list(error.relative_difference)},
          {"reference_in_two_halves", comparison.halves},
          {"shared_seed", comparison.shared_seed.empty()
                              ? nlohmann::ordered_json()
                              : nlohmann::ordered_json(comparison.shared_seed)}};
}

std::string comparison_text(const PictureComparison& comparison) {
  const PictureError& error = comparison.error;
  return fmt::format(
      "relative RMSE {:.2f} %, mean colour {:+.2f} % {:+.2f} % {:+.2f} % ({} x {} pixels{})",
      100 * error.relative_rmse, 100 * error.relative_difference[0],
      100 * error.relative_difference[1], 100 * error.relative_difference[2],
      comparison.difference.width, comparison.difference.height,
      comparison.halves ? ", reference in two halves" : "; noise of the reference counts");
}

void write_difference(const std::filesystem::path& exr, const PictureComparison& comparison) {
  write_exr(exr, comparison.difference);
  write_png(std::filesystem::path(exr).replace_extension(".png"), comparison.difference.width,
            comparison.difference.height, comparison.preview);
}

}  // namespace heddle
