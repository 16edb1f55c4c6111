#ifndef HEDDLE_TESTS_PIPELINE_EVAL_ANSWER_H_
#define HEDDLE_TESTS_PIPELINE_EVAL_ANSWER_H_
// What `heddle eval` answers to one request.

#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline/eval/eval.h"

namespace heddle {

inline nlohmann::json answer(const nlohmann::json& request) {
  std::istringstream in(request.dump() + "\n");
  std::ostringstream out;
  run_eval(in, out);
  return nlohmann::json::parse(out.str());
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_PIPELINE_EVAL_ANSWER_H_
