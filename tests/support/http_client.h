#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace scarp::test {

/// An answer as it came; status 0 where the connection was closed without one.
struct HttpAnswer {
  int status = 0;
  std::map<std::string, std::string> headers;  ///< names in small letters
  std::string body;
};

/// A plain connection to a server of this machine, to send it anything. Blocking; gives up after
/// some seconds.
class HttpConnection {
 public:
  explicit HttpConnection(std::uint16_t port, int patience_s = 20);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  /// @return false where the server has closed the connection
  bool send(const std::string& bytes);
  /// The next answer. @param head_only  it has no body though it tells a length
  HttpAnswer receive(bool head_only = false);
  /// Whether the server closes the connection before it sends anything more.
  bool is_closed();
  /// Closes it as a client that goes away.
  void close();

  /// A whole request and its answer. @param headers  lines that end in "\r\n"
  HttpAnswer get(const std::string& target, const std::string& headers = "");
  HttpAnswer post(const std::string& target, const std::string& body,
                  const std::string& headers = "");

 private:
  bool read_more();

  int socket_ = -1;
  std::string unread_;
};

}  // namespace scarp::test
