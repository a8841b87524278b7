#pragma once

#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

namespace scarp::test {

/// Lets no file of this process grow beyond `bytes`: a disk that is full.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, SIG_DFL);
  }

 private:
  rlimit before_{};
};

/// Root may write everywhere; this makes it somebody else for a while.
class NotRoot {
 public:
  NotRoot() : was_root_(::geteuid() == 0) {
    if (was_root_) [[maybe_unused]]
      const int done = ::seteuid(65534);
  }
  ~NotRoot() {
    if (was_root_) [[maybe_unused]]
      const int done = ::seteuid(0);
  }

 private:
  bool was_root_;
};

}  // namespace scarp::test
