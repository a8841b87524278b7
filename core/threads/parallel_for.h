#pragma once

#include <cstddef>
#include <functional>

namespace scarp {

/// Calls body(i) once for each i in [0, count), on as many threads as set_thread_count allows.
/// Each index writes its own slot and reads nothing that another writes, so the result is the
/// same for any number of threads; reductions are done afterwards, in index order.
/// An exception in a body ends the loop and is thrown on. Within a StopScope (stop.h) indices may
/// be left out once a stop is asked for.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

/// Limits every later parallel_for; 0 means all the processors that the process may use.
void set_thread_count(int threads);
int thread_count();

}  // namespace scarp
