#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace scarp {

/// Counts of answers and how long they took, as Prometheus reads them. From any thread.
class Metrics {
 public:
  /// @param route  an operationId; a bounded set
  void count(const std::string& route, int status, double seconds);
  std::string text() const;

  /// One number with its name and help, in the same form.
  static std::string line(const std::string& name, const char* type, const char* help,
                          double value);

 private:
  static constexpr std::array<double, 9> kBounds_s = {0.005, 0.02, 0.05, 0.1, 0.15, 0.3, 1, 5, 30};
  struct Times {
    std::array<std::uint64_t, kBounds_s.size() + 1> counts{};
    double sum_s = 0;
  };

  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, std::uint64_t> answers_;
  std::map<std::string, Times> times_;
};

}  // namespace scarp
