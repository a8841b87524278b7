#include "cli/compare/job_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>

#include "cli/svg.h"

namespace scarp {
namespace {

constexpr double kWidthPx = 900, kLegendPx = 590, kLeftPx = 96, kRightPx = 872;
constexpr double kBottomPx = 520, kZeroPx = 500;  // zero lies this low, under the decades
constexpr double kMarkPx = 5, kLabelPx = 12, kLinePx = 20;
constexpr std::array<const char*, 8> kColours = {"#2566b0", "#c46a1b", "#1f8a4c", "#9457b8",
                                                 "#b02050", "#00707a", "#7f6a1f", "#50586a"};

struct Box {
  double low_x, low_y, high_x, high_y;

  bool overlaps(const Box& other) const {
    return low_x < other.high_x && other.low_x < high_x && low_y < other.high_y &&
           other.low_y < high_y;
  }
};

/// A mark of an axis: 200, 0.01, 5·10⁷.
std::string number(double value) {
  constexpr std::array<const char*, 10> kRaised = {"\u2070", "\u00b9", "\u00b2", "\u00b3",
                                                   "\u2074", "\u2075", "\u2076", "\u2077",
                                                   "\u2078", "\u2079"};
  const int power = static_cast<int>(std::floor(std::log10(value) + 1e-9));
  if (value == 0 || (power >= -3 && power <= 4)) return fmt::format("{:g}", value);
  std::string words;
  const double factor = std::round(value / std::pow(10, power));
  if (factor != 1) words = fmt::format("{:g}\u00b7", factor);
  words += "10";
  if (power < 0) words += "\u207b";
  for (const char digit : std::to_string(std::abs(power)))
    words += kRaised[static_cast<std::size_t>(digit - '0')];
  return words;
}

/// An axis by powers of ten, or in even steps from zero.
struct Axis {
  bool is_linear = false;
  double low = HUGE_VAL, high = -HUGE_VAL;  // log10 of values, or values

  bool is_empty() const { return low > high; }
  void take(double value) {
    const double at = is_linear ? value : std::log10(value);
    low = std::min(low, at);
    high = std::max(high, at);
  }
  /// Leaves room around what was taken.
  void widen() {
    if (is_empty()) return;
    if (is_linear) {
      low = 0, high = high > 0 ? 1.08 * high : 1;
      return;
    }
    const double middle = (low + high) / 2, half = 0.6 * std::max(high - low, 0.6);
    low = middle - half, high = middle + half;
  }
  double place(double value) const {
    return ((is_linear ? value : std::log10(value)) - low) / (high - low);
  }
  std::vector<double> marks() const {
    std::vector<double> result;
    if (is_empty()) return result;
    if (is_linear) {
      const double step = round_step(high, 8);
      for (int i = 0; i * step <= high; ++i) result.push_back(i * step);
      return result;
    }
    static const std::vector<double> kFine = {1, 1.5, 2, 3, 4, 5, 7}, kUsual = {1, 2, 5},
                                     kCoarse = {1};
    const std::vector<double>& factors = high - low < 1.3 ? kFine
                                         : high - low < 3 ? kUsual
                                                          : kCoarse;
    for (int power = static_cast<int>(std::floor(low)); power <= high; ++power)
      for (const double factor : factors) {
        const double value = factor * std::pow(10, power);
        if (std::log10(value) >= low && std::log10(value) <= high) result.push_back(value);
      }
    return result;
  }
};

/// The marks of methods: as many colours, then as many in another shape.
std::string shape(std::size_t method, double x, double y, double radius, const char* fill,
                  const char* stroke) {
  if (method < kColours.size())
    return fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\" stroke=\"{}\" "
        "stroke-width=\"2\"/>\n",
        x, y, radius, fill, stroke);
  return fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"{}\" fill=\"{}\" stroke=\"{}\" "
      "stroke-width=\"2\"/>\n",
      x - radius, y - radius, 2 * radius, 2 * radius, fill, stroke);
}

class Drawing {
 public:
  Drawing(const ComparedJob& job, const ComparedChart& chart) : job_(job), chart_(chart) {
    y_.is_linear = chart.is_y_linear;
    for (const ComparedPoint& p : job.points) {
      if (std::find(methods_.begin(), methods_.end(), p.method) == methods_.end())
        methods_.push_back(p.method);
      if (!is_drawn(p)) continue;
      x_.take(x_of(p));
      if (const auto spread = spread_of(p)) x_.take(spread->first), x_.take(spread->second);
      if (y_of(p) > 0 || y_.is_linear)
        y_.take(y_of(p));
      else
        has_zero_ = true;
    }
    x_.widen();
    y_.widen();
    top_px_ = 84 + kLinePx * static_cast<double>(job.notes.size());
  }

  std::string draw() {
    svg_ += svg_text(40, 36, "start", kInkColour, 20, job_.title);
    double y_px = 60;
    for (const std::string& note : job_.notes) {
      svg_ += svg_text(40, y_px, "start", kSoftColour, 13, note);
      y_px += kLinePx;
    }
    axes();
    line();
    for (const ComparedPoint& p : job_.points)
      if (is_drawn(p)) mark(p);
    // Defaults first: where it is crowded, others go without.
    for (const bool is_default : {true, false})
      for (const ComparedPoint& p : job_.points)
        if (is_drawn(p) && p.is_default == is_default) label(p);
    const double height_px = legend();
    return svg_begin(kWidthPx, height_px) + svg_ + "</svg>\n";
  }

 private:
  bool is_drawn(const ComparedPoint& p) const {
    const auto x = p.figures.find(chart_.x), y = p.figures.find(chart_.y);
    return x != p.figures.end() && y != p.figures.end() && x->second > 0 &&
           std::isfinite(x->second) && std::isfinite(y->second);
  }
  double x_of(const ComparedPoint& p) const { return p.figures.at(chart_.x); }
  double y_of(const ComparedPoint& p) const { return p.figures.at(chart_.y); }
  double x_px(double x) const { return kLeftPx + (kRightPx - kLeftPx) * x_.place(x); }
  /// Least and most of the runs, where they are known.
  std::optional<std::pair<double, double>> spread_of(const ComparedPoint& p) const {
    const auto least = p.figures.find(chart_.x + "_least");
    const auto most = p.figures.find(chart_.x + "_most");
    if (least == p.figures.end() || most == p.figures.end() || !(least->second > 0)) return {};
    return std::pair(least->second, most->second);
  }
  double floor_px() const { return has_zero_ ? kZeroPx - 30 : kBottomPx; }
  double y_px(double y) const {
    return has_zero_ && y <= 0 ? kZeroPx : floor_px() - (floor_px() - top_px_) * y_.place(y);
  }
  std::size_t number_of(const std::string& method) const {
    return static_cast<std::size_t>(std::find(methods_.begin(), methods_.end(), method) -
                                    methods_.begin());
  }
  const char* colour_of(const std::string& method) const {
    return kColours[number_of(method) % kColours.size()];
  }

  void axes() {
    for (const double x : x_.marks()) {
      svg_ += fmt::format("<path d=\"M{0:.1f} {1}V{2}\" stroke=\"{3}\"/>\n", x_px(x), top_px_,
                          kBottomPx, kFaintColour);
      svg_ += svg_text(x_px(x), kBottomPx + 20, "middle", kInkColour, 13, number(x));
    }
    const auto across = [&](double at_px, const std::string& words) {
      svg_ += fmt::format("<path d=\"M{} {:.1f}H{}\" stroke=\"{}\"/>\n", kLeftPx, at_px, kRightPx,
                          kFaintColour);
      svg_ += svg_text(kLeftPx - 8, at_px + 4.5, "end", kInkColour, 13, words);
    };
    for (const double y : y_.marks()) across(y_px(y), number(y));
    if (has_zero_) across(kZeroPx, "0");
    svg_ += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" fill=\"none\" stroke=\"{4}\"/>\n", kLeftPx,
                        top_px_, kBottomPx, kRightPx, kInkColour);
    svg_ += svg_text((kLeftPx + kRightPx) / 2, kBottomPx + 44, "middle", kInkColour, 14,
                     chart_.x_words);
    svg_ += svg_text(40, top_px_ - 12, "start", kInkColour, 14, chart_.y_words);
  }

  /// The front, from its slowest point down, or the points of one method.
  void line() {
    const std::vector<bool> on_front = pareto_front(job_.points, chart_.x, chart_.y);
    std::vector<const ComparedPoint*> joined;
    for (std::size_t i = 0; i < job_.points.size(); ++i) {
      const ComparedPoint& p = job_.points[i];
      const bool is_joined = chart_.joined.empty() ? on_front[i] : p.method == chart_.joined;
      if (is_joined && is_drawn(p)) joined.push_back(&p);
    }
    std::sort(joined.begin(), joined.end(), [&](const ComparedPoint* a, const ComparedPoint* b) {
      return std::pair(x_of(*a), -y_of(*a)) < std::pair(x_of(*b), -y_of(*b));
    });
    std::string path;
    for (std::size_t i = 0; i < joined.size(); ++i) {
      const double x = x_px(x_of(*joined[i])), y = y_px(y_of(*joined[i]));
      // What lies between two points of a front is no better than the faster of the two.
      path += i == 0                  ? fmt::format("M{:.1f} {:.1f}", x, y)
              : chart_.joined.empty() ? fmt::format("H{:.1f}V{:.1f}", x, y)
                                      : fmt::format("L{:.1f} {:.1f}", x, y);
    }
    if (path.empty()) return;
    svg_ += fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" "
        "stroke-opacity=\"0.6\"/>\n",
        path, chart_.joined.empty() ? kSoftColour : colour_of(chart_.joined));
  }

  void mark(const ComparedPoint& p) {
    const double x = x_px(x_of(p)), y = y_px(y_of(p));
    const char* colour = colour_of(p.method);
    if (const auto spread = spread_of(p))
      svg_ += fmt::format(
          "<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"{}\" stroke-width=\"2\" "
          "stroke-opacity=\"0.5\"/>\n",
          x_px(spread->first), y, x_px(spread->second), colour);
    if (p.is_judge)
      svg_ += fmt::format("<path d=\"M{:.1f} {:.1f}l7 7l-7 7l-7-7z\" fill=\"{}\"/>\n", x, y - 7,
                          colour);
    else
      svg_ += shape(number_of(p.method), x, y, kMarkPx, p.is_unsafe ? "#ffffff" : colour, colour);
    if (p.is_default)
      svg_ += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"none\" stroke=\"{}\" "
          "stroke-width=\"1.5\"/>\n",
          x, y, 2 * kMarkPx, kInkColour);
    taken_.push_back({x - kMarkPx, y - kMarkPx, x + kMarkPx, y + kMarkPx});
  }

  /// Beside its mark where nothing is in the way, or nowhere.
  void label(const ComparedPoint& p) {
    const double width = 0.56 * kLabelPx * static_cast<double>(p.setting.size());
    const double gap = (p.is_default ? 2 : 1) * kMarkPx + 3;
    const double x = x_px(x_of(p)), y = y_px(y_of(p));
    struct Place {
      double dx, dy;
    };
    for (const Place place :
         {Place{0, -1}, Place{0, 1}, Place{1, 0}, Place{-1, 0}, Place{1, -1}, Place{-1, -1},
          Place{1, 1}, Place{-1, 1}, Place{-0.6, -1.2}, Place{-0.6, 1.2}, Place{0.6, -1.2},
          Place{0.6, 1.2}, Place{0.3, -2.4}, Place{0.3, -3.6}}) {
      const double middle_x = x + place.dx * (gap + width / 2);
      const double middle_y = y + place.dy * (gap + kLabelPx / 2);
      const Box box{middle_x - width / 2, middle_y - kLabelPx / 2, middle_x + width / 2,
                    middle_y + kLabelPx / 2};
      if (box.low_x < kLeftPx || box.high_x > kRightPx || box.high_y > kBottomPx + 4 ||
          std::any_of(taken_.begin(), taken_.end(),
                      [&](const Box& other) { return box.overlaps(other); }))
        continue;
      taken_.push_back(box);
      svg_ += svg_text(middle_x, middle_y + 0.35 * kLabelPx, "middle", colour_of(p.method),
                       static_cast<int>(kLabelPx), p.setting);
      return;
    }
  }

  /// @return how high the picture is with it
  double legend() {
    double x = kLeftPx - 40, y = kLegendPx;
    const auto entry = [&](const std::string& mark, const std::string& words) {
      const double width = 34 + 7.6 * static_cast<double>(words.size());
      if (x + width > kWidthPx - 10) x = kLeftPx - 40, y += 20;
      svg_ += fmt::format("<g transform=\"translate({:.1f} {:.1f})\">{}</g>\n", x, y - 4.5, mark);
      svg_ += svg_text(x + 15, y, "start", kInkColour, 13, words);
      x += width;
    };
    const auto any = [&](auto&& is) {
      return std::any_of(job_.points.begin(), job_.points.end(),
                         [&](const ComparedPoint& p) { return is_drawn(p) && is(p); });
    };
    // Where settings are named like their methods, the marks' own labels say all.
    const bool are_named =
        any([](const ComparedPoint& p) { return !p.is_judge && p.setting != p.method; });
    for (const std::string& method : methods_)
      if (are_named && any([&](const ComparedPoint& p) { return p.method == method; }))
        entry(shape(number_of(method), 0, 0, kMarkPx, colour_of(method), colour_of(method)),
              method);
    if (any([](const ComparedPoint& p) { return p.is_unsafe; }))
      entry(shape(0, 0, 0, kMarkPx, "#ffffff", kSoftColour), "culls some that are visible");
    if (any([](const ComparedPoint& p) { return p.is_default; }))
      entry(shape(0, 0, 0, 2 * kMarkPx, "none", kInkColour), "default");
    if (any([](const ComparedPoint& p) { return p.is_judge; }))
      entry(fmt::format("<path d=\"M0-7l7 7l-7 7l-7-7z\" fill=\"{}\"/>", kSoftColour),
            "judge: by it errors are measured");
    return y + 30;
  }

  const ComparedJob& job_;
  const ComparedChart& chart_;
  std::vector<std::string> methods_;
  Axis x_, y_;
  bool has_zero_ = false;
  double top_px_ = 0;
  std::vector<Box> taken_;
  std::string svg_;
};

}  // namespace

std::string draw_chart(const ComparedJob& job, const ComparedChart& chart) {
  return Drawing(job, chart).draw();
}

}  // namespace scarp
