#include "pipeline/plan/findings.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pipeline/plan/policy.h"

namespace heddle {

Findings::Findings(Pilot paths) {
  Way way;
  way.tried = true;
  way.candidate.name = "path";
  way.candidate.setup_seconds = paths.setup_seconds;
  way.candidate.spp_step = 2;
  ways_.push_back(std::move(way));
  replace_paths(std::move(paths));
}

std::vector<Candidate> Findings::candidates() const {
  std::vector<Candidate> list;
  for (const Way& way : ways_) list.push_back(way.candidate);
  return list;
}

void Findings::add_way(const WaySettings& settings, const WayPrior& prior, std::string name,
                       double build_seconds) {
  Way way{settings, prior, {}};
  const Candidate& path = path_candidate();
  const Estimate traced = relative(path_variance_);
  Candidate& candidate = way.candidate;
  candidate.name = std::move(name);
  candidate.bias_square = error_of(way);
  candidate.noise_square = {
      prior.noise_ratio * traced.value,
      prior.noise_ratio * std::hypot(traced.error, kPolicy.noise_ratio_error * traced.value)};
  candidate.build_seconds = build_seconds;
  candidate.setup_seconds = prior.setup_seconds;
  candidate.seconds_per_spp = path.seconds_per_spp * prior.time_ratio;
  candidate.spp_step = traces_paths(settings.method) ? 2 : 1;
  ways_.push_back(std::move(way));
}

void Findings::set_build_seconds(std::size_t way, double seconds) {
  ways_[way].candidate.build_seconds = seconds;
}

void Findings::replace_paths(Pilot paths) {
  paths_ = std::move(paths);
  path_variance_ = sample_variance(paths_.frames);
  mean_ = {mean_radiance(paths_.frames), std::sqrt(path_variance_.value / paths_.samples())};
  Candidate& path = ways_[0].candidate;
  path.noise_square = relative(path_variance_);
  path.seconds_per_spp = paths_.seconds_per_spp;
}

void Findings::raise_priors(double stress) {
  for (Way& way : ways_) {
    if (!is_precomputed(way.settings.method) || !way.settings.variant.stand_ins.empty()) continue;
    Estimate& square = way.prior.bias_square;
    square.value *= stress;
    square.error = std::max(square.error, kPolicy.table_error * square.value);
    way.candidate.bias_square = error_of(way);
  }
}

void Findings::add_trial(std::size_t index, const Pilot& pilot) {
  Way& way = ways_[index];
  const Candidate before = way.candidate;
  Candidate& now = way.candidate;
  now.noise_square = relative(sample_variance(pilot.frames));
  now.seconds_per_spp = pilot.seconds_per_spp;
  now.setup_seconds = pilot.setup_seconds;
  now.build_seconds = 0;  // by now it is there
  Estimate measured = relative(squared_bias(pilot.frames, paths_.frames));
  // The spread between few blocks misses rare bright paths; the noise of two halves is at least
  // this.
  const double noise =
      2 * (path_candidate().noise_square.value / paths_.spp + now.noise_square.value / pilot.spp);
  measured.error = std::max(measured.error, noise / std::sqrt(paths_.pixels));
  const double unseen = 1 - pilot.share_of_picture;
  way.pilot = {measured, paths_.samples(), std::max(kPolicy.least_unseen, unseen)};
  now.bias_square = error_of(way);
  // What differs from the table here does so for its kind too.
  const double noise_ratio = now.noise_square.value / before.noise_square.value;
  const double time_ratio = now.seconds_per_spp / before.seconds_per_spp;
  for (Way& other : ways_) {
    if (kind_of(other.settings) != kind_of(way.settings)) continue;
    other.tried = true;
    if (&other == &way) continue;
    Candidate& similar = other.candidate;
    similar.noise_square = {
        similar.noise_square.value * noise_ratio,
        similar.noise_square.value * now.noise_square.error / now.noise_square.value};
    similar.seconds_per_spp *= time_ratio;
    similar.setup_seconds = now.setup_seconds;
  }
}

bool Findings::compared_with_these_paths(std::size_t way) const {
  const std::optional<PilotOfWay>& pilot = ways_[way].pilot;
  return pilot && pilot->samples >= paths_.samples();
}

/// An absolute square relative to the mean radiance; the mean's own error counts.
Estimate Findings::relative(const Estimate& square) const {
  const double scale = mean_.value > 0 ? 1 / (mean_.value * mean_.value) : 0;
  const double of_mean =
      mean_.value > 0 ? 2 * std::min(1.0, mean_.error / mean_.value) * square.value : 0;
  return {square.value * scale, std::hypot(square.error, of_mean) * scale};
}

/// By the table, with light between cloths where the way lacks it, and the way's pilot.
Estimate Findings::error_of(const Way& way) const {
  Estimate prior = way.prior.bias_square;
  if (lacks_light_between(way.settings)) {
    prior.value += light_between_.value;
    prior.error = std::hypot(prior.error, light_between_.error);
  }
  return way.pilot ? posterior(prior, *way.pilot) : prior;
}

}  // namespace heddle
