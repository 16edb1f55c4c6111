#ifndef HEDDLE_PIPELINE_PLAN_EVIDENCE_H_
#define HEDDLE_PIPELINE_PLAN_EVIDENCE_H_
// How what is known of a squared error before a pilot (the prior) and what a pilot measures are
// put together. Pure functions. Tested in tests/pipeline/plan_test.cpp.

#include "pipeline/accuracy/probe.h"

namespace heddle {

/// Two independent estimates of one quantity: the mean weighted by 1 / error^2. One without error
/// is taken alone.
Estimate combined(const Estimate& a, const Estimate& b);

/// A prior and a pilot's measurement of one squared error; `unseen` is the share of the picture's
/// pixels that the pilot left out. Both are wrong by a share of what the error is, not of what they
/// say it is: else the lower would count for more.
Estimate weighed(Estimate prior, Estimate measured, double unseen);

/// What a pilot measured of a way.
struct PilotOfWay {
  Estimate bias_square;
  double samples = 0;  // of paths that it was compared with
  double unseen = 0;   // share of the picture's pixels
};

/// The prior after the pilot: raised, or lowered with caution, since a pilot that met no rare large
/// square says too little.
Estimate posterior(const Estimate& prior, const PilotOfWay& pilot);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_EVIDENCE_H_
