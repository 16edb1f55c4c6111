#ifndef HEDDLE_PIPELINE_CHART_CHART_PAGE_H_
#define HEDDLE_PIPELINE_CHART_CHART_PAGE_H_
// A chart for people. The SVG has two log-log panels: error over the time to render, and over that
// time with the precomputation. The page holds it with the pictures of all its points. Both stand
// alone: no script, font or file from elsewhere. Tested in tests/pipeline/chart_test.cpp, which
// opens the page in Chromium.

#include <filesystem>
#include <string>

#include "pipeline/chart/chart.h"

namespace heddle {

/// Every point is <g class="point" data-row="place in chart.rows">; rows that failed have none.
std::string chart_svg(const Chart& chart, ReferenceKind kind);

/// Pictures are read from `folder` and become part of the page. Once its script has run, <body>
/// says data-points, the number of points that answer to hover, click and keyboard.
std::string chart_html(const Chart& chart, const std::filesystem::path& folder);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CHART_CHART_PAGE_H_
