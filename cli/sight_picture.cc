#include "cli/sight_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "cli/svg.h"

namespace scarp {
namespace {

constexpr double kWidthPx = 1200, kHeightPx = 600;
constexpr double kLeftPx = 84, kRightPx = 1172, kTopPx = 132, kBottomPx = 516;

constexpr char kGroundFill[] = "#cdbf9f", kGroundStroke[] = "#6f5c3b", kZone[] = "#3b7dd8";

const char* colour_of(Sight sight) {
  return sight == Sight::kVisible ? "#1f8a4c" : sight == Sight::kHidden ? "#c8321f" : "#8a6d1f";
}

class Drawing {
 public:
  explicit Drawing(const PictureProfile& profile) : profile_(profile) {
    far_m_ = profile.line.back().distance_m;
    low_m_ = std::numeric_limits<double>::infinity();
    high_m_ = -low_m_;
    for (const auto& g : profile.ground) include(g.height_m);
    for (const auto& l : profile.line) {
      include(l.height_m - l.fresnel_radius_m);
      include(l.height_m + l.fresnel_radius_m);
    }
    for (const auto& foot : {profile.eye_foot_m, profile.target_foot_m})
      if (foot) include(*foot);
    constexpr double kLeastRangeM = 5;
    const double range_m = std::max(high_m_ - low_m_, kLeastRangeM);
    low_m_ -= 0.08 * range_m;
    high_m_ = low_m_ + 1.2 * range_m;
  }

  std::string draw() {
    svg_ = svg_begin(kWidthPx, kHeightPx);
    axes();
    fresnel_zone();
    ground();
    line();
    end_mark(profile_.line.front(), profile_.eye_foot_m, "eye", true);
    end_mark(profile_.line.back(), profile_.target_foot_m, "target", false);
    blocker();
    text(kLeftPx, 34, "start", kInkColour, 20, profile_.title);
    double y = 58;
    for (const std::string& note : profile_.notes) {
      text(kLeftPx, y, "start", kSoftColour, 14, note);
      y += 20;
    }
    const double exaggeration =
        (far_m_ / (kRightPx - kLeftPx)) / ((high_m_ - low_m_) / (kBottomPx - kTopPx));
    text(kLeftPx, kHeightPx - 14, "start", kSoftColour, 12,
         fmt::format("Heights are as they are above the datum, {:.3g} times exaggerated{}.{}",
                     exaggeration,
                     profile_.flat_earth ? ""
                                         : "; the straight sight line bends as the Earth falls "
                                           "away below it",
                     has_void() ? " Gaps: ground not known." : ""));
    return svg_ + "</svg>\n";
  }

 private:
  bool has_void() const {
    return std::any_of(profile_.ground.begin(), profile_.ground.end(),
                       [](const PictureProfile::Ground& g) { return g.void_before; });
  }
  void include(double height_m) {
    low_m_ = std::min(low_m_, height_m);
    high_m_ = std::max(high_m_, height_m);
  }
  double x_px(double distance_m) const {
    return kLeftPx + (kRightPx - kLeftPx) * distance_m / far_m_;
  }
  double y_px(double height_m) const {
    return kBottomPx - (kBottomPx - kTopPx) * (height_m - low_m_) / (high_m_ - low_m_);
  }
  std::string at(double distance_m, double height_m) const {
    return fmt::format("{:.2f},{:.2f} ", x_px(distance_m), y_px(height_m));
  }

  void text(double x, double y, const char* anchor, const char* colour, int size,
            const std::string& words) {
    svg_ += svg_text(x, y, anchor, colour, size, words);
  }

  void axes() {
    const bool in_km = far_m_ > 3000;
    const double unit_m = in_km ? 1000 : 1;
    const double step = round_step(far_m_ / unit_m, 10);
    for (double d = 0; d * unit_m <= far_m_ * (1 + 1e-9); d += step) {
      const double x = x_px(d * unit_m);
      svg_ += fmt::format("<path d=\"M{0:.1f} {1}V{2}\" stroke=\"{3}\"/>\n", x, kTopPx, kBottomPx,
                          kFaintColour);
      text(x, kBottomPx + 20, "middle", kInkColour, 13, fmt::format("{:.6g}", d));
    }
    text((kLeftPx + kRightPx) / 2, kBottomPx + 42, "middle", kInkColour, 14,
         in_km ? "distance along the ground, km" : "distance along the ground, m");
    const double rise = round_step(high_m_ - low_m_, 7);
    for (double h = std::ceil(low_m_ / rise) * rise; h <= high_m_; h += rise) {
      const double y = y_px(h);
      svg_ += fmt::format("<path d=\"M{0} {1:.1f}H{2}\" stroke=\"{3}\"/>\n", kLeftPx, y, kRightPx,
                          kFaintColour);
      // A zero that is not quite one would print as -0.
      text(kLeftPx - 8, y + 4.5, "end", kInkColour, 13,
           fmt::format("{:.6g}", std::abs(h) < rise / 2 ? 0 : h));
    }
    const double middle = (kTopPx + kBottomPx) / 2;
    svg_ += fmt::format(
        "<text transform=\"translate(22 {:.1f}) rotate(-90)\" text-anchor=\"middle\" "
        "fill=\"{}\">height, m</text>\n",
        middle, kInkColour);
  }

  void ground() {
    const auto& points = profile_.ground;
    for (std::size_t i = 0; i < points.size();) {
      std::size_t end = i + 1;
      while (end < points.size() && !points[end].void_before) ++end;
      std::string top;
      for (std::size_t k = i; k < end; ++k) top += at(points[k].distance_m, points[k].height_m);
      svg_ += fmt::format(
          "<path d=\"M{:.2f},{} L{}L{:.2f},{}Z\" fill=\"{}\"/>\n"
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" "
          "stroke-linejoin=\"round\"/>\n",
          x_px(points[i].distance_m), kBottomPx, top, x_px(points[end - 1].distance_m), kBottomPx,
          kGroundFill, top, kGroundStroke);
      i = end;
    }
    svg_ += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" fill=\"none\" stroke=\"{4}\"/>\n", kLeftPx,
                        kTopPx, kBottomPx, kRightPx, kInkColour);
  }

  void fresnel_zone() {
    if (profile_.line[profile_.line.size() / 2].fresnel_radius_m == 0) return;
    std::string upper;
    for (const auto& l : profile_.line) upper += at(l.distance_m, l.height_m + l.fresnel_radius_m);
    for (auto l = profile_.line.rbegin(); l != profile_.line.rend(); ++l)
      upper += at(l->distance_m, l->height_m - l->fresnel_radius_m);
    svg_ += fmt::format(
        "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"0.16\" stroke=\"{}\" "
        "stroke-opacity=\"0.5\"/>\n",
        upper, kZone, kZone);
  }

  /// The line in full up to what blocks it, dashed behind it.
  void line() {
    const double until_m =
        profile_.blocker ? profile_.blocker->distance_m : std::numeric_limits<double>::infinity();
    std::string clear, beyond;
    if (profile_.blocker) beyond = at(until_m, line_height_m(until_m));
    for (const auto& l : profile_.line)
      (l.distance_m <= until_m ? clear : beyond) += at(l.distance_m, l.height_m);
    if (profile_.blocker) clear += at(until_m, line_height_m(until_m));
    for (const bool dashed : {false, true})
      svg_ += fmt::format(
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>\n",
          dashed ? beyond : clear, colour_of(profile_.sight),
          dashed ? " stroke-dasharray=\"6 5\" stroke-opacity=\"0.7\"" : "");
  }

  double line_height_m(double distance_m) const {
    const auto& line = profile_.line;
    std::size_t i = 1;
    while (i + 1 < line.size() && line[i].distance_m < distance_m) ++i;
    const auto &a = line[i - 1], &b = line[i];
    return a.height_m +
           (b.height_m - a.height_m) * (distance_m - a.distance_m) / (b.distance_m - a.distance_m);
  }

  void end_mark(const PictureProfile::Line& end, const std::optional<double>& foot_m,
                const char* label, bool at_left) {
    const double x = x_px(end.distance_m), y = y_px(end.height_m);
    if (foot_m)
      svg_ += fmt::format("<path d=\"M{:.2f} {:.2f}V{:.2f}\" stroke=\"{}\" stroke-width=\"2\"/>\n",
                          x, y_px(*foot_m), y, kInkColour);
    svg_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"4.5\" fill=\"{}\"/>\n", x, y,
                        kInkColour);
    text(at_left ? x + 8 : x - 8, y - 9, at_left ? "start" : "end", kInkColour, 14, label);
  }

  void blocker() {
    if (!profile_.blocker) return;
    const double x = x_px(profile_.blocker->distance_m), y = y_px(profile_.blocker->height_m);
    svg_ += fmt::format(
        "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"7\" fill=\"none\" stroke=\"{}\" "
        "stroke-width=\"2.5\"/>\n",
        x, y, colour_of(Sight::kHidden));
    const double label_y = kTopPx - 14;
    svg_ += fmt::format(
        "<path d=\"M{0:.2f} {1:.2f}V{2:.2f}\" stroke=\"{3}\" stroke-dasharray=\"2 3\"/>\n", x,
        y - 8, label_y + 5, colour_of(Sight::kHidden));
    const char* anchor = x < kLeftPx + 200 ? "start" : x > kRightPx - 200 ? "end" : "middle";
    text(x, label_y, anchor, colour_of(Sight::kHidden), 14, profile_.blocker->label);
  }

  const PictureProfile& profile_;
  double far_m_ = 0, low_m_ = 0, high_m_ = 0;
  std::string svg_;
};

}  // namespace

std::string draw_profile(const PictureProfile& profile) {
  assert(profile.line.size() >= 2);
  return Drawing(profile).draw();
}

}  // namespace scarp
