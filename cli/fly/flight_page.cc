#include "cli/fly/flight_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "cli/svg.h"

namespace scarp {
namespace {

constexpr const char* kColours[] = {"#1f77b4", "#d6502b", "#2a9d5c", "#9457b8",
                                    "#c49a00", "#17a2b8", "#8c564b", "#e377c2",
                                    "#7f8c1f", "#5060d0", "#b02050", "#00705a"};

struct Line {
  std::string name;
  const char* colour;
  std::vector<double> values;  // by frame
};

/// Lines by frame, from zero, with their names at their right ends.
std::string line_chart(const std::string& title, const std::vector<Line>& lines) {
  constexpr double kWidthPx = 960, kLeftPx = 80, kRightPx = 780, kTopPx = 40, kNamePx = 15;
  // As high as the names need.
  const double bottom_px = std::max(260.0, kTopPx + kNamePx * static_cast<double>(lines.size()));
  double most = 0;
  std::size_t frames = 1;
  for (const Line& line : lines) {
    frames = std::max(frames, line.values.size());
    for (const double value : line.values) most = std::max(most, value);
  }
  if (most == 0) most = 1;
  const auto x_of = [&](std::size_t frame) {
    return kLeftPx + (kRightPx - kLeftPx) * static_cast<double>(frame) /
                         static_cast<double>(std::max<std::size_t>(1, frames - 1));
  };
  const auto y_of = [&](double value) { return bottom_px - (bottom_px - kTopPx) * value / most; };
  std::string svg = svg_begin(kWidthPx, bottom_px + 40);
  svg += svg_text(kLeftPx, 22, "start", kInkColour, 15, title);
  const double step = round_step(most, 5);
  for (double value = 0; value <= most; value += step) {
    svg += fmt::format("<path d=\"M{} {:.1f}H{}\" stroke=\"{}\"/>\n", kLeftPx, y_of(value),
                       kRightPx, kFaintColour);
    svg +=
        svg_text(kLeftPx - 8, y_of(value) + 4.5, "end", kInkColour, 12, fmt::format("{:g}", value));
  }
  const double frame_step = std::max(1.0, round_step(static_cast<double>(frames), 8));
  for (double frame = 0; frame < static_cast<double>(frames); frame += frame_step)
    svg += svg_text(x_of(static_cast<std::size_t>(frame)), bottom_px + 18, "middle", kInkColour, 12,
                    fmt::format("{:g}", frame));
  svg += svg_text((kLeftPx + kRightPx) / 2, bottom_px + 36, "middle", kSoftColour, 12, "frame");
  // Names keep a line's height between them.
  std::vector<std::pair<double, const Line*>> ends;
  for (const Line& line : lines) {
    std::string points;
    for (std::size_t i = 0; i < line.values.size(); ++i)
      points += fmt::format("{:.1f},{:.1f} ", x_of(i), y_of(line.values[i]));
    svg +=
        fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>\n",
                    points, line.colour);
    if (!line.values.empty()) ends.emplace_back(y_of(line.values.back()), &line);
  }
  std::sort(ends.begin(), ends.end());
  double floor_px = kTopPx;
  for (auto& [y_px, line] : ends) floor_px = (y_px = std::max(y_px, floor_px)) + kNamePx;
  double ceiling_px = bottom_px;
  for (auto end = ends.rbegin(); end != ends.rend(); ++end)
    ceiling_px = (end->first = std::min(end->first, ceiling_px)) - kNamePx;
  for (const auto& [y_px, line] : ends)
    svg += svg_text(kRightPx + 8, y_px + 4, "start", line->colour, 12, line->name);
  return svg + "</svg>\n";
}

const char* colour_of(std::size_t contender) {
  return kColours[contender % std::size(kColours)];
}

/// A chart with a line a contender.
std::string chart_of(const Flight& flight, const std::vector<Contender>& contenders,
                     const std::string& title,
                     const std::function<double(const FrameCounts&)>& value,
                     std::vector<Line> lines = {}) {
  for (std::size_t c = 0; c < contenders.size(); ++c) {
    Line line{contenders[c].label, colour_of(c), {}};
    for (const FrameCounts& counts : flight.counts[c]) line.values.push_back(value(counts));
    lines.push_back(std::move(line));
  }
  return line_chart(title, lines);
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string table_of(const Flight& flight, const std::vector<Contender>& contenders) {
  std::string html =
      "<table><tr><th>method</th><th>claims no wrong pixel</th><th>triangles drawn</th>"
      "<th>of those in view</th><th>times those in visible groups</th><th>find, ms</th>"
      "<th>draw, ms</th>";
  for (const int scale : kPictureScales)
    html += fmt::format("<th>wrong pixels, x{0}</th><th>judged wrong, x{0}</th>", scale);
  html +=
      "<th>groups missed</th><th>movers drawn</th><th>movers missed</th><th>prepared in, "
      "s</th><th>keeps, bytes</th></tr>\n";
  for (std::size_t c = 0; c < contenders.size(); ++c) {
    const FlightSum sum = sum_of(flight, c);
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.0f}</td><td>{:.1f} %</td><td>{:.2f}</td><td>{:.3f}</td>"
        "<td>{:.2f}</td>",
        escaped(contenders[c].label), contenders[c].is_conservative ? "yes" : "no", sum.drawn,
        100 * sum.drawn / std::max(1.0, sum.in_view),
        sum.drawn / std::max(1.0, sum.in_visible_groups), sum.find_ms, sum.draw_ms);
    for (std::size_t s = 0; s < kPictureScales.size(); ++s)
      html += fmt::format("<td>{}</td><td>{}</td>", sum.wrong_px[s], sum.judged_wrong_px[s]);
    html += fmt::format("<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        sum.missed_groups, sum.movers, sum.missed_movers,
                        std::isnan(contenders[c].prepare_s)
                            ? "in the scene"
                            : fmt::format("{:.3f}", contenders[c].prepare_s),
                        contenders[c].bytes);
  }
  return html + "</table>\n";
}

}  // namespace

FlightSum sum_of(const Flight& flight, std::size_t contender) {
  FlightSum sum;
  std::vector<double> find_ms, draw_ms;
  const double frames = static_cast<double>(std::max<std::size_t>(1, flight.truth.size()));
  for (std::size_t i = 0; i < flight.truth.size(); ++i) {
    const FrameCounts& counts = flight.counts[contender][i];
    const FrameTruth& truth = flight.truth[i];
    sum.drawn += static_cast<double>(counts.drawn) / frames;
    sum.in_view += static_cast<double>(truth.in_view) / frames;
    sum.visible += static_cast<double>(truth.visible) / frames;
    sum.in_visible_groups += static_cast<double>(truth.in_visible_groups) / frames;
    find_ms.push_back(counts.find_ms);
    draw_ms.push_back(counts.draw_ms);
    for (std::size_t s = 0; s < kPictureScales.size(); ++s) {
      sum.wrong_px[s] += counts.wrong_px[s];
      sum.judged_wrong_px[s] += counts.judged_wrong_px[s];
    }
    sum.missed_groups += counts.missed_groups;
    sum.movers += counts.movers;
    sum.missed_movers += counts.missed_movers;
  }
  sum.find_ms = median(std::move(find_ms));
  sum.draw_ms = median(std::move(draw_ms));
  return sum;
}

std::string flight_csv(const Flight& flight, const std::vector<Contender>& contenders) {
  std::string csv = "frame,method,in_view,visible,in_visible_groups,groups,drawn,find_ms,draw_ms";
  for (const int scale : kPictureScales)
    csv += fmt::format(",wrong_px_x{0},judged_wrong_px_x{0}", scale);
  csv += ",missed_groups,movers_in_view,movers_visible,movers,missed_movers\n";
  for (std::size_t frame = 0; frame < flight.truth.size(); ++frame)
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      const FrameTruth& truth = flight.truth[frame];
      const FrameCounts& counts = flight.counts[c][frame];
      csv += fmt::format("{},{},{},{},{},{},{},{:.4f},{:.3f}", frame, contenders[c].label,
                         truth.in_view, truth.visible, truth.in_visible_groups, counts.groups,
                         counts.drawn, counts.find_ms, counts.draw_ms);
      for (std::size_t s = 0; s < kPictureScales.size(); ++s)
        csv += fmt::format(",{},{}", counts.wrong_px[s], counts.judged_wrong_px[s]);
      csv += fmt::format(",{},{},{},{},{}\n", counts.missed_groups, truth.movers,
                         truth.visible_movers, counts.movers, counts.missed_movers);
    }
  return csv;
}

std::string flight_page(const Flight& flight, const std::vector<Contender>& contenders,
                        const std::string& title,
                        const std::vector<std::pair<std::string, std::string>>& pictures) {
  Line in_view{"in view", kSoftColour, {}}, visible{"truly visible", kInkColour, {}};
  Line in_groups{"in visible groups", "#a0a6ae", {}};
  for (const FrameTruth& truth : flight.truth) {
    in_view.values.push_back(static_cast<double>(truth.in_view));
    visible.values.push_back(static_cast<double>(truth.visible));
    in_groups.values.push_back(static_cast<double>(truth.in_visible_groups));
  }
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n"
      "<style>body{{font:15px Helvetica,Arial,sans-serif;color:{1};max-width:1000px;margin:2em "
      "auto;padding:0 1em}}table{{border-collapse:collapse;font-size:13px}}td,th{{padding:4px "
      "8px;text-align:right;border-bottom:1px solid {2};vertical-align:bottom}}td:first-child,"
      "th:first-child{{text-align:left}}svg,img{{max-width:100%;height:auto}}figure{{margin:1em "
      "0}}</style></head><body>\n<h1>{0}</h1>\n",
      escaped(title), kInkColour, kFaintColour);
  html += table_of(flight, contenders);
  html += chart_of(flight, contenders, "triangles drawn",
                   [](const FrameCounts& c) { return static_cast<double>(c.drawn); },
                   {in_view, visible, in_groups});
  html += chart_of(flight, contenders,
                   fmt::format("wrong pixels, at {} times the size", kPictureScales.back()),
                   [](const FrameCounts& c) { return static_cast<double>(c.wrong_px.back()); });
  html += chart_of(flight, contenders, "milliseconds to find the groups",
                   [](const FrameCounts& c) { return c.find_ms; });
  html += chart_of(flight, contenders, "milliseconds to draw them",
                   [](const FrameCounts& c) { return c.draw_ms; });
  for (const auto& [file, words] : pictures)
    html += fmt::format("<figure><img src=\"{}\" alt=\"{}\"><figcaption>{}</figcaption></figure>\n",
                        escaped(file), escaped(words), escaped(words));
  return html + "</body></html>\n";
}

}  // namespace scarp
