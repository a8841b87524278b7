#include "cli/compare_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "cli/svg.h"

namespace scarp {
namespace {

constexpr double kWidthPx = 1200, kHeightPx = 620, kTopPx = 150, kBottomPx = 536;
constexpr double kPanelPx = 486, kFirstPanelPx = 84, kSecondPanelPx = 686;
constexpr double kMarkPx = 5, kLabelPx = 12;
constexpr std::array<const char*, 3> kMethodColours = {"#c46a1b", "#2566b0", "#1f8a4c"};

struct Box {
  double low_x, low_y, high_x, high_y;

  bool overlaps(const Box& other) const {
    return low_x < other.high_x && other.low_x < high_x && low_y < other.high_y &&
           other.low_y < high_y;
  }
};

/// One chart: shares against one cost.
class Panel {
 public:
  using Cost = double (*)(const PicturePoint&);
  using Label = const std::string& (*)(const PicturePoint&);

  Panel(const PictureComparison& comparison, double left_px, const char* axis, Cost cost,
        Label label_of)
      : left_px_(left_px), axis_(axis), cost_(cost), label_of_(label_of) {
    for (const PictureMethod& method : comparison.methods) {
      methods_.push_back(method);
      std::erase_if(methods_.back().points,
                    [&](const PicturePoint& p) { return label_of(p).empty(); });
      for (const PicturePoint& p : methods_.back().points) {
        low_ = std::min(low_, std::log10(cost(p)));
        high_ = std::max(high_, std::log10(cost(p)));
        most_ = std::max(most_, p.share);
      }
    }
    constexpr double kLeastDecades = 1;
    const double middle = (low_ + high_) / 2;
    const double half = 0.65 * std::max(high_ - low_, kLeastDecades);  // leaves room for labels
    low_ = middle - half, high_ = middle + half;
    most_ = std::min(1.0, 1.12 * most_ + 0.02);
  }

  std::string draw() {
    axes();
    for (std::size_t m = 0; m < methods_.size(); ++m)
      if (methods_[m].is_joined) line(methods_[m].points, kMethodColours[m]);
    for (std::size_t m = 0; m < methods_.size(); ++m)
      for (const PicturePoint& p : methods_[m].points) mark(p, kMethodColours[m]);
    for (std::size_t m = 0; m < methods_.size(); ++m)
      for (const PicturePoint& p : methods_[m].points) label(p, kMethodColours[m]);
    return svg_;
  }

 private:
  double x_of(double cost) const {
    return left_px_ + kPanelPx * (std::log10(cost) - low_) / (high_ - low_);
  }
  double x_of(const PicturePoint& p) const { return x_of(cost_(p)); }
  double y_of(double share) const { return kBottomPx - (kBottomPx - kTopPx) * share / most_; }

  void axes() {
    constexpr double kMostDecadesOfFineSteps = 3;
    const bool fine = high_ - low_ < kMostDecadesOfFineSteps;
    const std::vector<double> factors = fine ? std::vector{1.0, 2.0, 5.0} : std::vector{1.0, 3.0};
    for (int power = static_cast<int>(std::floor(low_)); power <= high_; ++power)
      for (const double factor : factors) {
        const double cost = factor * std::pow(10, power);
        if (std::log10(cost) < low_ || std::log10(cost) > high_) continue;
        svg_ += fmt::format("<path d=\"M{0:.1f} {1}V{2}\" stroke=\"{3}\"/>\n", x_of(cost), kTopPx,
                            kBottomPx, kFaintColour);
        svg_ += svg_text(x_of(cost), kBottomPx + 20, "middle", kInkColour, 13,
                         fmt::format("{:g}", cost));
      }
    const double step = round_step(100 * most_, 6);
    for (double percent = 0; percent <= 100 * most_; percent += step) {
      const double y = y_of(percent / 100);
      svg_ += fmt::format("<path d=\"M{0} {1:.1f}H{2}\" stroke=\"{3}\"/>\n", left_px_, y,
                          left_px_ + kPanelPx, kFaintColour);
      svg_ += svg_text(left_px_ - 8, y + 4.5, "end", kInkColour, 13, fmt::format("{:g}", percent));
    }
    svg_ += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" fill=\"none\" stroke=\"{4}\"/>\n", left_px_,
                        kTopPx, kBottomPx, left_px_ + kPanelPx, kInkColour);
    svg_ += svg_text(left_px_ + kPanelPx / 2, kBottomPx + 44, "middle", kInkColour, 14, axis_);
    svg_ += svg_text(left_px_ - 44, kTopPx - 14, "start", kInkColour, 14,
                     "culled, % of the hidden triangles");
  }

  /// Through a method's points by rising cost.
  void line(std::vector<PicturePoint> points, const char* colour) {
    std::sort(points.begin(), points.end(),
              [&](const PicturePoint& a, const PicturePoint& b) { return cost_(a) < cost_(b); });
    std::string path;
    for (const PicturePoint& p : points)
      path += fmt::format("{:.1f},{:.1f} ", x_of(p), y_of(p.share));
    svg_ += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" "
        "stroke-opacity=\"0.6\"/>\n",
        path, colour);
  }

  void mark(const PicturePoint& p, const char* colour) {
    const double x = x_of(p), y = y_of(p.share);
    svg_ += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\" stroke=\"{}\" "
        "stroke-width=\"2\"/>\n",
        x, y, kMarkPx, p.is_safe ? colour : "#ffffff", colour);
    if (p.is_default)
      svg_ += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"none\" stroke=\"{}\" "
          "stroke-width=\"1.5\"/>\n",
          x, y, 2 * kMarkPx, kInkColour);
    taken_.push_back({x - kMarkPx, y - kMarkPx, x + kMarkPx, y + kMarkPx});
  }

  /// Beside its mark where nothing is in the way, or nowhere.
  void label(const PicturePoint& p, const char* colour) {
    const std::string& words = label_of_(p);
    const double width = 0.56 * kLabelPx * static_cast<double>(words.size());
    const double gap = (p.is_default ? 2 : 1) * kMarkPx + 3;
    const double x = x_of(p), y = y_of(p.share);
    struct Place {
      double dx, dy;
    };
    for (const Place place : {Place{0, -1}, Place{0, 1}, Place{1, 0}, Place{-1, 0}, Place{1, -1},
                              Place{-1, -1}, Place{1, 1}, Place{-1, 1}}) {
      const double middle_x = x + place.dx * (gap + width / 2);
      const double middle_y = y + place.dy * (gap + kLabelPx / 2);
      const Box box{middle_x - width / 2, middle_y - kLabelPx / 2, middle_x + width / 2,
                    middle_y + kLabelPx / 2};
      if (box.low_x < left_px_ || box.high_x > left_px_ + kPanelPx || box.high_y > kBottomPx ||
          std::any_of(taken_.begin(), taken_.end(),
                      [&](const Box& other) { return box.overlaps(other); }))
        continue;
      taken_.push_back(box);
      svg_ += svg_text(middle_x, middle_y + 0.35 * kLabelPx, "middle", colour,
                       static_cast<int>(kLabelPx), words);
      return;
    }
  }

  std::vector<PictureMethod> methods_;
  const double left_px_;
  const char* axis_;
  const Cost cost_;
  const Label label_of_;
  double low_ = HUGE_VAL, high_ = -HUGE_VAL, most_ = 0;
  std::vector<Box> taken_;
  std::string svg_;
};

/// What the marks mean, in one line.
std::string legend(const PictureComparison& comparison) {
  std::string svg;
  double x = kFirstPanelPx;
  const double y = kHeightPx - 16;
  const auto entry = [&](const char* fill, const char* stroke, double radius,
                         const std::string& words) {
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\" stroke=\"{}\" "
        "stroke-width=\"2\"/>\n",
        x, y - 4.5, radius, fill, stroke);
    svg += svg_text(x + radius + 9, y, "start", kInkColour, 13, words);
    x += 36 + 7 * static_cast<double>(words.size());
  };
  for (std::size_t m = 0; m < comparison.methods.size(); ++m)
    entry(kMethodColours[m], kMethodColours[m], kMarkPx, comparison.methods[m].name);
  entry("#ffffff", kSoftColour, kMarkPx, "culled some that are visible");
  entry("none", kInkColour, 2 * kMarkPx, "default");
  return svg;
}

}  // namespace

std::string draw_comparison(const PictureComparison& comparison) {
  assert(comparison.methods.size() <= kMethodColours.size());
  std::string svg = svg_begin(kWidthPx, kHeightPx);
  svg += svg_text(kFirstPanelPx - 44, 36, "start", kInkColour, 20, comparison.title);
  double y = 62;
  for (const std::string& note : comparison.notes) {
    svg += svg_text(kFirstPanelPx - 44, y, "start", kSoftColour, 14, note);
    y += 20;
  }
  svg += Panel(
             comparison, kFirstPanelPx, "preparation, seconds",
             [](const PicturePoint& p) { return p.seconds; },
             [](const PicturePoint& p) -> const std::string& { return p.time_label; })
             .draw();
  svg += Panel(
             comparison, kSecondPanelPx, "kept, bytes a triangle",
             [](const PicturePoint& p) { return p.bytes_per_triangle; },
             [](const PicturePoint& p) -> const std::string& { return p.bytes_label; })
             .draw();
  return svg + legend(comparison) + "</svg>\n";
}

}  // namespace scarp
