#ifndef HEDDLE_PIPELINE_PICTURE_COMPARE_H_
#define HEDDLE_PIPELINE_PICTURE_COMPARE_H_
// Error metrics of a picture against a reference, and a picture of the difference. `heddle compare`
// and the crops of `heddle run` report them. A reference with the layers half0 and half1 is used as
// two independent halves, so that its noise does not count as error; but not if both pictures come
// from one seed, since they then share noise. Tested in
// tests/pipeline/picture_compare_test.cpp.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "formats/image_file.h"
#include "render/image_metrics.h"

namespace heddle {

struct PictureComparison {
  PictureError error;
  bool halves = false;      // the reference came in two halves, which were used
  std::string shared_seed;  // of both pictures; empty where they differ or do not say
  Image difference;         // R, G, B: picture - reference
  // [height][width][3]: white = equal, red = too bright, blue = too dark
  std::vector<std::uint8_t> preview;
};

/// Compares the colours of one layer ("" is the beauty). Errors: ConfigError if sizes differ or a
/// layer is missing.
PictureComparison compare_images(const Image& picture, const std::string& picture_name,
                                 const Image& reference, const std::string& reference_name,
                                 const std::string& layer);

nlohmann::ordered_json comparison_report(const PictureComparison& comparison);

/// "relative RMSE 3.1 %, mean colour -0.4 % -0.6 % -1.0 % (64 x 64 pixels, reference in two
/// halves)"
std::string comparison_text(const PictureComparison& comparison);

/// The difference as EXR and, with the ending .png, as a preview.
void write_difference(const std::filesystem::path& exr, const PictureComparison& comparison);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PICTURE_COMPARE_H_
