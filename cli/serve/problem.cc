#include "cli/serve/problem.h"

#include <nlohmann/json.hpp>

namespace scarp {
namespace {

/// Text that is safe in JSON whatever was in the request.
std::string dumped(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string title_of(int status, const std::string& type) {
  if (type == kNoSuchProcess) return "No such process";
  if (type == kNoSuchJob) return "No such job";
  if (type == kResultNotReady) return "Result not ready";
  return reason_of(status);
}

}  // namespace

HttpResponse problem(int status, const std::string& detail, const std::string& type) {
  HttpResponse response = text_response(status, "application/problem+json",
                                        dumped({{"type", type},
                                                {"title", title_of(status, type)},
                                                {"status", status},
                                                {"detail", detail}}) +
                                            "\n");
  response.set("Cache-Control", "no-store");
  if (status == 429 || status == 503) response.set("Retry-After", "1");
  response.note = detail;
  return response;
}

HttpResponse problem_of(const std::exception& error) {
  if (const auto* refusal = dynamic_cast<const Refusal*>(&error))
    return problem(refusal->status(), refusal->what(), refusal->type());
  if (const auto* own = dynamic_cast<const Error*>(&error)) {
    switch (own->code()) {
      case ErrorCode::kInput:
      case ErrorCode::kUsage:
        return problem(400, own->what());
      case ErrorCode::kResource:
        return problem(507, own->what());
      default:
        return problem(500, own->what());
    }
  }
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return problem(507, "out of memory; ask for a smaller distance, or for fewer observers");
  return problem(500, std::string("unexpected failure: ") + error.what());
}

}  // namespace scarp
