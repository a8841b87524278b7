#include "cli/compare/compared_job.h"

#include <algorithm>
#include <cassert>

#include "cli/stopwatch.h"

namespace scarp {

Timed median_of(std::vector<double> seconds) {
  assert(!seconds.empty());
  std::sort(seconds.begin(), seconds.end());
  return {seconds[seconds.size() / 2], seconds.front(), seconds.back()};
}

Timed timed(int runs, const std::function<void()>& run) {
  std::vector<double> seconds;
  for (int i = 0; i < runs; ++i) {
    const Stopwatch watch;
    run();
    seconds.push_back(watch.seconds());
  }
  return median_of(std::move(seconds));
}

void add_time(ComparedPoint& point, const Timed& time) {
  point.figures["seconds"] = time.median_s;
  point.figures["seconds_least"] = time.least_s;
  point.figures["seconds_most"] = time.most_s;
}

std::vector<bool> pareto_front(const std::vector<ComparedPoint>& points, const std::string& x,
                               const std::string& y) {
  const auto has_both = [&](const ComparedPoint& p) {
    return !p.is_judge && !p.is_unsafe && p.figures.contains(x) && p.figures.contains(y);
  };
  std::vector<bool> on_front(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!has_both(points[i])) continue;
    const double own_x = points[i].figures.at(x), own_y = points[i].figures.at(y);
    on_front[i] = std::none_of(points.begin(), points.end(), [&](const ComparedPoint& p) {
      if (!has_both(p)) return false;
      const double other_x = p.figures.at(x), other_y = p.figures.at(y);
      return other_x <= own_x && other_y <= own_y && (other_x < own_x || other_y < own_y);
    });
  }
  return on_front;
}

}  // namespace scarp
