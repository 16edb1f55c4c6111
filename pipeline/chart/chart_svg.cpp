#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/chart/chart_page.h"
#include "pipeline/chart/xml_text.h"

namespace heddle {
namespace {

constexpr double kWidth = 1240;
constexpr double kPanelTop = 64;
constexpr double kPanelHeight = 430;
constexpr double kPanelWidth = 520;
constexpr double kPanelLeft[] = {76, 692};
constexpr double kLegendTop = kPanelTop + kPanelHeight + 74;
constexpr double kLegendRow = 22;
constexpr int kLegendColumns = 4;

// Okabe and Ito's colours, told apart by colour-blind eyes as well, and two more; a second round
// gets other shapes.
constexpr std::array<const char*, 9> kColors = {"#000000", "#0072b2", "#d55e00",
                                                "#009e73", "#cc79a7", "#56b4e9",
                                                "#e69f00", "#7a4a21", "#6a3d9a"};

/// A decimal axis: value to place.
struct LogAxis {
  double low = 1;  // value at `start`
  double high = 10;
  double start = 0;  // px
  double end = 1;

  double place(double value) const {
    const double share = std::log(value / low) / std::log(high / low);
    return start + std::clamp(share, 0.0, 1.0) * (end - start);
  }
};

struct Tick {
  double value;
  bool labelled;
};

/// 1, 2 .. 9 times powers of ten; labels at 1, or at 1, 2, 5 where the axis is short.
std::vector<Tick> ticks_of(const LogAxis& axis) {
  const bool is_short = axis.high / axis.low < 150;
  std::vector<Tick> ticks;
  for (double decade = std::pow(10, std::floor(std::log10(axis.low))); decade <= axis.high;
       decade *= 10) {
    for (int k = 1; k <= 9; ++k) {
      const double value = k * decade;
      if (value < axis.low * 0.999 || value > axis.high * 1.001) continue;
      ticks.push_back({value, k == 1 || (is_short && (k == 2 || k == 5))});
    }
  }
  return ticks;
}

std::string percent_text(double value) {
  return fmt::format("{:g} %", 100 * value);
}

std::string tick_text(double value) {
  if (value < 0.9995) return fmt::format("{:g} ms", 1000 * value);
  return fmt::format("{:g} s", value);
}

std::string marker(std::size_t shape, double x, double y, const std::string& style) {
  switch (shape % 5) {
    case 0:
      return fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="4.5" {}/>)", x, y, style);
    case 1:
      return fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="8.4" height="8.4" {}/>)", x - 4.2,
                         y - 4.2, style);
    case 2:
      return fmt::format(R"(<path d="M{:.1f} {:.1f}l5.2 9h-10.4z" {}/>)", x, y - 5.6, style);
    case 3:
      return fmt::format(R"(<path d="M{:.1f} {:.1f}l5.6 5.6l-5.6 5.6l-5.6 -5.6z" {}/>)", x, y - 5.6,
                         style);
    default:
      return fmt::format(R"(<path d="M{:.1f} {:.1f}l5.2 -9h-10.4z" {}/>)", x, y + 5.6, style);
  }
}

struct Point {
  std::size_t row;
  double cost;
  // where it is drawn: the upper end of the interval where the error cannot be told from none
  double error;
  bool on_front;
};

class ChartDrawing {
 public:
  ChartDrawing(const Chart& chart, ReferenceKind kind)
      : chart_(chart), kind_(static_cast<std::size_t>(kind)) {
    for (const ChartRow& row : chart.rows) {
      if (std::find(methods_.begin(), methods_.end(), row.run.method) == methods_.end()) {
        methods_.push_back(row.run.method);
      }
    }
    double low = INFINITY;
    double high = 0;
    for (const ChartRow& row : chart.rows) {
      if (!row.done()) continue;
      const PictureErrorEstimate& estimate = row.error[kind_].estimate;
      low = std::min(low, shown_error(estimate));
      high = std::max(high, estimate.rmse_high);
    }
    if (!(low < high)) low = high = 0.01;
    error_axis_ = {std::max(low / 1.6, high * 1e-5), high * 1.3, kPanelTop + kPanelHeight,
                   kPanelTop};
  }

  std::string text() {
    const auto legend_rows =
        static_cast<int>((methods_.size() + kLegendColumns - 1) / kLegendColumns);
    const double height = kLegendTop + (legend_rows + 1) * kLegendRow + 8;
    out_ = fmt::format(
        R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {:.0f} {:.0f}" width="{:.0f}" height="{:.0f}" )"
        R"(font-family="system-ui, 'DejaVu Sans', Arial, sans-serif" font-size="12" fill="#222">)"
        "\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        kWidth, height, kWidth, height);
    const ReferenceKind kind = kReferenceKinds[kind_];
    add(fmt::format(R"(<text x="{:.0f}" y="26" font-size="17" font-weight="600">{}</text>)",
                    kPanelLeft[0],
                    xml_text(fmt::format("{}: error against {}", chart_.scene,
                                         kind == ReferenceKind::kFull
                                             ? "the path-traced reference"
                                             : "the reference without light between shells"))));
    panel(0, "time to render");
    panel(1, "time to precompute and render");
    legend();
    return out_ + "</svg>\n";
  }

 private:
  void add(const std::string& line) { out_ += line + "\n"; }

  static double shown_error(const PictureErrorEstimate& estimate) {
    return estimate.relative_rmse > 0 ? estimate.relative_rmse : estimate.rmse_high;
  }
  std::size_t method_index(const ChartRow& row) const {
    return static_cast<std::size_t>(std::find(methods_.begin(), methods_.end(), row.run.method) -
                                    methods_.begin());
  }
  static const char* color(std::size_t method) { return kColors[method % kColors.size()]; }
  static std::size_t shape(std::size_t method) { return method + method / kColors.size(); }

  std::vector<Point> points_of(int which) const {
    std::vector<Point> points;
    for (std::size_t k = 0; k < chart_.rows.size(); ++k) {
      const ChartRow& row = chart_.rows[k];
      if (!row.done() || (which == 1 && !row.total_seconds())) continue;
      points.push_back({k, std::max(1e-6, which == 0 ? row.render_seconds : *row.total_seconds()),
                        shown_error(row.error[kind_].estimate),
                        which == 0 ? row.front_render[kind_] : row.front_total[kind_]});
    }
    return points;
  }

  void panel(int which, const char* title) {
    const std::vector<Point> points = points_of(which);
    const double left = kPanelLeft[which];
    const double right = left + kPanelWidth;
    const double bottom = kPanelTop + kPanelHeight;
    double low = INFINITY;
    double high = 0;
    for (const Point& point : points) {
      low = std::min(low, point.cost);
      high = std::max(high, point.cost);
    }
    if (points.empty()) low = high = 1;
    const LogAxis cost_axis{low / 1.5, high * 1.8, left, right};

    for (const Tick& tick : ticks_of(cost_axis)) {
      const double x = cost_axis.place(tick.value);
      add(fmt::format(R"(<path d="M{:.1f} {:.1f}V{:.1f}" stroke="{}"/>)", x, kPanelTop, bottom,
                      tick.labelled ? "#d5d5d5" : "#efefef"));
      if (!tick.labelled) continue;
      add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)", x,
                      bottom + 18, tick_text(tick.value)));
    }
    for (const Tick& tick : ticks_of(error_axis_)) {
      const double y = error_axis_.place(tick.value);
      add(fmt::format(R"(<path d="M{:.1f} {:.1f}H{:.1f}" stroke="{}"/>)", left, y, right,
                      tick.labelled ? "#d5d5d5" : "#efefef"));
      if (!tick.labelled) continue;
      add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>)", left - 8, y + 4,
                      percent_text(tick.value)));
    }
    add(fmt::format(
        R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="#888"/>)",
        left, kPanelTop, kPanelWidth, kPanelHeight));
    add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle" font-size="13">{}</text>)",
                    (left + right) / 2, bottom + 42, title));
    if (which == 0) {
      add(fmt::format(
          R"~(<text transform="translate({:.1f} {:.1f}) rotate(-90)" text-anchor="middle" font-size="13">)~"
          "relative RMSE</text>",
          left - 58, kPanelTop + kPanelHeight / 2));
    }
    front(points, cost_axis, right);
    curves(points, cost_axis);
    for (const Point& point : points) draw(point, cost_axis);
    labels(points, cost_axis, right);
  }

  /// Staircase: the least error that a given time has bought.
  void front(std::vector<Point> points, const LogAxis& cost_axis, double right) {
    std::erase_if(points, [](const Point& point) { return !point.on_front; });
    std::sort(points.begin(), points.end(),
              [](const Point& a, const Point& b) { return a.cost < b.cost; });
    std::string path;
    for (const Point& point : points) {
      const double x = cost_axis.place(point.cost);
      path +=
          path.empty() ? fmt::format("M{:.1f} {:.1f}", x, kPanelTop) : fmt::format("H{:.1f}", x);
      path += fmt::format("V{:.1f}", error_axis_.place(point.error));
    }
    if (path.empty()) return;
    add(fmt::format(
        R"(<path class="front" d="{}H{:.1f}" fill="none" stroke="#f0c400" stroke-width="6" )"
        R"(stroke-linejoin="round" opacity="0.55"/>)",
        path, right));
  }

  void curves(const std::vector<Point>& points, const LogAxis& cost_axis) {
    for (std::size_t method = 0; method < methods_.size(); ++method) {
      std::string path;
      for (const Point& point : points) {
        if (method_index(chart_.rows[point.row]) != method) continue;
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L",
                            cost_axis.place(point.cost), error_axis_.place(point.error));
      }
      if (path.empty()) continue;
      add(fmt::format(R"(<path d="{}" fill="none" stroke="{}" stroke-width="1.3" opacity="0.6"/>)",
                      path, color(method)));
    }
  }

  void draw(const Point& point, const LogAxis& cost_axis) {
    const ChartRow& row = chart_.rows[point.row];
    const PictureErrorEstimate& estimate = row.error[kind_].estimate;
    const std::size_t method = method_index(row);
    const double x = cost_axis.place(point.cost);
    const double y = error_axis_.place(point.error);
    const double low =
        estimate.rmse_low > 0 ? error_axis_.place(estimate.rmse_low) : kPanelTop + kPanelHeight;
    const double high = error_axis_.place(estimate.rmse_high);
    // Hollow: not told from an error of zero.
    const char* fill = estimate.rmse_low > 0 ? color(method) : "#fff";
    add(fmt::format(R"(<g class="point" data-row="{}" tabindex="0">)", point.row));
    add(fmt::format(
        "<title>{}</title>",
        xml_text(fmt::format("{}, {}: {:.3g} % in {:.3g} s", row.run.method, row.run.label,
                             100 * estimate.relative_rmse, point.cost))));
    add(fmt::format(
        R"(<path d="M{0:.1f} {1:.1f}V{2:.1f}M{3:.1f} {1:.1f}h6M{3:.1f} {2:.1f}h6" stroke="{4}" )"
        R"(stroke-width="1.2" fill="none"/>)",
        x, low, high, x - 3, color(method)));
    add(marker(shape(method), x, y,
               fmt::format(R"(fill="{}" stroke="{}" stroke-width="1.2")", fill, color(method))));
    add("</g>");
  }

  /// Names points of the front where there is room.
  void labels(const std::vector<Point>& points, const LogAxis& cost_axis, double right) {
    struct Box {
      double x0, y0, x1, y1;
    };
    std::vector<Box> taken;
    for (const Point& point : points) {
      const double x = cost_axis.place(point.cost);
      const double y = error_axis_.place(point.error);
      taken.push_back({x - 5, y - 5, x + 5, y + 5});
    }
    for (const Point& point : points) {
      if (!point.on_front) continue;
      const std::string& text = chart_.rows[point.row].run.label;
      const double width = 6.2 * static_cast<double>(text.size());
      const double x = cost_axis.place(point.cost);
      const double y = error_axis_.place(point.error);
      const std::array<Box, 4> places = {
          Box{x + 8, y - 16, x + 8 + width, y - 4}, Box{x - 8 - width, y + 4, x - 8, y + 16},
          Box{x + 8, y + 4, x + 8 + width, y + 16}, Box{x - 8 - width, y - 16, x - 8, y - 4}};
      for (const Box& box : places) {
        const bool inside =
            box.x0 > right - kPanelWidth && box.x1 < right && box.y1 < kPanelTop + kPanelHeight;
        const bool is_free = std::none_of(taken.begin(), taken.end(), [&](const Box& other) {
          return box.x0 < other.x1 && other.x0 < box.x1 && box.y0 < other.y1 && other.y0 < box.y1;
        });
        if (!inside || !is_free) continue;
        add(fmt::format(
            R"(<text x="{:.1f}" y="{:.1f}" font-size="11" fill="#444" stroke="#fff" stroke-width="3" )"
            R"(paint-order="stroke">{}</text>)",
            box.x0, box.y1 - 2, xml_text(text)));
        taken.push_back(box);
        break;
      }
    }
  }

  void legend() {
    const double column = (kWidth - 2 * kPanelLeft[0] + 40) / kLegendColumns;
    for (std::size_t method = 0; method < methods_.size(); ++method) {
      const double x = kPanelLeft[0] + column * static_cast<double>(method % kLegendColumns);
      const double y = kLegendTop + kLegendRow * static_cast<double>(method / kLegendColumns);
      add(marker(shape(method), x, y, fmt::format(R"(fill="{0}" stroke="{0}")", color(method))));
      add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}">{}</text>)", x + 12, y + 4,
                      xml_text(methods_[method])));
    }
    const auto failed = std::count_if(chart_.rows.begin(), chart_.rows.end(),
                                      [](const ChartRow& row) { return !row.done(); });
    const double y = kLegendTop +
                     kLegendRow * std::ceil(static_cast<double>(methods_.size()) / kLegendColumns) +
                     6;
    const ChartReference& reference = chart_.references[kind_];
    std::string note = fmt::format(
        "Yellow: Pareto front. Bars: 95 % intervals. Hollow: cannot be told from no error. "
        "Reference: {} "
        "spp in two halves "
        "(its noise, "
        "{:.2g} %, does not count). {} threads.",
        reference.request.spp, 100 * reference.noise.rms, chart_.threads);
    if (failed > 0) note += fmt::format(" Runs that failed: {}.", failed);
    add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" fill="#555">{}</text>)", kPanelLeft[0] - 5, y,
                    xml_text(note)));
  }

  const Chart& chart_;
  std::size_t kind_;
  std::vector<std::string> methods_;
  LogAxis error_axis_;
  std::string out_;
};

}  // namespace

std::string chart_svg(const Chart& chart, ReferenceKind kind) {
  return ChartDrawing(chart, kind).text();
}

}  // namespace heddle
