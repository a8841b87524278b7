#pragma once

#include <string>

#include "cli/serve/http.h"
#include "core/error/error.h"

namespace scarp {

/// Types of problems that OGC API - Processes names; others are "about:blank", whose title is the
/// status's own.
inline constexpr char kNoSuchProcess[] =
    "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-process";
inline constexpr char kNoSuchJob[] =
    "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-job";
inline constexpr char kResultNotReady[] =
    "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/result-not-ready";

/// An error with the status that a client is told. Caught once per request.
class Refusal : public Error {
 public:
  Refusal(int status, const std::string& detail, std::string type = "about:blank")
      : Error(ErrorCode::kInput, detail), status_(status), type_(std::move(type)) {}

  int status() const { return status_; }
  const std::string& type() const { return type_; }

 private:
  int status_;
  std::string type_;
};

/// application/problem+json (RFC 7807).
HttpResponse problem(int status, const std::string& detail,
                     const std::string& type = "about:blank");

/// The answer to a request whose work threw: a Refusal as it says, what the user gave 400, a scene
/// that is damaged and all else 500.
HttpResponse problem_of(const std::exception& error);

}  // namespace scarp
