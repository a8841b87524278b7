#include "core/threads/stop.h"

#include <gtest/gtest.h>

#include <atomic>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

TEST(StopScope, PassesOverWhatIsLeft) {
  std::atomic<std::size_t> done{0};
  const StopAsked stop = [&] { return done > 10; };
  {
    const StopScope scope(stop);
    parallel_for(1'000'000, [&](std::size_t) { ++done; });
    EXPECT_TRUE(stop_asked());
    EXPECT_LT(done, 1000U);
    // What many will share is made to its end.
    const StopAsked never;
    const StopScope inner(never);
    EXPECT_FALSE(stop_asked());
    done = 20;
    parallel_for(100, [&](std::size_t) { ++done; });
    EXPECT_EQ(done, 120U);
  }
  EXPECT_FALSE(stop_asked());
  parallel_for(100, [&](std::size_t) { ++done; });
  EXPECT_EQ(done, 220U);
}

}  // namespace
}  // namespace scarp
