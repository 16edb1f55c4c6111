#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "pipeline/chart/chart_page.h"
#include "pipeline/chart/xml_text.h"

namespace heddle {
namespace {

namespace fs = std::filesystem;

std::string base64(const std::vector<std::byte>& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const auto byte = [&](std::size_t offset) {
      return k + offset < bytes.size() ? std::to_integer<std::uint32_t>(bytes[k + offset]) : 0U;
    };
    const std::uint32_t group = byte(0) << 16U | byte(1) << 8U | byte(2);
    text += kDigits[group >> 18U];
    text += kDigits[group >> 12U & 63U];
    text += k + 1 < bytes.size() ? kDigits[group >> 6U & 63U] : '=';
    text += k + 2 < bytes.size() ? kDigits[group & 63U] : '=';
  }
  return text;
}

/// JSON as content of a <script>: no tag can end inside.
std::string script_text(const nlohmann::ordered_json& json) {
  std::string text;
  for (const char c : json.dump()) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

constexpr char kStyle[] = R"(
body { font: 14px/1.45 system-ui, 'DejaVu Sans', Arial, sans-serif; color: #222; background: #fff; margin: 1.2em auto; max-width: 1300px;
       padding: 0 1em; }
h1 { font-size: 1.35em; margin: 0 0 .2em; }
svg { width: 100%; height: auto; }
.point { cursor: pointer; outline: none; }
.point.chosen > *, .point:focus > *, .point:hover > * { stroke-width: 3.2; }
button { font: inherit; padding: .25em .8em; border: 1px solid #888; background: #fff; cursor: pointer; }
button.chosen { background: #222; color: #fff; }
#detail { display: flex; flex-wrap: wrap; gap: 1.2em; align-items: flex-start; margin: .6em 0 1.4em; padding: 1em; background: #f4f4f2;
          min-height: 17em; }
figure { margin: 0; }
figure img { image-rendering: pixelated; width: 252px; background: #ddd; display: block; }
figcaption { font-size: .9em; color: #555; }
#facts td { padding: 0 .9em .1em 0; vertical-align: top; }
#facts td:first-child { color: #666; }
#facts .key { font-family: monospace; font-size: .85em; }
#rows { border-collapse: collapse; width: 100%; font-size: .92em; }
#rows th, #rows td { text-align: right; padding: .15em .5em; border-bottom: 1px solid #e4e4e4; white-space: nowrap; }
#rows th:nth-child(-n+2), #rows td:nth-child(-n+2), #rows .message { text-align: left; white-space: normal; }
#rows tr { cursor: pointer; }
#rows tbody tr:hover, #rows tr.chosen { background: #fff3b8; }
#rows .front { font-weight: 700; }
.failed { color: #a00; }
)";

constexpr char kScript[] = R"(
const chart = JSON.parse(document.getElementById('chart').textContent);
const images = JSON.parse(document.getElementById('images').textContent);
let reference = 'full', chosen = chart.rows.findIndex(row => row.status === 'done');
const all = selector => Array.from(document.querySelectorAll(selector));
const percent = value => (value >= 1 ? (100 * value).toFixed(0) : (100 * value).toPrecision(3)) + ' %';
const seconds = value => value === null ? 'unknown' : value >= 1 ? value.toPrecision(4) + ' s' : (1000 * value).toPrecision(3) + ' ms';
const cell = (parent, text, name) => {
  const element = parent.insertCell();
  element.textContent = text;
  if (name) element.className = name;
  return element;
};
function picture(id, path) {
  const image = document.getElementById(id);
  if (path) image.src = images[path]; else image.removeAttribute('src');
}
function show() {
  const row = chart.rows[chosen];
  if (!row) return;
  const facts = document.getElementById('facts');
  facts.textContent = '';
  const fact = (name, text, style) => { const line = facts.insertRow(); cell(line, name); cell(line, text, style); };
  fact('method', row.method);
  for (const [name, value] of Object.entries(row.settings)) fact(name, String(value));
  const error = row.error[reference];
  if (row.status === 'done') {
    fact('relative RMSE', percent(error.relative_rmse) + ' (' + percent(error.relative_rmse_low) + ' to ' + percent(error.relative_rmse_high) + ')');
    fact('mean colour', error.color_ratio.map((ratio, c) => ratio.toFixed(4) + ' \u00b1 ' + error.color_ratio_error[c].toFixed(4)).join(', '));
    fact('99th percentile', percent(error.percentile99));
    fact('FLIP', error.flip.toFixed(4));
    fact('render', seconds(row.render_seconds) + ' (' + seconds(row.render_core_seconds) + ' of cores)');
    fact('precompute', seconds(row.precompute_seconds));
    for (const stage of row.stages) fact('\u2003' + stage.stage, seconds(stage.seconds));
  } else {
    fact('failed', row.message, 'failed');
  }
  fact('seed', String(row.seed));
  fact('program', row.program_version);
  fact('key', row.key, 'key');
  picture('picture', row.picture);
  picture('reference', chart.references[reference].picture);
  picture('difference', error ? error.difference : null);
  for (const element of all('[data-row]')) element.classList.toggle('chosen', Number(element.dataset.row) === chosen);
}
function choose(row) { chosen = row; show(); }
function choose_reference(name) {
  reference = name;
  for (const part of all('.chart')) part.hidden = part.dataset.reference !== name;
  for (const button of all('button')) button.classList.toggle('chosen', button.dataset.reference === name);
  fill();
  show();
}
function fill() {
  const body = document.querySelector('#rows tbody');
  body.textContent = '';
  chart.rows.forEach((row, k) => {
    const line = body.insertRow();
    line.dataset.row = k;
    line.addEventListener('click', () => choose(k));
    cell(line, row.method);
    cell(line, row.label);
    if (row.status !== 'done') { cell(line, row.message, 'failed message').colSpan = 9; return; }
    const error = row.error[reference];
    cell(line, seconds(row.precompute_seconds));
    cell(line, seconds(row.render_seconds), error.front_render ? 'front' : '');
    cell(line, seconds(row.total_seconds), error.front_total ? 'front' : '');
    cell(line, seconds(row.render_core_seconds));
    cell(line, percent(error.relative_rmse), error.front_render || error.front_total ? 'front' : '');
    cell(line, percent(error.relative_rmse_low) + ' \u2013 ' + percent(error.relative_rmse_high));
    cell(line, error.color_ratio.map(ratio => ratio.toFixed(3)).join(' '));
    cell(line, percent(error.percentile99));
    cell(line, error.flip.toFixed(3));
  });
}
let points = 0;
for (const element of all('.point')) {
  const row = Number(element.dataset.row);
  if (!chart.rows[row]) continue;
  for (const event of ['mouseenter', 'click', 'focus']) element.addEventListener(event, () => choose(row));
  ++points;
}
for (const button of all('button')) button.addEventListener('click', () => choose_reference(button.dataset.reference));
choose_reference('full');
document.body.dataset.points = points;
)";

}  // namespace

std::string chart_html(const Chart& chart, const fs::path& folder) {
  const nlohmann::ordered_json json = chart_json(chart);
  nlohmann::ordered_json images = nlohmann::ordered_json::object();
  const auto embed = [&](const fs::path& path) {
    const std::string name = path.generic_string();
    if (!images.contains(name))
      images[name] = "data:image/png;base64," + base64(read_whole_file(folder / path));
  };
  for (const ChartReference& reference : chart.references) embed(reference.picture);
  for (const ChartRow& row : chart.rows) {
    if (!row.done()) continue;
    embed(row.picture);
    for (const fs::path& difference : row.difference) embed(difference);
  }

  std::string charts;
  for (const ReferenceKind kind : kReferenceKinds) {
    charts += fmt::format("<div class=\"chart\" data-reference=\"{}\">\n{}</div>\n",
                          reference_name(kind), chart_svg(chart, kind));
  }
  return fmt::format(
      R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,">
<title>{0}: speed against accuracy</title>
<style>{1}</style>
</head>
<body>
<h1>{0}: speed against accuracy</h1>
<p>{2} x {3} pixels, {4} threads, {5}. Heddle {6}.
Measured against <button data-reference="full">all light</button> <button data-reference="local">light within each shell</button></p>
{7}<div id="detail">
<figure><img id="picture" alt="picture of the chosen run"><figcaption>picture</figcaption></figure>
<figure><img id="reference" alt="reference picture"><figcaption>reference</figcaption></figure>
<figure><img id="difference" alt="difference"><figcaption>difference: red too bright, blue too dark</figcaption></figure>
<table id="facts"></table>
</div>
<table id="rows"><thead><tr><th>method</th><th>setting</th><th>precompute</th><th>render</th><th>both</th><th>cores</th><th>RMSE</th>
<th>95 %</th><th>mean colour</th><th>99th pct.</th><th>FLIP</th></tr></thead><tbody></tbody></table>
<p>Bold: on the Pareto front. What the columns mean: docs/chart.md.</p>
<script type="application/json" id="chart">{8}</script>
<script type="application/json" id="images">{9}</script>
<script>{10}</script>
</body>
</html>
)",
      xml_text(chart.scene), kStyle, chart.crop.width, chart.crop.height, chart.threads,
      xml_text(chart.processor), xml_text(json.at("program_version").get<std::string>()), charts,
      script_text(json), script_text(images), kScript);
}

}  // namespace heddle
