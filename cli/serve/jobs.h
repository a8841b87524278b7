#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/serve/http.h"

namespace scarp {

/// Work that a client does not wait for. From any thread.
class Job {
 public:
  enum class Status { kAccepted, kRunning, kSuccessful, kFailed, kDismissed };

  Job(std::string id, std::string process);

  const std::string& id() const { return id_; }
  void start();
  void progress(double done) { done_percent_ = static_cast<int>(done * 100); }
  /// Nothing after a dismissal.
  void finish(HttpResponse result);
  void fail(HttpResponse why);
  /// @return false where it is over already
  bool dismiss();
  bool is_dismissed() const { return dismissed_; }
  bool is_over() const;

  Status status() const;
  /// The result, or why it failed; nothing before it is over.
  std::optional<HttpResponse> result() const;
  std::size_t result_bytes() const;
  /// statusInfo of OGC API - Processes.
  nlohmann::json status_info(const std::string& origin) const;

 private:
  using Clock = std::chrono::system_clock;

  const std::string id_, process_;
  mutable std::mutex mutex_;
  Status status_ = Status::kAccepted;
  Clock::time_point created_ = Clock::now(), updated_ = created_;
  std::optional<Clock::time_point> started_, finished_;
  std::string message_;
  std::optional<HttpResponse> result_;
  std::atomic<int> done_percent_{0};
  std::atomic<bool> dismissed_{false};
};

/// All jobs by their ids, which nobody can guess. Those that are over are forgotten, the oldest
/// first, when there are too many of them or their results take too much.
class Jobs {
 public:
  Jobs(std::size_t most, std::size_t most_under_way, std::size_t most_bytes)
      : most_(most), most_under_way_(most_under_way), most_bytes_(most_bytes) {}

  /// Null where too many are under way.
  std::shared_ptr<Job> add(const std::string& process);
  /// Throws Refusal{404}, of the standard's type.
  std::shared_ptr<Job> require(const std::string& id) const;
  void remove(const std::string& id);
  /// Newest first.
  std::vector<std::shared_ptr<Job>> all() const;

 private:
  void forget_old();

  const std::size_t most_, most_under_way_, most_bytes_;
  mutable std::mutex mutex_;
  std::deque<std::shared_ptr<Job>> jobs_;  // the oldest first
};

}  // namespace scarp
