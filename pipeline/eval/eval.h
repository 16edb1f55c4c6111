#ifndef HEDDLE_PIPELINE_EVAL_EVAL_H_
#define HEDDLE_PIPELINE_EVAL_EVAL_H_
// `heddle eval`: JSON objects in, one per line; one JSON object out for each, in the same order.
// The protocol and the table of quantities: docs/eval.md. Tested in tests/pipeline/eval_test.cpp.

#include <iosfwd>

namespace heddle {

/// Answers every line of `in` on `out`, flushing each. Returns the exit status: 0 when every line
/// had a value, 1 when one had an error or `out` failed.
int run_eval(std::istream& in, std::ostream& out);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_EVAL_EVAL_H_
