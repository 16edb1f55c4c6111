#include "pipeline/accuracy/accuracy_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "pipeline/json_file.h"

namespace heddle {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormatVersion = 3;

/// A cost's name in the file: "maps", or "transfer, cells x 2".
std::string name_of(const CostKey& key) {
  return key.setting.empty() ? key.stage : key.stage + ", " + key.setting;
}
CostKey cost_key_of(const std::string& name) {
  const std::size_t comma = name.find(", ");
  if (comma == std::string::npos) return {name};
  return {name.substr(0, comma), name.substr(comma + 2)};
}

/// Between which two values of an increasing list, and how far on the way.
struct Place {
  std::size_t low = 0;
  std::size_t high = 0;
  double share = 0;

  double weight(bool of_high) const { return of_high ? share : 1 - share; }
};
/// On a scale of its own.
template <class Scale>
Place place_of(const std::vector<double>& values, double value, Scale&& scale) {
  if (value <= values.front()) return {0, 0, 0};
  if (value >= values.back()) return {values.size() - 1, values.size() - 1, 0};
  const auto above = std::upper_bound(values.begin(), values.end(), value);
  const auto high = static_cast<std::size_t>(above - values.begin());
  const double low = scale(values[high - 1]);
  return {high - 1, high, (scale(value) - low) / (scale(values[high]) - low)};
}

/// Values below 1e-3 count as that.
double logarithm(double value) {
  return std::log(std::max(value, 1e-3));
}

const Accuracy kNothing{0, 0, 0, 0, Rgbd::Zero()};
void add_weighted(const Accuracy& entry, double weight, Accuracy& sum) {
  sum.bias_square += weight * entry.bias_square;
  sum.bias_square_error += weight * entry.bias_square_error;
  sum.noise_square += weight * entry.noise_square;
  sum.change_square += weight * entry.change_square;
  sum.color_ratio += weight * entry.color_ratio;
}

Json entries_json(const std::vector<Accuracy>& entries) {
  Json json = Json::array();
  for (const Accuracy& entry : entries) {
    json.push_back(
        {{"bias_square", entry.bias_square},
         {"bias_square_error", entry.bias_square_error},
         {"noise_square", entry.noise_square},
         {"change_square", entry.change_square},
         {"color_ratio", {entry.color_ratio[0], entry.color_ratio[1], entry.color_ratio[2]}}});
  }
  return json;
}

std::vector<Accuracy> entries_of(const nlohmann::json& json) {
  std::vector<Accuracy> entries;
  for (const nlohmann::json& values : json) {
    const auto ratio = values.at("color_ratio").get<std::array<double, 3>>();
    entries.push_back(
        {values.at("bias_square").get<double>(), values.at("bias_square_error").get<double>(),
         values.at("noise_square").get<double>(), values.at("change_square").get<double>(),
         Rgbd(ratio[0], ratio[1], ratio[2])});
  }
  return entries;
}

}  // namespace

bool AccuracyTable::has(const std::string& name) const {
  return std::any_of(settings.begin(), settings.end(),
                     [&](const SettingAccuracy& s) { return s.name == name; });
}

const SettingAccuracy& AccuracyTable::setting(const std::string& name) const {
  const auto found = std::find_if(settings.begin(), settings.end(),
                                  [&](const SettingAccuracy& s) { return s.name == name; });
  if (found == settings.end())
    throw FileError(fmt::format("accuracy of {}: nothing about \"{}\"", fabric, name));
  return *found;
}

Accuracy AccuracyTable::at(const std::string& name, double light_sharpness, double footprint,
                           double cosine) const {
  const SettingAccuracy& of = setting(name);
  const Place light = place_of(sharpness, light_sharpness, logarithm);
  const Place pixel = place_of(footprint_mm, footprint, logarithm);
  const Place height = place_of(light_cosine, cosine, [](double value) { return value; });
  Accuracy result = kNothing;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const bool high[] = {(corner & 1U) != 0, (corner & 2U) != 0, (corner & 4U) != 0};
    const std::size_t l = high[0] ? light.high : light.low;
    const std::size_t f = high[1] ? pixel.high : pixel.low;
    const std::size_t h = high[2] ? height.high : height.low;
    add_weighted(of.entries[(l * footprint_mm.size() + f) * light_cosine.size() + h],
                 light.weight(high[0]) * pixel.weight(high[1]) * height.weight(high[2]), result);
  }
  return result;
}

Accuracy AccuracyTable::at_bent(const std::string& name, double light_sharpness) const {
  const SettingAccuracy& of = setting(name);
  const Place light = place_of(sharpness, light_sharpness, logarithm);
  Accuracy result = kNothing;
  add_weighted(of.bent[light.low], 1 - light.share, result);
  add_weighted(of.bent[light.high], light.share, result);
  return result;
}

double AccuracyTable::between_at(double light_sharpness) const {
  if (bent_between.empty()) return 0;
  const Place light = place_of(sharpness, light_sharpness, logarithm);
  return std::max(
      0.0, (1 - light.share) * bent_between[light.low] + light.share * bent_between[light.high]);
}

Json accuracy_json(const AccuracyTable& table) {
  Json json = {{"format", "heddle accuracy"},
               {"version", kFormatVersion},
               {"fabric", table.fabric},
               {"key", table.key},
               {"threads", table.threads},
               {"sharpness", table.sharpness},
               {"footprint_mm", table.footprint_mm},
               {"light_cosine", table.light_cosine},
               {"bent_footprint_mm", table.bent_footprint_mm},
               {"bent_light_cosine", table.bent_light_cosine},
               {"bent_between", table.bent_between},
               {"bent_enclosure_square", table.bent_enclosure_square},
               {"color", {table.color[0], table.color[1], table.color[2]}},
               {"through", table.through}};
  json["settings"] = Json::array();
  for (const SettingAccuracy& setting : table.settings) {
    json["settings"].push_back({{"name", setting.name},
                                {"seconds_per_sample", setting.seconds_per_sample},
                                {"setup_seconds", setting.setup_seconds},
                                {"entries", entries_json(setting.entries)},
                                {"bent", entries_json(setting.bent)}});
  }
  json["costs"] = Json::object();
  for (const auto& [key, cost] : table.costs) {
    json["costs"][name_of(key)] = {{"seconds", cost.seconds}, {"core_seconds", cost.core_seconds}};
  }
  return json;
}

void write_accuracy(const std::filesystem::path& path, const AccuracyTable& table) {
  write_file_atomically(path, accuracy_json(table).dump(1) + "\n");
}

AccuracyTable read_accuracy(const std::filesystem::path& path) {
  const nlohmann::json json = read_json(path);
  try {
    if (json.at("format") != "heddle accuracy" || json.at("version") != kFormatVersion) {
      throw FileError(path.string() + ": not an accuracy table of this version");
    }
    AccuracyTable table;
    table.fabric = json.at("fabric").get<std::string>();
    table.key = json.at("key").get<std::string>();
    if (!json.at("threads").is_number_integer())
      throw FileError(path.string() + ": threads is no integer");
    table.threads = json.at("threads").get<int>();
    table.sharpness = json.at("sharpness").get<std::vector<double>>();
    table.footprint_mm = json.at("footprint_mm").get<std::vector<double>>();
    table.light_cosine = json.at("light_cosine").get<std::vector<double>>();
    table.bent_footprint_mm = json.at("bent_footprint_mm").get<double>();
    table.bent_light_cosine = json.at("bent_light_cosine").get<double>();
    table.bent_between = json.at("bent_between").get<std::vector<double>>();
    table.bent_enclosure_square = json.at("bent_enclosure_square").get<double>();
    const auto color = json.at("color").get<std::array<double, 3>>();
    table.color = Rgbd(color[0], color[1], color[2]);
    table.through = json.at("through").get<double>();
    const std::size_t count =
        table.sharpness.size() * table.footprint_mm.size() * table.light_cosine.size();
    const auto increases = [](const std::vector<double>& values) {
      return !values.empty() && values.front() >= 0 &&
             std::adjacent_find(values.begin(), values.end(), std::greater_equal<>()) ==
                 values.end();
    };
    if (!increases(table.sharpness) || !increases(table.footprint_mm) ||
        !increases(table.light_cosine) || table.threads < 1) {
      throw FileError(path.string() +
                      ": an accuracy table without increasing sharpnesses, footprints and cosines");
    }
    if (!table.bent_between.empty() && table.bent_between.size() != table.sharpness.size()) {
      throw FileError(path.string() + ": light from fold to fold is not given for every sharpness");
    }
    for (const nlohmann::json& entry : json.at("settings")) {
      SettingAccuracy setting;
      setting.name = entry.at("name").get<std::string>();
      setting.seconds_per_sample = entry.at("seconds_per_sample").get<double>();
      setting.setup_seconds = entry.at("setup_seconds").get<double>();
      setting.entries = entries_of(entry.at("entries"));
      setting.bent = entries_of(entry.at("bent"));
      if (setting.entries.size() != count || setting.bent.size() != table.sharpness.size()) {
        throw FileError(path.string() + ": entries of " + setting.name + " are missing");
      }
      table.settings.push_back(std::move(setting));
    }
    for (const auto& [name, cost] : json.at("costs").items()) {
      table.costs[cost_key_of(name)] = {cost.at("seconds").get<double>(),
                                        cost.at("core_seconds").get<double>()};
    }
    return table;
  } catch (const nlohmann::json::exception& error) {
    throw FileError(fmt::format("{}: not an accuracy table: {}", path.string(), error.what()));
  }
}

std::string accuracy_text(const AccuracyTable& table) {
  std::string text = fmt::format("{:<22} {:>12} ", "RMSE in % (noise/√spp)", "sharpness");
  for (const double footprint : table.footprint_mm)
    text += fmt::format("{:>12}", fmt::format("{:.3g} mm", footprint));
  text += fmt::format("{:>12}{:>16}\n", "folded", "µs per sample");
  for (const SettingAccuracy& setting : table.settings) {
    for (std::size_t l = 0; l < table.sharpness.size(); ++l) {
      const bool directional = table.sharpness[l] >= kDirectionalSharpness;
      text += fmt::format("{:<22} {:>12} ", l == 0 ? setting.name : "",
                          directional ? "directional" : fmt::format("{:g}", table.sharpness[l]));
      const auto add = [&text](const Accuracy& entry) {
        text +=
            fmt::format("{:>12}", fmt::format("{:.1f} ({:.0f})",
                                              100 * std::sqrt(std::max(0.0, entry.bias_square)),
                                              100 * std::sqrt(std::max(0.0, entry.noise_square))));
      };
      const std::size_t heights = table.light_cosine.size();
      for (std::size_t h = heights; h-- > 0;) {
        if (h + 1 < heights) text += fmt::format("{:<22} {:>12} ", "", "low light");
        for (std::size_t f = 0; f < table.footprint_mm.size(); ++f)
          add(setting.entries[(l * table.footprint_mm.size() + f) * heights + h]);
        if (h + 1 < heights) {
          text += "\n";
          continue;
        }
        add(setting.bent[l]);
        text += l == 0 ? fmt::format("{:>15.3g}\n", 1e6 * setting.seconds_per_sample) : "\n";
      }
    }
  }
  for (std::size_t l = 0; l < table.bent_between.size(); ++l) {
    text += fmt::format("{} {:.1f} %{}", l == 0 ? "light from fold to fold, by sharpness:" : ",",
                        100 * std::sqrt(std::max(0.0, table.bent_between[l])),
                        l + 1 < table.bent_between.size() ? "" : "\n");
  }
  text +=
      fmt::format("lit from behind: {:.2f} of what it shows lit from its face\n", table.through);
  for (const auto& [key, cost] : table.costs) {
    text += fmt::format("to build {:<26} {:.3g} s ({} threads)\n", name_of(key), cost.seconds,
                        table.threads);
  }
  return text;
}

}  // namespace heddle
