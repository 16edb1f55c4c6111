#include "pipeline/eval/eval_request.h"

#include <algorithm>
#include <cmath>

#include "fibers/math/spherical_harmonics.h"

namespace heddle {
namespace {

std::string text_of(double value) {
  return nlohmann::json(value).dump();
}

}  // namespace

void EvalObject::fail(const std::string& field, const std::string& expected) const {
  throw EvalError("field \"" + prefix_ + field + "\": " + expected);
}

const nlohmann::json& EvalObject::value(const std::string& field) {
  known_.insert(field);
  const auto found = object_->find(field);
  if (found == object_->end()) throw EvalError("missing field \"" + prefix_ + field + "\"");
  return *found;
}

double EvalObject::number(const std::string& field, double min, double max) {
  const nlohmann::json& json = value(field);
  if (!json.is_number()) fail(field, "expected a number");
  const double number = json.get<double>();
  if (number < min || number > max) {
    fail(field, std::isinf(max) ? "must be at least " + text_of(min)
                                : "must lie between " + text_of(min) + " and " + text_of(max));
  }
  return number;
}

int EvalObject::integer(const std::string& field, int min, int max) {
  const nlohmann::json& json = value(field);
  const double number = json.is_number() ? json.get<double>() : std::nan("");
  if (!(number >= min && number <= max && number == std::floor(number))) {
    fail(field, "must be an integer from " + std::to_string(min) + " to " + std::to_string(max));
  }
  return static_cast<int>(number);
}

std::string EvalObject::string(const std::string& field) {
  const nlohmann::json& json = value(field);
  if (!json.is_string()) fail(field, "expected a string");
  return json.get<std::string>();
}

std::string EvalObject::choice(const std::string& field,
                               std::initializer_list<std::string_view> allowed,
                               std::string_view fallback) {
  if (!fallback.empty() && !has(field)) return std::string(fallback);
  std::string chosen = string(field);
  if (std::find(allowed.begin(), allowed.end(), chosen) == allowed.end()) {
    std::string list;
    for (const std::string_view name : allowed)
      list += (list.empty() ? "\"" : ", \"") + std::string(name) + "\"";
    fail(field, "must be one of " + list);
  }
  return chosen;
}

std::vector<double> EvalObject::numbers(const std::string& field, std::size_t count) {
  const nlohmann::json& json = value(field);
  if (!json.is_array() || json.size() != count ||
      !std::all_of(json.begin(), json.end(),
                   [](const nlohmann::json& item) { return item.is_number(); })) {
    fail(field, "expected " + std::to_string(count) + " numbers");
  }
  return json.get<std::vector<double>>();
}

Vec3d unit_vector(const Vec3d& vector, const std::string& name) {
  const double length = vector.norm();
  if (!(std::abs(length - 1.0) <= 1e-3)) {
    throw EvalError("field \"" + name + "\": must be a unit vector, its length is " +
                    text_of(length));
  }
  return vector / length;
}

Vec3d EvalObject::direction(const std::string& field) {
  const std::vector<double> v = numbers(field, 3);
  return unit_vector(Vec3d(v[0], v[1], v[2]), prefix_ + field);
}

double EvalObject::inclination(const std::string& field_deg) {
  return radians(number(field_deg, -90.0, 90.0));
}

int EvalObject::order(const std::string& field) {
  return integer(field, 0, kMaxShOrder);
}

EvalObject EvalObject::object(const std::string& field) {
  const nlohmann::json& json = value(field);
  if (!json.is_object()) fail(field, "expected an object");
  return {json, prefix_ + field + "."};
}

void EvalObject::finish() const {
  for (const auto& item : object_->items()) {
    if (!known_.contains(item.key()))
      throw EvalError("unknown field \"" + prefix_ + item.key() + "\"");
  }
}

}  // namespace heddle
