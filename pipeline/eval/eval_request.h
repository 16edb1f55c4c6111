#ifndef HEDDLE_PIPELINE_EVAL_EVAL_REQUEST_H_
#define HEDDLE_PIPELINE_EVAL_EVAL_REQUEST_H_
// Strict access to the fields of one JSON object. Every error names its field. A field that nobody
// asked for is an error. Ranges are those of docs/eval.md. Tested in tests/pipeline/eval_test.cpp.

#include <initializer_list>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "fibers/math/vector.h"

namespace heddle {

/// What is wrong with a request; what() becomes its "error".
class EvalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class EvalObject {
 public:
  /// `prefix` goes before field names in messages ("fiber."). The JSON value must outlive this.
  EvalObject(const nlohmann::json& object, std::string prefix)
      : object_(&object), prefix_(std::move(prefix)) {}

  bool has(const std::string& field) const { return object_->contains(field); }

  /// The raw value; EvalError if there is none. Marks the field as known.
  const nlohmann::json& value(const std::string& field);

  double number(const std::string& field, double min = -std::numeric_limits<double>::infinity(),
                double max = std::numeric_limits<double>::infinity());
  int integer(const std::string& field, int min, int max);
  std::string string(const std::string& field);
  /// One of `allowed`; `fallback` when the field is missing and the fallback is not empty.
  std::string choice(const std::string& field, std::initializer_list<std::string_view> allowed,
                     std::string_view fallback = {});
  /// [count] finite numbers.
  std::vector<double> numbers(const std::string& field, std::size_t count);

  /// A unit vector: off by at most 1e-3 in length, normalised here.
  Vec3d direction(const std::string& field);
  /// Degrees from the normal plane, at most 90 either way; returned in radians.
  double inclination(const std::string& field_deg);
  double sharpness(const std::string& field) { return number(field, 0.0); }
  int order(const std::string& field);
  EvalObject object(const std::string& field);

  /// EvalError for the first field that was not asked for.
  void finish() const;

  [[noreturn]] void fail(const std::string& field, const std::string& expected) const;

 private:
  const nlohmann::json* object_;
  std::string prefix_;
  std::set<std::string> known_;
};

/// A unit vector out of three numbers, as EvalObject::direction; `name` is for the message.
Vec3d unit_vector(const Vec3d& vector, const std::string& name);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_EVAL_EVAL_REQUEST_H_
