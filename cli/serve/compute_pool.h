#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/threads/stop.h"

namespace scarp {

/// Work for the pool. Exactly one of the two is called, once, on a thread of the pool or, of
/// refuse, of whoever closes it.
struct PoolTask {
  std::string client;       ///< whose turn it takes
  StopAsked is_not_wanted;  ///< asked before it begins: true drops it by refuse(kNotWanted)
  std::function<void()> run;
  enum class Why { kNotWanted, kClosing };
  std::function<void(Why)> refuse;
};

/// Threads that compute, apart from those that read and write. Clients take turns: however much one
/// of them asks for, another one's next task waits for no more than one task of each client.
class ComputePool {
 public:
  struct Limits {
    int threads = 2;
    std::size_t waiting = 128;  ///< tasks of all clients
    std::size_t waiting_of_client = 32;
  };
  explicit ComputePool(const Limits& limits);
  /// Closes, and waits for what runs.
  ~ComputePool();

  /// @return false where too much waits already, or the pool is closed; the task is left alone
  [[nodiscard]] bool submit(PoolTask task);

  /// What waits is refused, and all that comes later; what runs goes on.
  void close();

  struct Counts {
    std::size_t waiting = 0, running = 0;
    std::uint64_t done = 0, refused = 0;
  };
  Counts counts() const;

 private:
  void work();

  const Limits limits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::deque<PoolTask>> queues_;  // none is empty
  std::list<std::string> turns_;                        // clients that have a queue
  Counts counts_;
  bool closed_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace scarp
