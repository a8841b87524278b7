#include "cli/serve/jobs.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "cli/serve/problem.h"
#include "core/error/error.h"

namespace scarp {
namespace {

std::string random_id() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw Error(ErrorCode::kResource, "the system gives no random numbers");
  std::string id;
  for (const unsigned char byte : bytes) id += fmt::format("{:02x}", byte);
  return id;
}

std::string moment(std::chrono::system_clock::time_point at) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}Z",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(at)));
}

const char* name_of(Job::Status status) {
  switch (status) {
    case Job::Status::kAccepted:
      return "accepted";
    case Job::Status::kRunning:
      return "running";
    case Job::Status::kSuccessful:
      return "successful";
    case Job::Status::kFailed:
      return "failed";
    default:
      return "dismissed";
  }
}

}  // namespace

Job::Job(std::string id, std::string process) : id_(std::move(id)), process_(std::move(process)) {}

void Job::start() {
  const std::scoped_lock lock(mutex_);
  if (status_ != Status::kAccepted) return;
  status_ = Status::kRunning;
  started_ = updated_ = Clock::now();
}

void Job::finish(HttpResponse result) {
  const std::scoped_lock lock(mutex_);
  if (status_ != Status::kRunning) return;
  status_ = Status::kSuccessful;
  finished_ = updated_ = Clock::now();
  done_percent_ = 100;
  result_ = std::move(result);
}

void Job::fail(HttpResponse why) {
  const std::scoped_lock lock(mutex_);
  if (status_ != Status::kRunning && status_ != Status::kAccepted) return;
  status_ = Status::kFailed;
  finished_ = updated_ = Clock::now();
  message_ = why.note;
  result_ = std::move(why);
}

bool Job::dismiss() {
  const std::scoped_lock lock(mutex_);
  if (status_ != Status::kRunning && status_ != Status::kAccepted) return false;
  status_ = Status::kDismissed;
  finished_ = updated_ = Clock::now();
  dismissed_ = true;
  return true;
}

Job::Status Job::status() const {
  const std::scoped_lock lock(mutex_);
  return status_;
}

bool Job::is_over() const {
  const Status now = status();
  return now != Status::kAccepted && now != Status::kRunning;
}

std::optional<HttpResponse> Job::result() const {
  const std::scoped_lock lock(mutex_);
  return result_;
}

std::size_t Job::result_bytes() const {
  const std::scoped_lock lock(mutex_);
  return result_ && result_->body ? result_->body->size() : 0;
}

nlohmann::json Job::status_info(const std::string& origin) const {
  const std::scoped_lock lock(mutex_);
  const std::string own = origin + "/jobs/" + id_;
  nlohmann::json info = {
      {"processID", process_},
      {"type", "process"},
      {"jobID", id_},
      // What the draft of the standard's second version calls them.
      {"id", id_},
      {"processingEntityType", "ogc-api-processes"},
      {"status", name_of(status_)},
      {"created", moment(created_)},
      {"updated", moment(updated_)},
      {"progress", std::clamp(done_percent_.load(), 0, 100)},
      {"links", {{{"rel", "self"}, {"type", "application/json"}, {"href", own}}}}};
  if (!message_.empty()) info["message"] = message_;
  if (started_) info["started"] = moment(*started_);
  if (finished_) info["finished"] = moment(*finished_);
  if (status_ == Status::kSuccessful)
    info["links"].push_back({{"rel", "http://www.opengis.net/def/rel/ogc/1.0/results"},
                             {"type", "application/json"},
                             {"href", own + "/results"}});
  return info;
}

std::shared_ptr<Job> Jobs::add(const std::string& process) {
  const std::scoped_lock lock(mutex_);
  const auto under_way =
      std::count_if(jobs_.begin(), jobs_.end(), [](const auto& job) { return !job->is_over(); });
  if (static_cast<std::size_t>(under_way) >= most_under_way_) return {};
  forget_old();
  return jobs_.emplace_back(std::make_shared<Job>(random_id(), process));
}

std::shared_ptr<Job> Jobs::require(const std::string& id) const {
  const std::scoped_lock lock(mutex_);
  for (const auto& job : jobs_)
    if (job->id() == id) return job;
  throw Refusal(404,
                fmt::format("job '{}': is not known; it may have been dismissed, or forgotten", id),
                kNoSuchJob);
}

void Jobs::remove(const std::string& id) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(jobs_, [&](const auto& job) { return job->id() == id; });
}

std::vector<std::shared_ptr<Job>> Jobs::all() const {
  const std::scoped_lock lock(mutex_);
  return {jobs_.rbegin(), jobs_.rend()};
}

void Jobs::forget_old() {
  std::size_t bytes = 0;
  for (const auto& job : jobs_) bytes += job->result_bytes();
  for (auto job = jobs_.begin(); job != jobs_.end();) {
    const bool too_many = jobs_.size() >= most_ || bytes > most_bytes_;
    if (too_many && (*job)->is_over()) {
      bytes -= (*job)->result_bytes();
      job = jobs_.erase(job);
    } else {
      ++job;
    }
  }
}

}  // namespace scarp
