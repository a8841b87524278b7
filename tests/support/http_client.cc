#include "tests/support/http_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cctype>
#include <cstdlib>
#include <stdexcept>

namespace scarp::test {

HttpConnection::HttpConnection(std::uint16_t port, int patience_s)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{patience_s, 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  const int yes = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("cannot connect to the server");
}

HttpConnection::~HttpConnection() {
  close();
}

void HttpConnection::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

bool HttpConnection::send(const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t more = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (more <= 0) return false;
    sent += static_cast<std::size_t>(more);
  }
  return true;
}

bool HttpConnection::read_more() {
  char bytes[65536];
  const ssize_t got = ::recv(socket_, bytes, sizeof bytes, 0);
  if (got <= 0) return false;
  unread_.append(bytes, static_cast<std::size_t>(got));
  return true;
}

HttpAnswer HttpConnection::receive(bool head_only) {
  HttpAnswer answer;
  std::size_t end;
  while ((end = unread_.find("\r\n\r\n")) == std::string::npos)
    if (!read_more()) return answer;
  const std::string head = unread_.substr(0, end + 2);
  unread_.erase(0, end + 4);
  answer.status = std::atoi(head.c_str() + head.find(' '));
  for (std::size_t begin = head.find("\r\n") + 2; begin < head.size();) {
    const std::size_t line_end = head.find("\r\n", begin);
    const std::size_t colon = head.find(": ", begin);
    std::string name = head.substr(begin, colon - begin);
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    answer.headers[name] = head.substr(colon + 2, line_end - colon - 2);
    begin = line_end + 2;
  }
  const std::size_t bytes =
      answer.headers.contains("content-length") && !head_only
          ? static_cast<std::size_t>(std::atoll(answer.headers["content-length"].c_str()))
          : 0;
  while (unread_.size() < bytes)
    if (!read_more()) return {};
  answer.body = unread_.substr(0, bytes);
  unread_.erase(0, bytes);
  return answer;
}

bool HttpConnection::is_closed() {
  char byte;
  return unread_.empty() && ::recv(socket_, &byte, 1, 0) == 0;
}

HttpAnswer HttpConnection::get(const std::string& target, const std::string& headers) {
  if (!send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n")) return {};
  return receive();
}

HttpAnswer HttpConnection::post(const std::string& target, const std::string& body,
                                const std::string& headers) {
  if (!send("POST " + target +
            " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" + headers +
            "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body))
    return {};
  return receive();
}

}  // namespace scarp::test
