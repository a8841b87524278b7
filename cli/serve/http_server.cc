// Boost 1.74 uses std::exchange in its coroutines without including it.
#include <utility>
// Order matters.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cctype>
#include <list>
#include <optional>
#include <set>

#include "cli/serve/http_server.h"
#include "cli/serve/problem.h"
#include "core/error/error.h"

namespace scarp {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;
using Milliseconds = std::chrono::milliseconds;
using Parser = http::request_parser<http::string_body>;

/// One connection: what its coroutine and the handlers beside it share. All on one thread.
struct Session {
  Session(tcp::socket from, std::string address)
      : socket(std::move(from)), client(std::move(address)), deadline(socket.get_executor()) {}

  tcp::socket socket;
  std::string client;
  boost::beast::flat_buffer buffer;
  asio::steady_timer deadline;
  std::uint64_t deadline_number = 0;
  bool timed_out = false;
  bool is_idle = true;
};
using SessionPtr = std::shared_ptr<Session>;

void expire(const SessionPtr& session, std::uint64_t number) {
  session->deadline.async_wait([session, number](error_code failure) {
    if (failure || number != session->deadline_number) return;
    session->timed_out = true;
    error_code ignored;
    session->socket.cancel(ignored);
    // A reading that was between two pieces just now began another one.
    session->deadline.expires_after(Milliseconds(100));
    expire(session, number);
  });
}

/// What the socket waits for ends with an error after this time.
void arm(const SessionPtr& session, Milliseconds time) {
  session->timed_out = false;
  session->deadline.expires_after(time);
  expire(session, ++session->deadline_number);
}

void disarm(const SessionPtr& session) {
  ++session->deadline_number;
  session->deadline.cancel();
}

/// An answer that is waited for.
struct Pending {
  explicit Pending(const asio::any_io_executor& executor) : ready(executor) {
    ready.expires_at(asio::steady_timer::time_point::max());
  }
  asio::steady_timer ready;
  std::optional<HttpResponse> response;
};

/// Ends the wait for an answer when the client closes the connection meanwhile.
void watch_client(const SessionPtr& session, const std::shared_ptr<Pending>& pending,
                  const std::shared_ptr<std::atomic<bool>>& left) {
  session->socket.async_wait(tcp::socket::wait_read, [session, pending, left](error_code failure) {
    if (failure) return;
    char byte;
    const ssize_t got = ::recv(session->socket.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (got > 0 || (got < 0 && errno == EAGAIN)) return;  // the next request is here already
    *left = true;
    pending->ready.cancel();
  });
}

std::string without_breaks(const std::string& text) {
  std::string clean;
  for (const char c : text)
    if (static_cast<unsigned char>(c) >= ' ') clean += c;
  return clean;
}

std::string head_of(const HttpResponse& response, std::uint64_t body_bytes, bool keep_alive) {
  std::string head = fmt::format("HTTP/1.1 {} {}\r\n", response.status, reason_of(response.status));
  for (const auto& [name, value] : response.headers)
    head += fmt::format("{}: {}\r\n", without_breaks(name), without_breaks(value));
  if (response.status != 204 && response.status != 304)
    head += fmt::format("Content-Length: {}\r\n", body_bytes);
  head += "X-Content-Type-Options: nosniff\r\nServer: scarp/" SCARP_VERSION "\r\n";
  head += keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n";
  return head;
}

std::string small_letters(std::string_view text) {
  std::string small(text);
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return small;
}

std::shared_ptr<HttpRequest> request_of(Parser& parser, const std::string& client) {
  auto request = std::make_shared<HttpRequest>();
  auto& message = parser.get();
  const auto text = [](boost::beast::string_view v) { return std::string(v.data(), v.size()); };
  request->method = text(message.method_string());
  request->target = text(message.target());
  for (const auto& field : message)
    request->headers.emplace_back(small_letters(text(field.name_string())), text(field.value()));
  request->body = std::move(message.body());
  request->client = client;
  return request;
}

/// The answer to a request that could not be read; nothing where the connection is just gone.
std::optional<HttpResponse> answer_to(error_code failure, bool timed_out, const HttpLimits& limits,
                                      bool some_was_read) {
  if (timed_out) {
    if (!some_was_read) return {};
    return problem(408, "the request did not arrive in time; send it again, faster");
  }
  if (failure == http::error::body_limit)
    return problem(413,
                   fmt::format("the body is larger than {} bytes; send less", limits.body_bytes));
  if (failure == http::error::header_limit)
    return problem(431, fmt::format("the header is larger than {} bytes; send fewer or shorter "
                                    "fields",
                                    limits.header_bytes));
  if (failure == http::error::end_of_stream || failure == http::error::partial_message) return {};
  if (failure.category() == make_error_code(http::error::bad_method).category())
    return problem(400, fmt::format("not understood as HTTP/1.1: {}", failure.message()));
  return {};
}

/// What the system lets the process open, but for some that its files need.
std::size_t descriptors_for_connections() {
  constexpr std::size_t kForFiles = 64;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return kForFiles;
  return std::max<std::size_t>(kForFiles,
                               limit.rlim_cur - std::min<std::size_t>(kForFiles, limit.rlim_cur));
}

}  // namespace

struct HttpServer::Impl {
  Impl(const HttpLimits& limits_, HttpHandler handler_)
      : limits(limits_),
        handler(std::move(handler_)),
        acceptor(io),
        signals(io),
        patience_over(io) {}

  // Coroutines take what they use as arguments: they outlive the calls that begin them.
  asio::awaitable<void> accept();
  asio::awaitable<void> serve(SessionPtr session);
  asio::awaitable<bool> read(SessionPtr session, Parser& parser);
  asio::awaitable<HttpResponse> answer(SessionPtr session, std::shared_ptr<HttpRequest> request);
  asio::awaitable<bool> write(SessionPtr session, const HttpResponse& response, bool head_only,
                              bool keep_alive);
  asio::awaitable<void> refuse(SessionPtr session, HttpResponse response);
  void close(const SessionPtr& session);
  void begin_stop(Milliseconds patience);
  void stop_if_done();

  HttpLimits limits;
  HttpHandler handler;
  asio::io_context io{1};
  tcp::acceptor acceptor;
  asio::signal_set signals;
  asio::steady_timer patience_over;
  std::set<SessionPtr> sessions;
  std::size_t working = 0;  ///< sessions with a request under way
  bool stopping = false;
  std::uint64_t next_connection = 0;
  std::atomic<std::size_t> open{0};
  std::atomic<std::uint64_t> accepted{0}, requests{0};
};

asio::awaitable<void> HttpServer::Impl::accept() {
  for (;;) {
    tcp::socket socket(io);
    error_code failure;
    co_await acceptor.async_accept(socket, asio::redirect_error(asio::use_awaitable, failure));
    if (!acceptor.is_open()) co_return;
    if (failure) {
      // Out of descriptors, most likely: others end first.
      asio::steady_timer pause(io, Milliseconds(50));
      co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, failure));
      continue;
    }
    ++accepted;
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const tcp::endpoint remote = socket.remote_endpoint(ignored);
    // Many clients share the address of this machine: browsers and whatever stands in front.
    const std::string client = remote.address().is_loopback()
                                   ? fmt::format("connection {}", ++next_connection)
                                   : remote.address().to_string(ignored);
    auto session = std::make_shared<Session>(std::move(socket), client);
    if (sessions.size() >= limits.connections) {
      asio::co_spawn(io, refuse(session, problem(503, "too many connections; try again later")),
                     asio::detached);
      continue;
    }
    sessions.insert(session);
    open = sessions.size();
    asio::co_spawn(io, serve(session), asio::detached);
  }
}

asio::awaitable<void> HttpServer::Impl::serve(SessionPtr session) {
  for (bool keep_alive = true; keep_alive;) {
    session->is_idle = true;
    if (session->buffer.size() == 0) {
      arm(session, limits.idle_time);
      error_code failure;
      co_await session->socket.async_wait(tcp::socket::wait_read,
                                          asio::redirect_error(asio::use_awaitable, failure));
      if (failure) break;
    }
    session->is_idle = false;
    Parser parser;
    parser.header_limit(static_cast<std::uint32_t>(limits.header_bytes));
    parser.body_limit(limits.body_bytes);
    const bool is_read = co_await read(session, parser);
    if (!is_read) break;
    ++working;
    ++requests;
    const std::shared_ptr<HttpRequest> request = request_of(parser, session->client);
    keep_alive = parser.get().keep_alive() && !stopping;
    const HttpResponse response = co_await answer(session, request);
    if (stopping) keep_alive = false;
    const bool is_written =
        !*request->left && co_await write(session, response, request->method == "HEAD", keep_alive);
    --working;
    if (!is_written) keep_alive = false;
    if (stopping) stop_if_done();
  }
  close(session);
}

/// Reads one request; false where there is none, and what was wrong is answered.
asio::awaitable<bool> HttpServer::Impl::read(SessionPtr session, Parser& parser) {
  error_code failure;
  arm(session, limits.header_time);
  co_await http::async_read_header(session->socket, session->buffer, parser,
                                   asio::redirect_error(asio::use_awaitable, failure));
  if (!failure && parser.get().target().size() > limits.target_bytes) {
    disarm(session);
    co_await refuse(session, problem(414, fmt::format("the address is longer than {} bytes; "
                                                      "shorten it",
                                                      limits.target_bytes)));
    co_return false;
  }
  if (!failure && !parser.is_done()) {
    arm(session, limits.body_time);
    if (boost::beast::iequals(parser.get()[http::field::expect], "100-continue")) {
      static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
      co_await asio::async_write(session->socket, asio::buffer(kContinue),
                                 asio::redirect_error(asio::use_awaitable, failure));
    }
    if (!failure)
      co_await http::async_read(session->socket, session->buffer, parser,
                                asio::redirect_error(asio::use_awaitable, failure));
  }
  const bool timed_out = session->timed_out;
  disarm(session);
  if (!failure) co_return true;
  const std::optional<HttpResponse> response =
      answer_to(failure, timed_out, limits, parser.got_some() || session->buffer.size() > 0);
  if (response) co_await refuse(session, *response);
  co_return false;
}

asio::awaitable<HttpResponse> HttpServer::Impl::answer(SessionPtr session,
                                                       std::shared_ptr<HttpRequest> request) {
  if (stopping) co_return problem(503, "the server is stopping; ask again later");
  const auto pending = std::make_shared<Pending>(session->socket.get_executor());
  const asio::any_io_executor executor = session->socket.get_executor();
  const Reply reply = [pending, executor](HttpResponse response) {
    const auto given = std::make_shared<HttpResponse>(std::move(response));
    asio::post(executor, [pending, given] {
      if (pending->response) return;
      pending->response = std::move(*given);
      pending->ready.cancel();
    });
  };
  if (session->buffer.size() == 0) watch_client(session, pending, request->left);
  try {
    handler(request, reply);
  } catch (const std::exception& error) {
    reply(problem_of(error));
  }
  while (!pending->response && !*request->left) {
    error_code woken;
    co_await pending->ready.async_wait(asio::redirect_error(asio::use_awaitable, woken));
  }
  error_code ignored;
  session->socket.cancel(ignored);
  if (!pending->response) co_return HttpResponse{};
  co_return std::move(*pending->response);
}

asio::awaitable<bool> HttpServer::Impl::write(SessionPtr session, const HttpResponse& response,
                                              bool head_only, bool keep_alive) {
  const std::uint64_t bytes = response.file   ? response.file->bytes
                              : response.body ? response.body->size()
                                              : 0;
  const std::string head = head_of(response, bytes, keep_alive);
  error_code failure;
  arm(session, limits.write_time);
  if (head_only || response.file || !response.body) {
    co_await asio::async_write(session->socket, asio::buffer(head),
                               asio::redirect_error(asio::use_awaitable, failure));
  } else {
    const std::array<asio::const_buffer, 2> both = {asio::buffer(head),
                                                    asio::buffer(*response.body)};
    co_await asio::async_write(session->socket, both,
                               asio::redirect_error(asio::use_awaitable, failure));
  }
  if (!failure && response.file && !head_only) {
    constexpr std::uint64_t kPiece = 256 << 10;
    std::string piece;
    for (std::uint64_t sent = 0; sent < bytes && !failure;) {
      piece.resize(static_cast<std::size_t>(std::min(kPiece, bytes - sent)));
      const ssize_t got = ::pread(*response.file->descriptor, piece.data(), piece.size(),
                                  static_cast<off_t>(response.file->offset + sent));
      // The length is promised already: all that is left is to break off.
      if (got <= 0) failure = asio::error::eof;
      if (failure) break;
      piece.resize(static_cast<std::size_t>(got));
      arm(session, limits.write_time);
      co_await asio::async_write(session->socket, asio::buffer(piece),
                                 asio::redirect_error(asio::use_awaitable, failure));
      sent += static_cast<std::uint64_t>(got);
    }
  }
  disarm(session);
  co_return !failure;
}

/// Answers what was not read to its end, and lets the client read the answer before the connection
/// goes: closing with unread bytes would reset it.
asio::awaitable<void> HttpServer::Impl::refuse(SessionPtr session, HttpResponse response) {
  const bool is_written = co_await write(session, response, false, false);
  if (!is_written) co_return;
  error_code failure;
  session->socket.shutdown(tcp::socket::shutdown_send, failure);
  constexpr std::size_t kMost = 16 << 20;
  std::array<char, 16384> unread;
  arm(session, Milliseconds(2000));
  for (std::size_t bytes = 0; bytes < kMost && !failure;)
    bytes += co_await session->socket.async_read_some(
        asio::buffer(unread), asio::redirect_error(asio::use_awaitable, failure));
  disarm(session);
  session->socket.close(failure);
}

void HttpServer::Impl::close(const SessionPtr& session) {
  disarm(session);
  error_code ignored;
  session->socket.shutdown(tcp::socket::shutdown_both, ignored);
  session->socket.close(ignored);
  sessions.erase(session);
  open = sessions.size();
}

void HttpServer::Impl::begin_stop(Milliseconds patience) {
  if (stopping) return;
  stopping = true;
  patience_over.expires_after(patience);
  patience_over.async_wait([this](error_code failure) {
    if (!failure) io.stop();
  });
  // Closing a socket ends its coroutine, which takes the session out of the set.
  for (const SessionPtr& session : sessions) {
    error_code ignored;
    if (session->is_idle) session->socket.cancel(ignored);
  }
  stop_if_done();
}

void HttpServer::Impl::stop_if_done() {
  if (working > 0) return;
  // Other connections get their 503 in what is queued already; then it is over.
  asio::post(io, [this] {
    if (working == 0) io.stop();
  });
}

HttpServer::HttpServer(const std::string& host, std::uint16_t port, const HttpLimits& limits,
                       HttpHandler handler)
    : impl_(std::make_unique<Impl>(limits, std::move(handler))) {
  impl_->limits.connections = std::min(limits.connections, descriptors_for_connections());
  error_code failure;
  const asio::ip::address address =
      asio::ip::make_address(host == "localhost" ? "127.0.0.1" : host, failure);
  if (failure)
    throw Error(ErrorCode::kInput,
                fmt::format("--host {}: is no address; one of this machine was expected, such as "
                            "127.0.0.1, or 0.0.0.0 for all",
                            host));
  const tcp::endpoint endpoint(address, port);
  tcp::acceptor& acceptor = impl_->acceptor;
  acceptor.open(endpoint.protocol(), failure);
  if (!failure) acceptor.set_option(tcp::acceptor::reuse_address(true), failure);
  if (!failure) acceptor.bind(endpoint, failure);
  if (!failure) acceptor.listen(asio::socket_base::max_listen_connections, failure);
  if (failure)
    throw Error(ErrorCode::kResource,
                fmt::format("{} port {}: cannot be listened on: {}; give another --port", host,
                            port, failure.message()));
  asio::co_spawn(impl_->io, impl_->accept(), asio::detached);
}

HttpServer::~HttpServer() = default;

std::uint16_t HttpServer::port() const {
  return impl_->acceptor.local_endpoint().port();
}

bool HttpServer::is_loopback() const {
  return impl_->acceptor.local_endpoint().address().is_loopback();
}

void HttpServer::run() {
  impl_->io.run();
}

void HttpServer::stop(Milliseconds patience) {
  asio::post(impl_->io, [this, patience] { impl_->begin_stop(patience); });
}

void HttpServer::stop_on_signals(Milliseconds patience, std::function<void()> begin) {
  impl_->signals.add(SIGTERM);
  impl_->signals.add(SIGINT);
  impl_->signals.async_wait([this, patience, begin = std::move(begin)](error_code failure, int) {
    if (failure) return;
    if (begin) begin();
    impl_->begin_stop(patience);
  });
}

HttpCounts HttpServer::counts() const {
  return {impl_->open, impl_->accepted, impl_->requests};
}

}  // namespace scarp
