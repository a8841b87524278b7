#include "cli/serve/metrics.h"

#include <fmt/format.h>

namespace scarp {

void Metrics::count(const std::string& route, int status, double seconds) {
  const std::scoped_lock lock(mutex_);
  ++answers_[{route, status}];
  Times& times = times_[route];
  std::size_t i = 0;
  while (i < kBounds_s.size() && seconds > kBounds_s[i]) ++i;
  ++times.counts[i];
  times.sum_s += seconds;
}

std::string Metrics::line(const std::string& name, const char* type, const char* help,
                          double value) {
  return fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n{0} {3:.17g}\n", name, help, type, value);
}

std::string Metrics::text() const {
  const std::scoped_lock lock(mutex_);
  std::string text =
      "# HELP scarp_answers_total Answers by route and status.\n# TYPE scarp_answers_total "
      "counter\n";
  for (const auto& [key, count] : answers_)
    text += fmt::format("scarp_answers_total{{route=\"{}\",status=\"{}\"}} {}\n", key.first,
                        key.second, count);
  text +=
      "# HELP scarp_answer_seconds From the whole request to the answer.\n"
      "# TYPE scarp_answer_seconds histogram\n";
  for (const auto& [route, times] : times_) {
    std::uint64_t so_far = 0;
    for (std::size_t i = 0; i <= kBounds_s.size(); ++i) {
      so_far += times.counts[i];
      const std::string bound = i < kBounds_s.size() ? fmt::format("{:g}", kBounds_s[i]) : "+Inf";
      text += fmt::format("scarp_answer_seconds_bucket{{route=\"{}\",le=\"{}\"}} {}\n", route,
                          bound, so_far);
    }
    text += fmt::format("scarp_answer_seconds_sum{{route=\"{}\"}} {:.6f}\n", route, times.sum_s);
    text += fmt::format("scarp_answer_seconds_count{{route=\"{}\"}} {}\n", route, so_far);
  }
  return text;
}

}  // namespace scarp
