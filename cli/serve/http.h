#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scarp {

/// A request as it came, within the limits of the server; nothing in it is trusted.
struct HttpRequest {
  std::string method;                                        ///< as sent, such as "GET"
  std::string target;                                        ///< path and query, still encoded
  std::vector<std::pair<std::string, std::string>> headers;  ///< names in small letters
  std::string body;
  std::string
      client;  ///< who asks, for fairness: an address, a connection where that is this machine
  /// Set once the client has closed the connection: nobody waits for the answer.
  std::shared_ptr<std::atomic<bool>> left = std::make_shared<std::atomic<bool>>(false);

  /// The first header of a name (small letters), or empty.
  std::string_view header(std::string_view name) const {
    for (const auto& [own, value] : headers)
      if (own == name) return value;
    return {};
  }
};

/// A part of an open file, as a body.
struct FileBody {
  std::shared_ptr<const int> descriptor;  ///< closed with the last copy
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};

/// An answer. Header names and values hold no line breaks (they are left out).
struct HttpResponse {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  std::shared_ptr<const std::string> body;  ///< null: empty, or the file
  std::shared_ptr<const FileBody> file;
  /// A description of what went wrong, for metrics and logs; empty: nothing.
  std::string note;

  void set(std::string name, std::string value) {
    headers.emplace_back(std::move(name), std::move(value));
  }
};

HttpResponse text_response(int status, std::string content_type, std::string body);

/// Answers a request, once, from any thread. A later answer is ignored.
using Reply = std::function<void(HttpResponse)>;

/// Called on the server's input and output thread: must return at once, and reply then or later.
using HttpHandler = std::function<void(std::shared_ptr<const HttpRequest>, Reply)>;

/// "OK" and the like.
const char* reason_of(int status);

}  // namespace scarp
