#include "pipeline/chart/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "pipeline/json_file.h"
#include "pipeline/version.h"

namespace heddle {
namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json error_json(const ChartError& error) {
  const PictureErrorEstimate& estimate = error.estimate;
  return {{"relative_rmse", estimate.relative_rmse},
          {"relative_rmse_low", estimate.rmse_low},
          {"relative_rmse_high", estimate.rmse_high},
          {"color_ratio", numbers_of(estimate.color_ratio)},
          {"color_ratio_error", numbers_of(estimate.color_ratio_error)},
          {"percentile99", estimate.percentile99},
          {"flip", error.flip}};
}

Json stage_json(const StageCost& cost) {
  const bool known = cost.seconds >= 0;
  return {{"stage", cost.stage},
          {"key", cost.key},
          {"seconds", known ? Json(cost.seconds) : Json(nullptr)},
          {"core_seconds", known ? Json(cost.core_seconds) : Json(nullptr)},
          {"threads", known ? Json(cost.threads) : Json(nullptr)}};
}

Json row_json(const ChartRow& row) {
  Json json = {{"method", row.run.method},
               {"label", row.run.label},
               {"renderer", render_method_name(row.run.request.method)},
               {"settings", row.run.settings},
               {"status", row.done() ? "done" : "failed"},
               {"message", row.message},
               {"key", row.key},
               {"seed", row.run.request.seed},
               {"program_version", row.program_version},
               {"threads", row.threads}};
  auto stages = Json::array();
  for (const StageCost& cost : row.stages) stages.push_back(stage_json(cost));
  json["stages"] = std::move(stages);
  json["precompute_seconds"] = or_null(row.precompute_seconds);
  json["precompute_core_seconds"] = or_null(row.precompute_core_seconds);
  const auto if_done = [&row](const Json& value) { return row.done() ? value : Json(nullptr); };
  json["render_seconds"] = if_done(row.render_seconds);
  json["render_core_seconds"] = if_done(row.render_core_seconds);
  json["total_seconds"] = if_done(or_null(row.total_seconds()));
  json["picture"] = if_done(row.picture.generic_string());
  for (const ReferenceKind kind : kReferenceKinds) {
    const auto k = static_cast<std::size_t>(kind);
    Json against = error_json(row.error[k]);
    against["difference"] = row.difference[k].generic_string();
    against["front_render"] = row.front_render[k];
    against["front_total"] = row.front_total[k];
    json["error"][reference_name(kind)] = if_done(against);
  }
  return json;
}

std::string csv_field(const Json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return value.dump();
  auto text = value.get<std::string>();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

const char* reference_name(ReferenceKind kind) {
  return kind == ReferenceKind::kFull ? "full" : "local";
}

std::vector<bool> pareto_front(std::span<const CostAndError> points) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (std::isfinite(points[k].cost) && std::isfinite(points[k].error)) order.push_back(k);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return points[a].cost != points[b].cost ? points[a].cost < points[b].cost
                                            : points[a].error < points[b].error;
  });
  // From cheap to dear: a point is on the front where it errs less than all cheaper ones, or
  // repeats the last such point.
  std::vector<bool> on_front(points.size(), false);
  const CostAndError* best = nullptr;
  for (const std::size_t k : order) {
    const bool repeats =
        best != nullptr && points[k].cost == best->cost && points[k].error == best->error;
    if (best != nullptr && !repeats && points[k].error >= best->error) continue;
    on_front[k] = true;
    best = &points[k];
  }
  return on_front;
}

void mark_fronts(Chart& chart) {
  for (std::size_t kind = 0; kind < 2; ++kind) {
    std::vector<CostAndError> render;
    std::vector<CostAndError> total;
    for (const ChartRow& row : chart.rows) {
      const double error = row.done() ? row.error[kind].estimate.relative_rmse : NAN;
      render.push_back({row.render_seconds, error});
      total.push_back({row.total_seconds().value_or(NAN), error});
    }
    const std::vector<bool> render_front = pareto_front(render);
    const std::vector<bool> total_front = pareto_front(total);
    for (std::size_t k = 0; k < chart.rows.size(); ++k) {
      chart.rows[k].front_render[kind] = render_front[k];
      chart.rows[k].front_total[kind] = total_front[k];
    }
  }
}

Json chart_json(const Chart& chart) {
  Json json = {{"format", "heddle chart"},
               {"version", 1},
               {"program_version", kProgramVersion},
               {"scene", {{"name", chart.scene}, {"file", chart.scene_file}, {"view", chart.view}}},
               {"picture",
                {{"width", chart.width},
                 {"height", chart.height},
                 {"crop",
                  {chart.crop.x0, chart.crop.y0, chart.crop.x0 + chart.crop.width,
                   chart.crop.y0 + chart.crop.height}}}},
               {"machine", {{"processor", chart.processor}, {"threads", chart.threads}}}};
  for (const ReferenceKind kind : kReferenceKinds) {
    const ChartReference& reference = chart.references[static_cast<std::size_t>(kind)];
    json["references"][reference_name(kind)] = {
        {"key", reference.key},
        {"seed", reference.request.seed},
        {"spp", reference.request.spp},
        {"seconds", reference.seconds},
        {"core_seconds", reference.core_seconds},
        {"relative_noise", reference.noise.rms},
        {"noise_percentile99", reference.noise.percentile99},
        {"flip_between_halves", reference.flip_between_halves},
        {"picture", reference.picture.generic_string()}};
  }
  json["rows"] = Json::array();
  for (const ChartRow& row : chart.rows) json["rows"].push_back(row_json(row));
  return json;
}

std::string chart_csv(const Chart& chart) {
  const Json rows = chart_json(chart).at("rows");
  std::string text;
  const auto add = [&text](const std::vector<std::string>& fields) {
    text += fmt::format("{}\n", fmt::join(fields, ","));
  };
  const std::vector<std::string> plain = {"method",
                                          "label",
                                          "status",
                                          "message",
                                          "key",
                                          "seed",
                                          "program_version",
                                          "threads",
                                          "precompute_seconds",
                                          "precompute_core_seconds",
                                          "render_seconds",
                                          "render_core_seconds",
                                          "total_seconds"};
  const std::vector<std::string> measured = {
      "relative_rmse", "relative_rmse_low", "relative_rmse_high", "percentile99",
      "flip",          "front_render",      "front_total"};
  const char* const channels[] = {"r", "g", "b"};
  std::vector<std::string> names = plain;
  names.insert(names.begin() + 2, "settings");
  for (const ReferenceKind kind : kReferenceKinds) {
    for (const std::string& name : measured)
      names.push_back(fmt::format("{}_{}", reference_name(kind), name));
    for (const char* channel : channels)
      names.push_back(fmt::format("{}_color_ratio_{}", reference_name(kind), channel));
  }
  add(names);
  for (const Json& row : rows) {
    std::vector<std::string> fields;
    for (const std::string& name : plain) fields.push_back(csv_field(row.at(name)));
    std::vector<std::string> settings;
    for (const auto& [name, value] : row.at("settings").items()) {
      settings.push_back(
          fmt::format("{}={}", name, value.is_string() ? value.get<std::string>() : value.dump()));
    }
    fields.insert(fields.begin() + 2, csv_field(fmt::format("{}", fmt::join(settings, " "))));
    for (const ReferenceKind kind : kReferenceKinds) {
      const Json& error = row.at("error").at(reference_name(kind));
      for (const std::string& name : measured)
        fields.push_back(error.is_null() ? "" : csv_field(error.at(name)));
      for (std::size_t c = 0; c < 3; ++c)
        fields.push_back(error.is_null() ? "" : error.at("color_ratio").at(c).dump());
    }
    add(fields);
  }
  return text;
}

}  // namespace heddle
