#ifndef HEDDLE_PIPELINE_CHART_XML_TEXT_H_
#define HEDDLE_PIPELINE_CHART_XML_TEXT_H_
// Text as content or attribute of SVG and HTML. Tested in tests/pipeline/chart_test.cpp.

#include <string>
#include <string_view>

namespace heddle {

inline std::string xml_text(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else if (c == '>') {
      escaped += "&gt;";
    } else if (c == '"') {
      escaped += "&quot;";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_CHART_XML_TEXT_H_
