#ifndef HEDDLE_PIPELINE_ACCURACY_ACCURACY_TABLE_H_
#define HEDDLE_PIPELINE_ACCURACY_ACCURACY_TABLE_H_
// What the methods are worth on one fabric, measured on a flat and on a folded swatch of it
// (measure_accuracy.h): for lights of several sharpnesses and pixels of several footprints, each
// setting's error apart from noise, its noise and its speed; and what its data took to build. A
// small JSON file, the artifact of the stage `accuracy`; the planner reads it before anything else
// is built. Errors: FileError. Tested in tests/pipeline/accuracy_test.cpp.

#include <compare>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "pipeline/work_time.h"

namespace heddle {

/// Sharpness that stands for directional light: no spherical Gaussian is told from it.
inline constexpr double kDirectionalSharpness = 1e5;

/// One setting under one light, at one footprint. Squares are relative to the squared mean
/// radiance.
struct Accuracy {
  // mean square of (setting - path tracing), noise taken out; may be slightly negative
  double bias_square = 0;
  double bias_square_error = 0;  // one standard error, for another pair of view and light
  double noise_square = 0;       // variance of one sample of a pixel
  double change_square = 0;      // mean square of (setting - the one that it is a change of)
  Rgbd color_ratio = Rgbd::Ones();
};

/// The same with what does not depend on light and footprint.
struct SettingAccuracy {
  std::string name;
  double seconds_per_sample = 0;
  double setup_seconds = 0;       // per picture
  std::vector<Accuracy> entries;  // [light][footprint][height of the light], flat
  std::vector<Accuracy> bent;     // [light], a folded swatch in pixels of bent_footprint_mm
};

/// One thing that was built for a table: a stage, with one setting of the fabric changed or none.
struct CostKey {
  std::string stage;         // "maps", "transfer", ...
  std::string setting = {};  // that was changed, by its name in the table: "cells x 2"; or empty
  auto operator<=>(const CostKey&) const = default;
};

struct AccuracyTable {
  std::string fabric;                // its name
  std::string key;                   // of the stage
  int threads = 0;                   // that the times were measured with
  std::vector<double> sharpness;     // [light] increasing
  std::vector<double> footprint_mm;  // [footprint] edge of a pixel on the cloth, increasing
  // [height of the light] to the normal of the flat cloth, increasing
  std::vector<double> light_cosine;
  double bent_footprint_mm = 0;
  double bent_light_cosine = 0;
  // Light from fold to fold, which the entries of the folded swatch leave out: [light] squared
  // error without it, and the mean square of what the folds see of each other (enclosure.h). Empty
  // and 0 of surfaces.
  std::vector<double> bent_between;
  double bent_enclosure_square = 0;
  Rgbd color = Rgbd::Ones();  // of the flat cloth, relative to the mean of the channels
  // Radiance of the flat cloth lit from behind, relative to that under the same light from its
  // face; 0 of surfaces, which are alike on both sides.
  double through = 0;
  std::vector<SettingAccuracy> settings;  // "path" first
  std::map<CostKey, WorkTime> costs;      // of building

  bool has(const std::string& setting) const;
  const SettingAccuracy& setting(const std::string& name) const;
  /// Linear in the logarithms of sharpness and footprint, and in the cosine; the nearest entry
  /// beyond the ends.
  Accuracy at(const std::string& setting, double sharpness, double footprint_mm,
              double light_cosine) const;
  /// The same of the folded swatch.
  Accuracy at_bent(const std::string& setting, double sharpness) const;
  /// bent_between, linear in the logarithm of sharpness; 0 where there is none.
  double between_at(double sharpness) const;
};

nlohmann::ordered_json accuracy_json(const AccuracyTable& table);
void write_accuracy(const std::filesystem::path& path, const AccuracyTable& table);
AccuracyTable read_accuracy(const std::filesystem::path& path);

/// The table for people: one line per setting and light.
std::string accuracy_text(const AccuracyTable& table);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ACCURACY_ACCURACY_TABLE_H_
