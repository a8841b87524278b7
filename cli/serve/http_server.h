#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "cli/serve/http.h"

namespace scarp {

/// What a connection may take. Beyond: 408, 413, 414, 431, or a clean close.
struct HttpLimits {
  std::size_t header_bytes = 16 << 10;
  std::size_t target_bytes = 4 << 10;
  std::size_t body_bytes = 1 << 20;
  std::size_t connections = 1024;
  std::chrono::milliseconds header_time{10'000};  ///< from the first byte to the last of the header
  std::chrono::milliseconds body_time{20'000};
  std::chrono::milliseconds write_time{60'000};  ///< without any byte taken by the client
  std::chrono::milliseconds idle_time{600'000};  ///< between requests
};

struct HttpCounts {
  std::size_t open_connections = 0;
  std::uint64_t accepted_connections = 0;
  std::uint64_t requests = 0;
};

/// HTTP/1.1 over TCP. All connections live on one thread as coroutines: an open connection costs
/// some kilobytes and no thread, however long it idles or waits for its answer.
///
/// Boost.Beast parses; nothing else in the program sees it.
class HttpServer {
 public:
  /// Binds at once. @param port  0: any that is free
  /// Throws Error{kInput} where the address is none, kResource where it cannot be bound.
  HttpServer(const std::string& host, std::uint16_t port, const HttpLimits& limits,
             HttpHandler handler);
  ~HttpServer();

  std::uint16_t port() const;
  bool is_loopback() const;

  /// Serves until stop() has finished, on this thread.
  void run();

  /// From any thread, also from a signal's waiter: requests that are under way are answered, later
  /// ones get 503, idle connections are closed; then run() returns. After `patience` it returns in
  /// any case.
  void stop(std::chrono::milliseconds patience);

  /// SIGTERM and SIGINT call stop(patience), and before it `begin`, on the thread of run().
  void stop_on_signals(std::chrono::milliseconds patience, std::function<void()> begin);

  HttpCounts counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scarp
