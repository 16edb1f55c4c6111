#include "pipeline/plan/search.h"

#include <algorithm>
#include <cmath>

#include "pipeline/accuracy/measure_accuracy.h"
#include "pipeline/plan/policy.h"

namespace heddle {

void Search::add_other_ways() {
  trace_local();
  const SceneConfig& scene = renderer_->scene();
  const FabricTables& tables = library_->tables();
  for (const WaySettings& settings : other_ways(scene, *view_, tables)) {
    findings_->add_way(settings, prior_of_way(settings, scene, *view_, tables),
                       name_of(settings, scene), changes_of(settings),
                       library_->build_seconds(settings.method, settings.variant));
  }
}

std::optional<std::size_t> Search::choose_way() {
  for (int tries = 0; tries < kPolicy.most_tries; ++tries) {
    const std::optional<std::size_t> chosen = choose_now();
    if (!chosen || (!try_cheaper(*chosen) && !learn(*chosen))) break;
  }
  return choose_now();
}

std::optional<std::size_t> Search::choose_now() const {
  return choose(findings_->candidates(), findings_->tried(), target_.tolerance, target_.pictures);
}

/// Of a way that meets the tolerance.
Offer Search::offer_of(std::size_t way) const {
  return *offer(findings_->ways()[way].candidate, target_.tolerance, target_.pictures);
}

/// Finds out more of a way that would be much cheaper than the chosen one if it erred by less than
/// caution allows for; false where there is none, or finding out takes too long.
bool Search::try_cheaper(std::size_t chosen) {
  std::vector<Candidate> list = findings_->candidates();
  for (Candidate& candidate : list) candidate.bias_square = at_best(candidate.bias_square);
  const std::optional<std::size_t> best =
      choose(list, std::vector<bool>(list.size()), target_.tolerance, target_.pictures);
  if (!best || *best == chosen) return false;
  const double seconds = offer_of(chosen).seconds;
  const double at_best = offer(list[*best], target_.tolerance, target_.pictures)->seconds;
  if (at_best > kPolicy.cheaper_share * seconds) return false;
  // What the chosen way's own pilot says holds of its kind.
  const std::vector<Way>& ways = findings_->ways();
  const bool same_kind = kind_of(ways[*best].settings) == kind_of(ways[chosen].settings);
  const std::size_t way = same_kind ? chosen : *best;
  const double affordable = kPolicy.build_share * (seconds - at_best);
  if (!may_try(way) || ways[way].candidate.build_seconds + seconds_to_try(way) > affordable)
    return false;
  return find_out(way, kPolicy.pilot_share * seconds, true);
}

/// Finds out more of the chosen way; false where there is nothing to find out.
bool Search::learn(std::size_t chosen) {
  const Way& way = findings_->ways()[chosen];
  const Offer offered = offer_of(chosen);
  if (family_of(way.settings) == "path") {
    // A picture finds out itself how many samples it needs: only the choice depends on its noise
    // here.
    const double error = way.candidate.noise_square.error / way.candidate.noise_square.value;
    return error >= kPolicy.noise_known && has_rival(chosen) &&
           more_paths(4 * findings_->paths().samples(), kPolicy.pilot_share * offered.seconds);
  }
  if (!way.tried && may_try(chosen) &&
      seconds_to_try(chosen) <= kPolicy.try_share * offered.seconds) {
    try_out(chosen, false);  // for its noise and its speed here
    return true;
  }
  if (findings_->between_matters(way) && know_light_between(offered)) return true;
  if (!may_try(chosen) || !way.tried) return false;
  const double affordable = kPolicy.doubt_share * offered.seconds;
  return may_miss(way.candidate, target_.tolerance) && seconds_to_try(chosen) <= affordable &&
         find_out(chosen, affordable, false);
}

/// Tries a way against the paths that there are, if that is useful and has not been done to one of
/// its kind; else against a larger pilot of paths, if a useful one is affordable. False where
/// neither is.
bool Search::find_out(std::size_t way, double affordable, bool may_lower) {
  const double known = findings_->ways()[way].candidate.bias_square.error;
  const double samples = findings_->paths().samples();
  if (!findings_->compared_with_these_paths(way) &&
      pilot_error(samples) <= kPolicy.useful_pilot * known) {
    try_out(way, may_lower);
    return true;
  }
  const double most = renderer_->picture_pixels() * kMostSamples;
  double wanted = 2 * samples;
  while (pilot_error(wanted) > kPolicy.wanted_pilot * known && wanted < most) wanted *= 1.3;
  const bool between_too = findings_->between_matters(findings_->ways()[way]);
  if (between_too) affordable /= 2;
  wanted = std::min(wanted, affordable / seconds_per_path());
  if (pilot_error(wanted) > kPolicy.useful_pilot * known || !more_paths(wanted, affordable))
    return false;
  if (between_too) trace_local();
  return true;
}

/// Renders a pilot of a way, to be compared with that of paths.
void Search::try_out(std::size_t index, bool may_lower) {
  const Way& way = findings_->ways()[index];
  const Pilot pilot = renderer_->render(way.settings.method, samples_to_try(index),
                                        {.variant = way.settings.variant});
  findings_->refine_mean(index, pilot);
  if (is_precomputed(way.settings.method)) measure_stress();
  findings_->add_trial(index, pilot, may_lower);
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
    return way.settings.method == RenderMethod::kExact && way.candidate.changes == 0;
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

/// Does another way not cost much more?
bool Search::has_rival(std::size_t chosen) const {
  const double seconds = offer_of(chosen).seconds;
  for (std::size_t k = 0; k < findings_->ways().size(); ++k) {
    const std::optional<Offer> other =
        offer(findings_->ways()[k].candidate, target_.tolerance, target_.pictures);
    if (k != chosen && other && kPolicy.cheaper_share * other->seconds < seconds) return true;
  }
  return false;
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

double Search::seconds_per_path() const {
  return findings_->paths().seconds_per_spp / renderer_->picture_pixels();
}

/// A larger pilot of paths, first of more pixels, in the seconds affordable; false where it would
/// not be much larger. Four times the samples are twice as sure.
bool Search::more_paths(double wanted, double affordable) {
  wanted = std::min(wanted, affordable / seconds_per_path());
  if (wanted < 2 * findings_->paths().samples()) return false;
  const int least = kPolicy.pilot_samples;
  const double pixels = std::min(renderer_->picture_pixels(), wanted / least);
  renderer_->choose_blocks(static_cast<int>(pixels));
  findings_->replace_paths(renderer_->render(
      RenderMethod::kPath, 2 * std::max(least / 2, static_cast<int>(wanted / pixels / 2))));
  return true;
}

/// Another pilot, if light between cloths decides what is offered and is not known; false if not.
bool Search::know_light_between(const Offer& offered) {
  if (findings_->light_between().error <
      kPolicy.between_known * target_.tolerance * target_.tolerance)
    return false;
  // Both pictures of paths count.
  if (!more_paths(4 * findings_->paths().samples(), kPolicy.pilot_share * offered.seconds / 2))
    return false;
  trace_local();
  return true;
}

/// The paths of the pilot again, ending where they leave a cloth.
void Search::trace_local() {
  if (!view_->sends_light_about) return;
  findings_->add_local_paths(
      renderer_->render(RenderMethod::kPath, findings_->paths().spp, {.local = true}),
      prior_between(renderer_->scene(), *view_, library_->tables()));
}

}  // namespace heddle
