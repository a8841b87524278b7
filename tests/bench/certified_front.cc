#include "tests/bench/certified_front.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "cli/svg.h"
#include "tests/support/eyes_over_ground.h"

namespace scarp::test {
namespace {

constexpr double kWidthPx = 920, kHeightPx = 460, kTopPx = 64, kBottomPx = 400, kPanelPx = 350;
constexpr const char* kColours[] = {"#1f6fb4", "#2a8f5b", "#c2571a", "#8450a8"};
constexpr char kBar[] = "#b3261e";
constexpr double kTextPx = 12;

/// One of the two charts.
struct Panel {
  double left_px, low, high;  // of the axis, which is logarithmic
  const char* figure;
  const char* words;
  const char* varies;  // the points that it shows
  double wanted;

  double x_px(double value) const {
    return left_px + kPanelPx * std::log(value / low) / std::log(high / low);
  }
};

double y_px(double share, double least_share) {
  return kBottomPx - (kBottomPx - kTopPx) * (share - least_share) / (1 - least_share);
}

std::string line(double x0, double y0, double x1, double y1, const char* colour,
                 const char* more = "") {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" {}/>\n", x0, y0,
      x1, y1, colour, more);
}

std::string axes(const Panel& panel, double least_share) {
  std::string svg;
  for (double share = least_share; share < 1.001; share += 0.1) {
    const double y = y_px(share, least_share);
    svg += line(panel.left_px, y, panel.left_px + kPanelPx, y, kFaintColour);
    svg += svg_text(panel.left_px - 6, y + 4, "end", kSoftColour, kTextPx,
                    fmt::format("{:.1f}", share));
  }
  for (const double mark : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 120.0, 250.0, 500.0, 1000.0}) {
    if (mark < panel.low || mark > panel.high) continue;
    svg += line(panel.x_px(mark), kBottomPx, panel.x_px(mark), kBottomPx + 5, kSoftColour);
    svg += svg_text(panel.x_px(mark), kBottomPx + 19, "middle", kSoftColour, kTextPx,
                    fmt::format("{:g}", mark));
  }
  svg += svg_text(panel.left_px + kPanelPx / 2, kBottomPx + 40, "middle", kInkColour, kTextPx,
                  panel.words);
  return svg;
}

/// What is wanted: left of the upright line and over the level one of a colour.
std::string bars(const Panel& panel, double least_share) {
  const double x = panel.x_px(panel.wanted);
  std::string svg = line(x, kTopPx, x, kBottomPx, kBar, "stroke-dasharray=\"6 4\"");
  std::vector<double> drawn;
  for (std::size_t h = 0; h < std::size(kWantedShare); ++h) {
    // Heights of which the same is wanted have lines side by side.
    const auto before = std::count(drawn.begin(), drawn.end(), kWantedShare[h]);
    drawn.push_back(kWantedShare[h]);
    const double y = y_px(kWantedShare[h], least_share) + 2.0 * static_cast<double>(before);
    svg += line(panel.left_px, y, x, y, kColours[h], "stroke-dasharray=\"6 4\"");
  }
  return svg;
}

std::string curves(const Panel& panel, const nlohmann::json& points, double least_share) {
  std::vector<nlohmann::json> shown;
  for (const auto& point : points)
    if (point["is_default"].get<bool>() || point["varies"] == panel.varies) shown.push_back(point);
  std::sort(shown.begin(), shown.end(), [&](const auto& a, const auto& b) {
    return a[panel.figure].template get<double>() < b[panel.figure].template get<double>();
  });
  std::string svg;
  double lowest_px = 0;
  std::vector<double> label_px(shown.size(), 0);
  for (std::size_t h = 0; h < std::size(kWantedShare); ++h) {
    std::string path, marks;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const double x = panel.x_px(shown[i][panel.figure].get<double>());
      const double y = y_px(shown[i]["share"][h].get<double>(), least_share);
      label_px[i] = std::max(label_px[i], y), lowest_px = std::max(lowest_px, y);
      path += fmt::format("{}{:.1f},{:.1f}", i == 0 ? "M" : " L", x, y);
      marks += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n", x, y,
                           shown[i]["is_default"].get<bool>() ? 5 : 3, kColours[h]);
    }
    svg += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>\n{}",
                       path, kColours[h], marks);
  }
  for (std::size_t i = 0; i < shown.size(); ++i)
    svg += svg_text(panel.x_px(shown[i][panel.figure].get<double>()),
                    std::min(label_px[i] + 18, kBottomPx - 6), "middle", kInkColour, 11,
                    shown[i]["label"].get<std::string>());
  return svg;
}

}  // namespace

std::string front_picture(const nlohmann::json& points, const std::string& title) {
  double least_share = 1, most_us = 2 * kMostUs;
  for (const auto& point : points) {
    most_us = std::max(most_us, point["us"].get<double>());
    for (const auto& share : point["share"])
      least_share = std::min(least_share, share.get<double>());
  }
  least_share = std::clamp(std::floor(10 * least_share - 0.5) / 10, 0.0, 0.8);
  const std::array<Panel, 2> panels = {
      Panel{60, 16, 1.3 * most_us, "us", "preparation, processor microseconds a triangle", "fans",
            kMostUs},
      Panel{60 + kPanelPx + 100, 1.5, 44, "bytes", "kept, bytes a triangle", "bytes", kMostBytes}};
  std::string svg = svg_begin(kWidthPx, kHeightPx);
  svg += svg_text(20, 22, "start", kInkColour, 14, title);
  double x = 20;
  for (std::size_t h = 0; h < std::size(kWantedShare); ++h) {
    svg +=
        fmt::format("<circle cx=\"{:.1f}\" cy=\"40\" r=\"4\" fill=\"{}\"/>\n", x + 5, kColours[h]);
    svg += svg_text(x + 14, 44, "start", kInkColour, kTextPx,
                    fmt::format("eye {:g} m up, {:.2f} wanted", kEyeHeightsM[h], kWantedShare[h]));
    x += 222;
  }
  for (const Panel& panel : panels)
    svg += axes(panel, least_share) + bars(panel, least_share) + curves(panel, points, least_share);
  return svg + "</svg>\n";
}

}  // namespace scarp::test
