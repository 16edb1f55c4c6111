#include "fibers/cloth/weave_report.h"

#include <algorithm>
#include <functional>
#include <numeric>

namespace heddle {
namespace {

/// side(yarn, crossing) for all yarns of one system.
using SideOf = std::function<bool(int, int)>;

FloatLengths measure_floats(int yarns, int crossings, const SideOf& side, bool wanted) {
  FloatLengths floats;
  long long total = 0;
  long long count = 0;
  for (int yarn = 0; yarn < yarns; ++yarn) {
    // The last crossing of a float of the other side, from which runs are counted.
    int start = 0;
    while (start < crossings && side(yarn, start) == wanted) ++start;
    if (start == crossings) {
      ++floats.endless;
      continue;
    }
    int run = 0;
    for (int k = 1; k <= crossings; ++k) {
      if (side(yarn, (start + k) % crossings) == wanted) {
        ++run;
        continue;
      }
      if (run == 0) continue;
      floats.longest = std::max(floats.longest, run);
      total += run;
      ++count;
      run = 0;
    }
  }
  if (count > 0) floats.mean = static_cast<double>(total) / static_cast<double>(count);
  return floats;
}

double measure_interlacing(int yarns, int crossings, const SideOf& side) {
  long long changes = 0;
  for (int yarn = 0; yarn < yarns; ++yarn) {
    for (int k = 0; k < crossings; ++k)
      changes += side(yarn, k) != side(yarn, (k + 1) % crossings) ? 1 : 0;
  }
  return static_cast<double>(changes) / (static_cast<double>(yarns) * crossings);
}

bool yarns_alike(int a, int b, int crossings, const SideOf& side) {
  for (int k = 0; k < crossings; ++k) {
    if (side(a, k) != side(b, k)) return false;
  }
  return true;
}

int count_alike(int yarns, int crossings, const SideOf& side) {
  int alike = 0;
  for (int yarn = 0; yarns > 1 && yarn < yarns; ++yarn) {
    const int before = (yarn + yarns - 1) % yarns;
    // Two yarns in all have each other as neighbours on both sides.
    if (yarns == 2 && yarn == 1) break;
    alike += yarns_alike(yarn, before, crossings, side) ? 1 : 0;
  }
  return alike;
}

/// Smallest shift, a divisor of the yarns' number, that maps every yarn onto one like it.
int smallest_period(int yarns, int crossings, const SideOf& side) {
  for (int period = 1; period < yarns; ++period) {
    if (yarns % period != 0) continue;
    bool holds = true;
    for (int yarn = period; holds && yarn < yarns; ++yarn)
      holds = yarns_alike(yarn, yarn - period, crossings, side);
    if (holds) return period;
  }
  return yarns;
}

/// Yarns from the one most often over to the one least often; sums[k]: how often the first k are.
struct Ranking {
  std::vector<int> order;
  std::vector<long long> sums;
};

Ranking rank(const std::vector<int>& overs) {
  Ranking ranking;
  ranking.order.resize(overs.size());
  std::iota(ranking.order.begin(), ranking.order.end(), 0);
  std::stable_sort(ranking.order.begin(), ranking.order.end(), [&](int a, int b) {
    return overs[static_cast<std::size_t>(a)] > overs[static_cast<std::size_t>(b)];
  });
  ranking.sums.push_back(0);
  for (const int yarn : ranking.order)
    ranking.sums.push_back(ranking.sums.back() + overs[static_cast<std::size_t>(yarn)]);
  return ranking;
}

}  // namespace

std::vector<ClothLayer> find_layers(const Weave& weave) {
  std::vector<int> end_overs(static_cast<std::size_t>(weave.ends), 0);
  std::vector<int> pick_overs(static_cast<std::size_t>(weave.picks), 0);
  for (int pick = 0; pick < weave.picks; ++pick) {
    for (int end = 0; end < weave.ends; ++end) {
      const bool up = weave.is_warp_up(end, pick);
      ++(up ? end_overs[static_cast<std::size_t>(end)]
            : pick_overs[static_cast<std::size_t>(pick)]);
    }
  }
  const Ranking ends = rank(end_overs);
  const Ranking picks = rank(pick_overs);
  std::vector<ClothLayer> layers;
  int from_end = 0;
  int from_pick = 0;
  // Sets that lift off are nested, so that both counts only grow.
  for (int s = 0; s <= weave.ends; ++s) {
    for (int t = from_pick; t <= weave.picks; ++t) {
      if (s == from_end && t == from_pick) continue;
      // Each of the s + t threads over all threads outside: s t crossings lie inside.
      const long long needed = static_cast<long long>(s) * weave.picks +
                               static_cast<long long>(t) * weave.ends -
                               static_cast<long long>(s) * t;
      if (ends.sums[static_cast<std::size_t>(s)] + picks.sums[static_cast<std::size_t>(t)] !=
          needed)
        continue;
      ClothLayer layer;
      layer.ends.assign(ends.order.begin() + from_end, ends.order.begin() + s);
      layer.picks.assign(picks.order.begin() + from_pick, picks.order.begin() + t);
      std::sort(layer.ends.begin(), layer.ends.end());
      std::sort(layer.picks.begin(), layer.picks.end());
      layers.push_back(std::move(layer));
      from_end = s;
      from_pick = t;
    }
  }
  return layers;
}

WeaveReport report_weave(const Weave& weave) {
  const SideOf warp_up = [&](int end, int pick) { return weave.is_warp_up(end, pick); };
  const SideOf weft_up = [&](int pick, int end) { return !weave.is_warp_up(end, pick); };
  WeaveReport report;
  report.repeat_ends = smallest_period(weave.ends, weave.picks, warp_up);
  report.repeat_picks = smallest_period(weave.picks, weave.ends, weft_up);
  report.warp_share =
      static_cast<double>(std::count(weave.warp_up.begin(), weave.warp_up.end(), 1)) /
      static_cast<double>(weave.warp_up.size());
  report.warp_face = measure_floats(weave.ends, weave.picks, warp_up, true);
  report.warp_back = measure_floats(weave.ends, weave.picks, warp_up, false);
  report.weft_face = measure_floats(weave.picks, weave.ends, weft_up, true);
  report.weft_back = measure_floats(weave.picks, weave.ends, weft_up, false);
  report.warp_interlacing = measure_interlacing(weave.ends, weave.picks, warp_up);
  report.weft_interlacing = measure_interlacing(weave.picks, weave.ends, weft_up);
  report.alike_ends = count_alike(weave.ends, weave.picks, warp_up);
  report.alike_picks = count_alike(weave.picks, weave.ends, weft_up);
  report.layers = find_layers(weave);
  return report;
}

std::optional<double> cover_of(const DraftThreads& threads) {
  if (threads.spacing_mm.empty() || threads.thickness_mm.empty()) return {};
  const auto sum = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
  };
  return std::min(1.0, sum(threads.thickness_mm) / sum(threads.spacing_mm));
}

std::optional<double> threads_per_cm(const DraftThreads& threads) {
  if (threads.spacing_mm.empty()) return {};
  return 10 * static_cast<double>(threads.spacing_mm.size()) /
         std::accumulate(threads.spacing_mm.begin(), threads.spacing_mm.end(), 0.0);
}

}  // namespace heddle
