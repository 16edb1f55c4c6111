#ifndef HEDDLE_TESTS_PIPELINE_EVAL_ANSWER_H_
#define HEDDLE_TESTS_PIPELINE_EVAL_ANSWER_H_
// What `heddle eval` answers to one request.

#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "pipeline/eval/eval.h"

namespace heddle {

inline nlohmann::json answer(const nlohmann::json& request) {
  std::istringstream in(request.dump() + "\n");
  std::ostringstream out;
  run_eval(in, out);
  return nlohmann::json::parse(out.str());
}

template <class T = double>
T eval_value(const nlohmann::json& request) {
  const nlohmann::json result = answer(request);
  if (!result.contains("value")) throw std::runtime_error(result.dump());
  return result.at("value").get<T>();
}

/// Empty where there is none.
inline std::string eval_error(const nlohmann::json& request) {
  return answer(request).value("error", std::string());
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_PIPELINE_EVAL_ANSWER_H_
