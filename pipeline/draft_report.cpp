#include "pipeline/draft_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "fibers/cloth/weave_config.h"
#include "fibers/cloth/weave_report.h"
#include "pipeline/fabric_report.h"

namespace heddle {
namespace {

using Report = nlohmann::ordered_json;

// What is drawn of a weave; larger ones are cut.
constexpr int kDrawnEnds = 64;
constexpr int kDrawnPicks = 48;
// Beyond so many, neither threading nor treadling is drawn.
constexpr int kDrawnShafts = 40;
constexpr std::size_t kListedColors = 12;
constexpr std::size_t kListedThreads = 8;

void add_floats(const char* name, const FloatLengths& floats, Report& report) {
  report[fmt::format("float.{}.longest", name)] = floats.longest;
  report[fmt::format("float.{}.mean", name)] = rounded(floats.mean);
  if (floats.endless > 0) report[fmt::format("float.{}.endless_yarns", name)] = floats.endless;
}

std::string hex_of(const std::array<float, 3>& linear) {
  const auto byte = [](float value) {
    const double encoded =
        value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;
    return static_cast<int>(std::lround(255 * std::clamp(encoded, 0.0, 1.0)));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(linear[0]), byte(linear[1]), byte(linear[2]));
}

/// "#ff0000 x 12, ...": the colours of a system in the order in which they come first.
std::string color_counts(const DraftThreads& threads) {
  std::vector<std::pair<std::string, int>> counts;
  for (const auto& color : threads.color) {
    const std::string hex = hex_of(color);
    const auto found = std::find_if(counts.begin(), counts.end(),
                                    [&](const auto& count) { return count.first == hex; });
    if (found == counts.end()) {
      counts.emplace_back(hex, 1);
    } else {
      ++found->second;
    }
  }
  std::string text;
  for (std::size_t k = 0; k < std::min(counts.size(), kListedColors); ++k)
    text += fmt::format("{}{} x {}", k == 0 ? "" : ", ", counts[k].first, counts[k].second);
  if (counts.size() > kListedColors)
    text += fmt::format(", and {} more", counts.size() - kListedColors);
  return text;
}

std::string thread_list(const char* name, const std::vector<int>& threads) {
  if (threads.empty()) return "";
  std::string text = fmt::format("{} {}", threads.size(), name);
  std::vector<int> first;
  for (std::size_t k = 0; k < std::min(threads.size(), kListedThreads); ++k)
    first.push_back(threads[k] + 1);
  return text + fmt::format(" ({}{})", fmt::join(first, ", "),
                            threads.size() > kListedThreads ? ", ..." : "");
}

std::vector<std::string> warnings_of(const Weave& weave, const WeaveReport& facts) {
  std::vector<std::string> warnings = weave.warnings;
  if (facts.layers.size() > 1) {
    std::string layers;
    for (std::size_t k = 0; k < std::min(facts.layers.size(), kListedThreads); ++k) {
      const std::string ends = thread_list("ends", facts.layers[k].ends);
      const std::string picks = thread_list("picks", facts.layers[k].picks);
      layers += fmt::format("; {}{}{}", ends, ends.empty() || picks.empty() ? "" : " with ", picks);
    }
    warnings.push_back(fmt::format(
        "the cloth falls apart into {} layers that nothing holds together, from the "
        "face down{}{}",
        facts.layers.size(), layers, facts.layers.size() > kListedThreads ? "; ..." : ""));
  }
  const auto alike = [&](int count, int of, const char* name) {
    if (count == 0) return;
    warnings.push_back(fmt::format(
        "{} of {} {} cross as their neighbour does: they are free to lie on each other, as one "
        "yarn",
        count, of, name));
  };
  alike(facts.alike_ends, weave.ends, "ends");
  alike(facts.alike_picks, weave.picks, "picks");
  return warnings;
}

bool holds(const std::vector<int>& sorted, int value) {
  return std::binary_search(sorted.begin(), sorted.end(), value);
}

std::string cut_note(int ends, int picks) {
  if (ends <= kDrawnEnds && picks <= kDrawnPicks) return "";
  return fmt::format("the first {} of {} ends, the first {} of {} picks",
                     std::min(ends, kDrawnEnds), ends, std::min(picks, kDrawnPicks), picks);
}

}  // namespace

std::vector<std::string> draw_weave(const Weave& weave) {
  std::vector<std::string> lines;
  for (int pick = std::min(weave.picks, kDrawnPicks); pick-- > 0;) {
    std::string& line = lines.emplace_back();
    for (int end = 0; end < std::min(weave.ends, kDrawnEnds); ++end)
      line += weave.is_warp_up(end, pick) ? '#' : '.';
  }
  if (const std::string note = cut_note(weave.ends, weave.picks); !note.empty())
    lines.push_back(note);
  return lines;
}

std::vector<std::string> draw_draft(const WifDraft& draft) {
  std::vector<std::string> lines = draw_weave(weave_of_draft(draft, ""));
  const bool by_plan = draft.treadling.empty();
  if (draft.shafts > kDrawnShafts || draft.treadles > kDrawnShafts) {
    lines.push_back(fmt::format("threading and {} of {} shafts are not drawn",
                                by_plan ? "lift plan" : "treadling", draft.shafts));
    return lines;
  }
  const auto& plan = by_plan ? draft.liftplan : draft.treadling;
  const int columns = by_plan ? draft.shafts : draft.treadles;
  const int picks = std::min(draft.picks(), kDrawnPicks);
  for (int pick = 0; pick < picks; ++pick) {
    std::string& line = lines[static_cast<std::size_t>(picks - 1 - pick)];
    line += "  ";
    for (int column = 1; column <= columns; ++column)
      line += holds(plan[static_cast<std::size_t>(pick)], column) ? 'o' : '-';
  }
  std::vector<std::string> above;
  for (int shaft = draft.shafts; shaft >= 1; --shaft) {
    std::string& line = above.emplace_back();
    for (int end = 0; end < std::min(draft.ends(), kDrawnEnds); ++end)
      line += holds(draft.threading[static_cast<std::size_t>(end)], shaft) ? 'o' : '-';
    line += "  ";
    for (const std::vector<int>& tied : draft.tieup) line += holds(tied, shaft) ? 'o' : '-';
    line.erase(line.find_last_not_of(' ') + 1);
  }
  above.emplace_back();
  lines.insert(lines.begin(), above.begin(), above.end());
  return lines;
}

void describe_weave(const Weave& weave, Report& report) {
  const WeaveReport facts = report_weave(weave);
  report["ends"] = weave.ends;
  report["picks"] = weave.picks;
  report["smallest_repeat"] = fmt::format("{} x {}", facts.repeat_ends, facts.repeat_picks);
  report["warp_on_face"] = rounded(facts.warp_share);
  add_floats("warp_face", facts.warp_face, report);
  add_floats("warp_back", facts.warp_back, report);
  add_floats("weft_face", facts.weft_face, report);
  add_floats("weft_back", facts.weft_back, report);
  report["interlacing.warp"] = rounded(facts.warp_interlacing);
  report["interlacing.weft"] = rounded(facts.weft_interlacing);
  report["layers"] = facts.layers.size();
  if (const auto density = threads_per_cm(weave.warp)) report["ends_per_cm"] = rounded(*density);
  if (const auto density = threads_per_cm(weave.weft)) report["picks_per_cm"] = rounded(*density);
  const std::optional<double> warp = cover_of(weave.warp);
  const std::optional<double> weft = cover_of(weave.weft);
  if (warp) report["cover.warp"] = rounded(*warp);
  if (weft) report["cover.weft"] = rounded(*weft);
  if (warp && weft) report["cover.cloth"] = rounded(*warp + *weft - *warp * *weft);
  if (!weave.warp.color.empty()) report["colors.warp"] = color_counts(weave.warp);
  if (!weave.weft.color.empty()) report["colors.weft"] = color_counts(weave.weft);
  report["drawing"] = draw_weave(weave);
  report["warnings"] = warnings_of(weave, facts);
}

Report describe_draft(const std::filesystem::path& path) {
  const WifDraft draft = read_wif(path);
  Report report = {{"kind", "weave draft"}, {"title", draft.title}};
  report["shafts"] = draft.shafts;
  if (draft.treadling.empty()) {
    report["plan"] = "lift plan";
  } else {
    report["plan"] = "tie-up and treadling";
    report["treadles"] = draft.treadles;
  }
  report["shed"] = draft.rising_shed ? "rising" : "sinking";
  describe_weave(weave_of_draft(draft, path.filename().string()), report);
  report["drawing"] = draw_draft(draft);
  return report;
}

}  // namespace heddle
