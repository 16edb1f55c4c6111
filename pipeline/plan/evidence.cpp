#include "pipeline/plan/evidence.h"

#include <algorithm>
#include <cmath>

#include "pipeline/plan/policy.h"

namespace heddle {

Estimate combined(const Estimate& a, const Estimate& b) {
  if (!(a.error > 0)) return a;
  if (!(b.error > 0)) return b;
  const double weight_a = 1 / (a.error * a.error);
  const double weight_b = 1 / (b.error * b.error);
  return {(weight_a * a.value + weight_b * b.value) / (weight_a + weight_b),
          1 / std::sqrt(weight_a + weight_b)};
}

Estimate weighed(Estimate prior, Estimate measured, double unseen) {
  // No square is negative: what is below 0 is noise, whatever error the pilot states.
  measured.error = std::max(measured.error, -measured.value);
  const double square = std::max(prior.value, measured.value - measured.error);
  prior.error = std::max(prior.error, kPolicy.table_error * square);
  measured.error = std::hypot(measured.error, kPolicy.pilot_error * std::sqrt(unseen) * square);
  return combined(prior, measured);
}

Estimate posterior(const Estimate& prior, const PilotOfWay& pilot) {
  const Estimate& measured = pilot.bias_square;
  const Estimate raised = weighed(prior, measured, pilot.unseen);
  if (raised.value > prior.value) return raised;
  const double error = std::max(measured.error, -measured.value);
  const Estimate doubted{std::max(0.0, measured.value) + kPolicy.doubt_of_less * error, error};
  const Estimate lowered = weighed(prior, doubted, pilot.unseen);
  return lowered.value < prior.value ? lowered : prior;
}

}  // namespace heddle
