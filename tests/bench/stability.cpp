// The error curves of every known failure (docs/stability.md) as one CSV and one sheet of curves,
// the limit from which the program warns drawn in.
//
//   heddle_stability [NAME ...] [--quick] [--out PREFIX]     PREFIX.csv and PREFIX.svg; a few
//                                                            minutes of one core

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "formats/input_error.h"
#include "pipeline/chart/xml_text.h"
#include "tests/stability/stability_curve.h"

namespace heddle::stability {
namespace {

constexpr std::array<const char*, 4> kColors = {"#d62728", "#1f77b4", "#2ca02c", "#9467bd"};
constexpr double kPanelWidth = 400;
constexpr double kPanelHeight = 290;
constexpr int kColumns = 3;
// Of a panel, around the plot.
constexpr double kLeft = 58;
constexpr double kRight = 14;
constexpr double kTop = 64;
constexpr double kBottom = 44;

struct Measured {
  std::string name;
  Curve curve;
};

void write_csv(std::ostream& out, const std::vector<Measured>& curves) {
  out << "curve,driver,value_of_driver,series,value,warning_from\n";
  for (const auto& [name, curve] : curves) {
    for (const Series& series : curve.series) {
      for (std::size_t k = 0; k < curve.drivers.size(); ++k) {
        out << fmt::format("{},\"{}\",{:.6g},\"{}\",{:.6g},{}\n", name, curve.driver,
                           curve.drivers[k], series.name, series.values[k],
                           curve.warning_from ? fmt::format("{:g}", *curve.warning_from) : "");
      }
    }
  }
}

/// Errors on a logarithmic axis of whole decades.
struct Axes {
  double left, bottom, width, height;
  double first, last;  // driver, its logarithm where is_log
  double low, high;    // log10 of the error
  bool is_log;
  double x(double driver) const {
    return left + width * ((is_log ? std::log10(driver) : driver) - first) / (last - first);
  }
  double y(double value) const {
    return bottom - height * (std::clamp(std::log10(std::max(value, 1e-30)), low, high) - low) /
                        (high - low);
  }
};

Axes axes_of(const Curve& curve, double left, double top) {
  Axes axes{left + kLeft,
            top + kPanelHeight - kBottom,
            kPanelWidth - kLeft - kRight,
            kPanelHeight - kTop - kBottom,
            0,
            0,
            0,
            0,
            curve.is_log};
  std::vector<double> drivers = curve.drivers;
  if (curve.warning_from) drivers.push_back(*curve.warning_from);
  const auto [least, most] = std::minmax_element(drivers.begin(), drivers.end());
  axes.first = curve.is_log ? std::log10(*least) : *least;
  axes.last = curve.is_log ? std::log10(*most) : *most;
  double low = 0;
  double high = -30;
  for (const Series& series : curve.series) {
    for (const double value : series.values) {
      if (value > 0) low = std::min(low, std::log10(value));
      if (value > 0) high = std::max(high, std::log10(value));
    }
  }
  axes.high = std::max(std::ceil(high), -1.0);
  axes.low = std::clamp(std::floor(low), axes.high - 16, axes.high - 2);
  return axes;
}

void draw(std::ostream& out, const Measured& measured, double left, double top) {
  const Curve& curve = measured.curve;
  const Axes axes = axes_of(curve, left, top);
  const double right = axes.left + axes.width;
  const double upper = axes.bottom - axes.height;
  out << fmt::format(
      "<text x=\"{:.0f}\" y=\"{:.0f}\" font-size=\"13\" font-weight=\"bold\">{}</text>\n", left + 8,
      top + 18, xml_text(curve.title));
  double x = left + 8;
  for (std::size_t s = 0; s < curve.series.size(); ++s) {
    out << fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" fill=\"{}\">{}</text>\n", x, top + 34,
                       kColors[s], xml_text(curve.series[s].name));
    x += 14 + 5.6 * static_cast<double>(curve.series[s].name.size());
  }
  out << fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" fill=\"#555555\">{}</text>\n", left + 8,
                     top + 50, xml_text(curve.measure));
  if (curve.warning_from) {
    const double at = axes.x(*curve.warning_from);
    const double to = curve.warning_to ? axes.x(*curve.warning_to) : right;
    out << fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#fff0c8\"/>\n",
        curve.warns_above ? at : axes.left, upper, curve.warns_above ? to - at : at - axes.left,
        axes.height);
    out << fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#b07000\" "
        "stroke-dasharray=\"4 3\"/>\n",
        at, upper, axes.bottom);
  }
  const int step = axes.high - axes.low > 6 ? 4 : 1;
  for (int decade = static_cast<int>(axes.high); decade >= static_cast<int>(axes.low);
       decade -= step) {
    const double y = axes.y(std::pow(10.0, decade));
    out << fmt::format(
        "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#dddddd\"/>\n",
        axes.left, right, y, y);
    out << fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
                       axes.left - 4, y + 4,
                       decade >= -3 ? fmt::format("{:g} %", 100 * std::pow(10.0, decade))
                                    : fmt::format("1e{}", decade));
  }
  out << fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"#999999\"/>\n",
      axes.left, upper, axes.width, axes.height);
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const double at = axes.first + share * (axes.last - axes.first);
    out << fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.3g}</text>\n",
                       axes.left + share * axes.width, axes.bottom + 14,
                       curve.is_log ? std::pow(10.0, at) : at);
  }
  out << fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                     axes.left + 0.5 * axes.width, axes.bottom + 30, xml_text(curve.driver));
  for (std::size_t s = 0; s < curve.series.size(); ++s) {
    std::vector<std::pair<double, double>> points;
    for (std::size_t k = 0; k < curve.drivers.size(); ++k)
      points.emplace_back(curve.drivers[k], curve.series[s].values[k]);
    std::sort(points.begin(), points.end());
    out << "<polyline fill=\"none\" stroke=\"" << kColors[s] << "\" stroke-width=\"1.6\" points=\"";
    for (const auto& [driver, value] : points)
      out << fmt::format("{:.1f},{:.1f} ", axes.x(driver), axes.y(value));
    out << "\"/>\n";
    for (const auto& [driver, value] : points) {
      out << fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.4\" fill=\"{}\"/>\n",
                         axes.x(driver), axes.y(value), kColors[s]);
    }
  }
}

void write_svg(std::ostream& out, const std::vector<Measured>& curves) {
  const std::size_t rows = (curves.size() + kColumns - 1) / kColumns;
  out << fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.0f}\" height=\"{:.0f}\" "
      "font-family=\"sans-serif\" "
      "font-size=\"10.5\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
      kColumns * kPanelWidth, static_cast<double>(rows) * kPanelHeight);
  for (std::size_t k = 0; k < curves.size(); ++k) {
    draw(out, curves[k], static_cast<double>(k % kColumns) * kPanelWidth,
         static_cast<double>(k / kColumns) * kPanelHeight);
  }
  out << "</svg>\n";
}

void run(const std::vector<std::string>& names, Effort effort, const std::string& prefix) {
  std::vector<Measured> curves;
  for (const NamedCurve& one : all_curves()) {
    if (!names.empty() && std::find(names.begin(), names.end(), one.name) == names.end()) continue;
    curves.push_back({one.name, one.measure(effort)});
    std::cerr << one.name << '\n';
  }
  for (const auto& [suffix, write] :
       {std::pair{".csv", &write_csv}, std::pair{".svg", &write_svg}}) {
    std::ofstream file(prefix + suffix);
    write(file, curves);
    if (!file.flush()) throw FileError("cannot write " + prefix + suffix);
  }
  write_csv(std::cout, curves);
}

}  // namespace
}  // namespace heddle::stability

int main(int argc, char** argv) {
  std::vector<std::string> names;
  bool quick = false;
  std::string prefix = "stability";
  CLI::App app("Error curves of every known failure.");
  std::vector<std::string> known;
  for (const auto& curve : heddle::stability::all_curves()) known.emplace_back(curve.name);
  app.add_option("curve", names, "names of docs/stability.md; all of them where absent")
      ->check(CLI::IsMember(known));
  app.add_flag("--quick", quick, "the few points that the tests use");
  app.add_option("--out", prefix, "prefix of the .csv and .svg files");
  CLI11_PARSE(app, argc, argv);
  try {
    using heddle::stability::Effort;
    heddle::stability::run(names, quick ? Effort::kTest : Effort::kFull, prefix);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
