#include "core/threads/parallel_for.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "core/memory/large_array.h"
#include "core/threads/stop.h"

#ifndef SCARP_STD_THREADS
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace scarp {
namespace {

std::atomic<int> asked_threads{0};

/// Of the innermost StopScope of this thread.
thread_local const StopAsked* innermost_stop = nullptr;

int available_threads() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

StopScope::StopScope(const StopAsked& asked) : outer_(innermost_stop) {
  innermost_stop = &asked;
}

StopScope::~StopScope() {
  innermost_stop = outer_;
}

bool stop_asked() {
  return innermost_stop != nullptr && *innermost_stop && (*innermost_stop)();
}

void set_thread_count(int threads) {
  asked_threads = threads;
}

int thread_count() {
  const int asked = asked_threads;
  return asked > 0 ? asked : available_threads();
}

#ifdef SCARP_STD_THREADS

void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) {
  const StopAsked* stop = innermost_stop;
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  std::vector<std::thread> threads;
  for (int t = 0; t < thread_count(); ++t) {
    threads.emplace_back([&] {
      try {
        for (std::size_t i = next++; i < count; i = next++) {
          if (stop != nullptr && *stop && (*stop)()) return;
          body(i);
          relieve_large_memory();
        }
      } catch (...) {
        const std::scoped_lock lock(failure_mutex);
        failure = std::current_exception();
        next = count;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

#else

void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) {
  // An arena of its own size: more threads than processors are allowed, so that tests of
  // "the same bits for any thread count" mean it on every machine.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(thread_count()));
  tbb::task_arena arena(thread_count());
  const StopAsked* stop = innermost_stop;
  const auto one = [&](std::size_t i) {
    if (stop != nullptr && *stop && (*stop)()) return;
    body(i);
    relieve_large_memory();
  };
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, count, one, tbb::simple_partitioner()); });
}

#endif

}  // namespace scarp
