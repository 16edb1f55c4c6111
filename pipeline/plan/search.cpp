#include "pipeline/plan/search.h"

#include <algorithm>
#include <cmath>

#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/plan/policy.h"

namespace heddle {

void Search::add_other_ways() {
  const SceneConfig& scene = renderer_->scene();
  const FabricTables& tables = library_->tables();
  findings_->set_light_between(prior_between(scene, *view_, tables));
  for (const WaySettings& settings : other_ways(scene, *view_, tables)) {
    findings_->add_way(settings, prior_of_way(settings, scene, *view_, tables),
                       name_of(settings, scene),
                       library_->build_seconds(settings.method, settings.variant));
  }
}

std::optional<std::size_t> Search::choose_way() {
  for (int tries = 0; tries < kPolicy.most_tries; ++tries) {
    const std::optional<std::size_t> chosen = cheapest_way();
    if (!chosen || (!try_cheaper(*chosen) && !try_choice(*chosen))) break;
  }
  return cheapest_way();
}

std::optional<std::size_t> Search::cheapest_way() const {
  return cheapest(findings_->candidates(), target_.tolerance, target_.pictures);
}

/// Of a way that meets the tolerance.
Offer Search::offer_of(std::size_t way) const {
  return *offer(findings_->ways()[way].candidate, target_.tolerance, target_.pictures);
}

/// Tries the chosen way, for its noise and its speed here; false if that has been done or takes too
/// long.
bool Search::try_choice(std::size_t chosen) {
  if (findings_->ways()[chosen].tried || !may_try(chosen) ||
      seconds_to_try(chosen) > kPolicy.try_share * offer_of(chosen).seconds)
    return false;
  try_out(chosen);
  return true;
}

/// Finds out more of a way that would be much cheaper than the chosen one if it erred by less than
/// caution allows for: against the paths that there are, if that is useful and was not done yet,
/// else against a larger pilot of paths. False where there is no such way, or finding out takes too
/// long.
bool Search::try_cheaper(std::size_t chosen) {
  std::vector<Candidate> list = findings_->candidates();
  for (Candidate& candidate : list) candidate.bias_square = at_best(candidate.bias_square);
  const std::optional<std::size_t> best = cheapest(list, target_.tolerance, target_.pictures);
  if (!best || *best == chosen) return false;
  const double seconds = offer_of(chosen).seconds;
  const double at_best = offer(list[*best], target_.tolerance, target_.pictures)->seconds;
  if (at_best > kPolicy.cheaper_share * seconds) return false;
  const std::vector<Way>& ways = findings_->ways();
  const std::size_t way = *best;
  if (!may_try(way) || ways[way].candidate.build_seconds + seconds_to_try(way) >
                           kPolicy.build_share * (seconds - at_best))
    return false;
  const double known = ways[way].candidate.bias_square.error;
  const double samples = findings_->paths().samples();
  if (!findings_->compared_with_these_paths(way) &&
      pilot_error(samples) <= kPolicy.useful_pilot * known) {
    try_out(way);
    return true;
  }
  const double most = renderer_->picture_pixels() * kMostSamples;
  double wanted = 2 * samples;
  while (pilot_error(wanted) > kPolicy.wanted_pilot * known && wanted < most) wanted *= 1.3;
  return more_paths(wanted, kPolicy.pilot_share * seconds, known);
}

/// Renders a pilot of a way, to be compared with that of paths.
void Search::try_out(std::size_t index) {
  const Way& way = findings_->ways()[index];
  const Pilot pilot = renderer_->render(way.settings.method, samples_to_try(index),
                                        {.variant = way.settings.variant});
  if (is_precomputed(way.settings.method)) measure_stress();
  findings_->add_trial(index, pilot);
  for (std::size_t k = 0; k < findings_->ways().size(); ++k) {
    const WaySettings& other = findings_->ways()[k].settings;
    if (k == index || kind_of(other) != kind_of(way.settings)) continue;
    findings_->set_build_seconds(k, library_->build_seconds(other.method, other.variant));
  }
}

/// Where this view and these lights make much of the higher harmonics, other errors of flat cloth
/// are large, too: light that hardly any of the cloth sends here is hard to get right. Two pictures
/// by the fabrics' own data that share all else tell it, next to free of noise.
void Search::measure_stress() {
  constexpr int kLowOrder = kOtherOrders[0];
  const std::vector<Way>& ways = findings_->ways();
  const auto own = std::find_if(ways.begin(), ways.end(), [](const Way& way) {
    return way.candidate.name == render_method_name(RenderMethod::kExact);  // nothing changed
  });
  if (stress_measured_ || own == ways.end() || own->candidate.build_seconds > 0) return;
  const double prior =
      prior_of_low_order(kLowOrder, renderer_->scene(), *view_, library_->tables());
  if (!(prior > 0)) return;
  const Pilot whole = renderer_->render(RenderMethod::kExact, 2);
  const Pilot low = renderer_->render(RenderMethod::kExact, 2, {.transfer_order = kLowOrder});
  const double mean = mean_radiance(whole.frames);
  const double change = mean > 0 ? squared_bias(low.frames, whole.frames).value / (mean * mean) : 0;
  findings_->raise_priors(
      std::clamp(std::sqrt(std::max(0.0, change) / prior), 1.0, kPolicy.most_stress));
  stress_measured_ = true;
}

bool Search::may_try(std::size_t way) const {
  return target_.may_build || !(findings_->ways()[way].candidate.build_seconds > 0);
}

/// Samples per pixel of a pilot to be compared with that of paths: as many as tell most of the
/// difference in the time of both.
int Search::samples_to_try(std::size_t way) const {
  const Candidate& candidate = findings_->ways()[way].candidate;
  const Candidate& path = findings_->path_candidate();
  const int path_spp = findings_->paths().spp;
  const double noise = candidate.noise_square.value / path.noise_square.value;
  const double time = candidate.seconds_per_spp / path.seconds_per_spp;
  const double samples = path_spp * std::sqrt(noise / time);
  return 2 * std::clamp(static_cast<int>(std::lround(samples / 2)), kPolicy.pilot_samples / 2,
                        path_spp / 2);
}

/// Building apart.
double Search::seconds_to_try(std::size_t way) const {
  const Candidate& candidate = findings_->ways()[way].candidate;
  return candidate.setup_seconds +
         samples_to_try(way) * findings_->paths().share_of_picture * candidate.seconds_per_spp;
}

/// Standard error of the squared error that pilots of so many paths, and of a way in about the same
/// time, say.
double Search::pilot_error(double samples) const {
  const double pixels = std::min(renderer_->picture_pixels(), samples / kPolicy.pilot_samples);
  return kPolicy.pilot_noise * findings_->path_candidate().noise_square.value /
         (samples / pixels * std::sqrt(pixels));
}

/// A larger pilot of paths, first of more pixels, in the seconds affordable; false where it would
/// not be much larger, or would tell little beside the standard error `known` of a squared error.
bool Search::more_paths(double wanted, double affordable, double known) {
  const double pixels = renderer_->picture_pixels();
  wanted = std::min(wanted, affordable * pixels / findings_->paths().seconds_per_spp);
  if (wanted < 2 * findings_->paths().samples() ||
      pilot_error(wanted) > kPolicy.useful_pilot * known)
    return false;
  const int least = kPolicy.pilot_samples;
  const double seen = std::min(pixels, wanted / least);
  renderer_->choose_blocks(static_cast<int>(seen));
  findings_->replace_paths(renderer_->render(
      RenderMethod::kPath, 2 * std::max(least / 2, static_cast<int>(wanted / seen / 2))));
  return true;
}

}  // namespace heddle
