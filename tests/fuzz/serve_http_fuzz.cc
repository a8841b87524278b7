#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "cli/serve/http_server.h"
#include "tests/fuzz/fuzz_target.h"

/// What a connection sends: any bytes, broken off anywhere, get answers or a clean close, and the
/// server goes on.
namespace {

using namespace scarp;

/// A server whose handler gives back the body, until the program ends.
class Served {
 public:
  Served()
      : server_("127.0.0.1", 0, limits(),
                [](std::shared_ptr<const HttpRequest> request, const Reply& reply) {
                  reply(text_response(200, "text/plain", request->body));
                }),
        thread_([this] { server_.run(); }) {}
  ~Served() {
    server_.stop(std::chrono::seconds(1));
    thread_.join();
  }
  std::uint16_t port() const { return server_.port(); }

 private:
  static HttpLimits limits() {
    HttpLimits limits;
    limits.header_bytes = 4096;
    limits.body_bytes = 8192;
    return limits;
  }
  HttpServer server_;
  std::thread thread_;
};

/// All that the server sends until it closes. Throws where it does neither for long.
std::string talk(std::uint16_t port, const std::uint8_t* data, std::size_t size) {
  const int client = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{10, 0};
  ::setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string answer;
  ssize_t got = ::connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  if (got == 0 && size > 0) got = ::send(client, data, size, MSG_NOSIGNAL);
  // Who closes its half before the answer has left; what is whole is answered before this is over.
  constexpr int kWaitMs = 1;
  pollfd answered{client, POLLIN, 0};
  ::poll(&answered, 1, kWaitMs);
  ::shutdown(client, SHUT_WR);
  char bytes[4096];
  while ((got = ::recv(client, bytes, sizeof bytes, 0)) > 0)
    answer.append(bytes, static_cast<std::size_t>(got));
  const bool waits_in_vain = got < 0 && errno == EAGAIN;
  ::close(client);
  if (waits_in_vain) throw std::logic_error("neither an answer nor a close");
  return answer;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Served server;
  const std::string answer = talk(server.port(), data, size);
  if (!answer.empty() && !answer.starts_with("HTTP/1.1 "))
    throw std::logic_error("an answer that is none: " + answer.substr(0, 80));
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  std::vector<std::vector<std::uint8_t>> seeds;
  for (const std::string text :
       {"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
        "POST /a HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhelloGET /b "
        "HTTP/1.1\r\n\r\n",
        "POST /a HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n",
        "POST /a HTTP/1.1\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n{}",
        "HEAD / HTTP/1.0\r\nConnection: keep-alive\r\n\r\n", "GET / HTTP/1.1\r\nX: \r\n y\r\n\r\n"})
    seeds.emplace_back(text.begin(), text.end());
  return seeds;
}
