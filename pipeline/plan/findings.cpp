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

std::vector<bool> Findings::tried() const {
  std::vector<bool> list;
  for (const Way& way : ways_) list.push_back(way.tried);
  return list;
}

void Findings::add_way(const WaySettings& settings, const WayPrior& prior, std::string name,
                       int changes, double build_seconds) {
  Way way{settings, prior, {}};
  const Candidate& path = path_candidate();
  const Estimate traced = relative(path_variance_);
  Candidate& candidate = way.candidate;
  candidate.name = std::move(name);
  candidate.bias_square = prior_of(way);
  candidate.noise_square = {
      prior.noise_ratio * traced.value,
      prior.noise_ratio * std::hypot(traced.error, kPolicy.noise_ratio_error * traced.value)};
  candidate.build_seconds = build_seconds;
  candidate.setup_seconds = prior.setup_seconds;
  candidate.seconds_per_spp = path.seconds_per_spp * prior.time_ratio;
  candidate.spp_step = traces_paths(settings.method) ? 2 : 1;
  candidate.changes = changes;
  ways_.push_back(std::move(way));
}

void Findings::set_build_seconds(std::size_t way, double seconds) {
  ways_[way].candidate.build_seconds = seconds;
}

void Findings::replace_paths(Pilot paths) {
  paths_ = std::move(paths);
  path_variance_ = sample_variance(paths_.frames);
  path_mean_ = {mean_radiance(paths_.frames), std::sqrt(path_variance_.value / paths_.samples())};
  mean_ = path_mean_;
  Candidate& path = ways_[0].candidate;
  path.noise_square = relative(path_variance_);
  path.seconds_per_spp = paths_.seconds_per_spp;
}

void Findings::add_local_paths(const Pilot& local, const Estimate& prior) {
  light_between_mean_ = mean_.value > 0 ? mean_radiance(local.frames) / mean_.value - 1 : 0;
  light_between_ = relative(squared_bias_of_means(local.frames, paths_.frames));
  // The mean's part of it is known best.
  light_between_.value = std::max(light_between_.value, light_between_mean_ * light_between_mean_);
  if (prior.value > 0) {
    // Few of the paths carry it, and few paths may have met none of those.
    const double noise = mean_.value > 0 ? mean_.error / mean_.value : 1;
    const double square = std::max(prior.value, light_between_.value);
    light_between_.error = std::max(light_between_.error, 2 * noise * std::sqrt(square));
    light_between_ = combined(prior, light_between_);
  }
  add_up();
}

void Findings::refine_mean(std::size_t way, const Pilot& pilot) {
  const double mean = mean_radiance(pilot.frames);
  if (!(mean > 0) || !(mean_.value > 0)) return;
  const double missing =
      ways_[way].prior.mean_error +
      (lacks_light_between(ways_[way].settings) ? std::min(0.0, light_between_mean_) : 0);
  const double before = mean_.value;
  mean_ = combined(path_mean_, {mean, mean * std::hypot(kPolicy.mean_error, missing)});
  const double scale = before * before / (mean_.value * mean_.value);
  for (Way& other : ways_) {
    other.candidate.noise_square.value *= scale;
    other.candidate.noise_square.error *= scale;
  }
}

void Findings::raise_priors(double stress) {
  for (Way& way : ways_) {
    if (!is_precomputed(way.settings.method) || !way.settings.variant.stand_ins.empty()) continue;
    Estimate& square = way.prior.bias_square;
    square.value *= stress;
    square.error = std::max(square.error, kPolicy.table_error * square.value);
  }
}

void Findings::add_trial(std::size_t index, const Pilot& pilot, bool may_lower) {
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
  const std::string kind = kind_of(way.settings);
  const auto [of_kind, is_first] = piloted_.try_emplace(kind, index);
  if (!is_first) {
    may_lower = may_lower || ways_[of_kind->second].pilot->may_lower;
    ways_[of_kind->second].pilot.reset();
    of_kind->second = index;
  }
  const double unseen = 1 - pilot.share_of_picture;
  way.pilot = {measured, paths_.samples(), std::max(kPolicy.least_unseen, unseen), may_lower};
  // What differs from the table here does so for its kind too.
  const double noise_ratio = now.noise_square.value / before.noise_square.value;
  const double time_ratio = now.seconds_per_spp / before.seconds_per_spp;
  for (Way& other : ways_) {
    if (kind_of(other.settings) != kind) continue;
    other.tried = true;
    if (&other == &way) continue;
    Candidate& similar = other.candidate;
    similar.noise_square = {
        similar.noise_square.value * noise_ratio,
        similar.noise_square.value * now.noise_square.error / now.noise_square.value};
    similar.seconds_per_spp *= time_ratio;
    similar.setup_seconds = now.setup_seconds;
  }
  add_up();
}

bool Findings::compared_with_these_paths(std::size_t way) const {
  const auto of_kind = piloted_.find(kind_of(ways_[way].settings));
  return of_kind != piloted_.end() && ways_[of_kind->second].pilot->samples >= paths_.samples();
}

bool Findings::between_matters(const Way& way) const {
  return lacks_light_between(way.settings) && light_between_.error > way.prior.bias_square.error;
}

/// An absolute square relative to the mean radiance; the mean's own error counts.
Estimate Findings::relative(const Estimate& square) const {
  const double scale = mean_.value > 0 ? 1 / (mean_.value * mean_.value) : 0;
  const double of_mean =
      mean_.value > 0 ? 2 * std::min(1.0, mean_.error / mean_.value) * square.value : 0;
  return {square.value * scale, std::hypot(square.error, of_mean) * scale};
}

/// The table's, with light between cloths where the way lacks it.
Estimate Findings::prior_of(const Way& way) const {
  Estimate prior = way.prior.bias_square;
  if (!lacks_light_between(way.settings)) return prior;
  // Where both darken, they add up.
  const double together = 2 * std::max(0.0, way.prior.mean_error * light_between_mean_);
  prior.value += std::max(0.0, light_between_.value) + together;
  prior.error = std::hypot(prior.error, light_between_.error);
  return prior;
}

/// All errors, from all that is known. What a pilot finds of a way holds of its kind.
void Findings::add_up() {
  for (Way& way : ways_) {
    const Estimate prior = prior_of(way);
    const auto of_kind = piloted_.find(kind_of(way.settings));
    if (of_kind == piloted_.end()) {
      way.candidate.bias_square = prior;
      continue;
    }
    const Way& similar = ways_[of_kind->second];
    const Estimate prior_of_similar = prior_of(similar);
    const Estimate found = posterior(prior_of_similar, *similar.pilot);
    way.candidate.bias_square =
        &similar == &way ? found : transferred(prior, prior_of_similar, found);
  }
}

}  // namespace heddle
