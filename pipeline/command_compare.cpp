#include <iostream>
#include <nlohmann/json.hpp>

#include "formats/input_error.h"
#include "pipeline/commands.h"
#include "pipeline/console.h"
#include "pipeline/picture_compare.h"

namespace heddle {
namespace {

/// A picture that cannot be read cannot be compared: status 2. Here 1 means "beyond the limit".
Image read_comparable(const std::filesystem::path& path) {
  try {
    return read_exr(path);
  } catch (const FileError& error) {
    throw ConfigError(std::string("not comparable: ") + error.what());
  }
}

}  // namespace

int compare_command(const CompareOptions& options, const CommonOptions& common) {
  const Image a = read_comparable(options.a);
  const Image b = read_comparable(options.b);
  const PictureComparison comparison =
      compare_images(a, options.a.string(), b, options.b.string(), options.layer);
  if (options.output) write_difference(*options.output, comparison);
  if (common.json) {
    std::cout << comparison_report(comparison).dump(2) << '\n';
  } else {
    std::cout << comparison_text(comparison) << '\n';
  }
  if (!comparison.shared_seed.empty() && comparison.error.mean_square != 0) {
    Console(std::cerr, false, common.quiet)
        .warn(
            "both pictures come from seed " + comparison.shared_seed +
            " and share part of their noise: the error shown is that of this pair only. Render one "
            "of them with another --seed.");
  }
  const PictureError& error = comparison.error;
  const bool rmse_beyond = options.max_rmse && error.relative_rmse > *options.max_rmse;
  const bool mean_beyond =
      options.max_mean && error.relative_difference.abs().maxCoeff() > *options.max_mean;
  return rmse_beyond || mean_beyond ? 1 : 0;
}

}  // namespace heddle
