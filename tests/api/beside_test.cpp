// Work beside other work: its result, its errors, signs of life while one waits for it.
#include "base/beside.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "base/heartbeat.h"
#include "kiln/threads.h"

namespace kiln {
namespace {

/// Sets the thread limit while it lives.
struct Threads {
  explicit Threads(int count) { set_thread_limit(count); }
  ~Threads() { set_thread_limit(0); }
};

TEST(Beside, HandsOnWhatWasMade) {
  const Threads two(2);
  const std::thread::id here = std::this_thread::get_id();
  Beside<std::thread::id> other([] { return std::this_thread::get_id(); });
  EXPECT_NE(other.get(), here);
}

TEST(Beside, WorksWhenItIsAskedOnOneThread) {
  const Threads one(1);
  bool begun = false;
  Beside<std::thread::id> work([&] {
    begun = true;
    return std::this_thread::get_id();
  });
  EXPECT_FALSE(begun);
  EXPECT_EQ(work.get(), std::this_thread::get_id());
}

TEST(Beside, HandsOnErrors) {
  for (const int threads : {1, 2}) {
    const Threads limit(threads);
    Beside<int> work([]() -> int { throw std::runtime_error("no"); });
    EXPECT_THROW(work.get(), std::runtime_error);
  }
}

TEST(Beside, GivesSignsOfLifeAndMayBeStopped) {
  const Threads two(2);
  const auto slow = [] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return 7;
  };
  int told = 0;
  const Heartbeat alive([&](double, std::string_view) { return ++told > 0; });
  EXPECT_EQ(Beside<int>(slow).get(), 7);
  EXPECT_GE(told, 2);
  const Heartbeat stop([](double, std::string_view) { return false; });
  EXPECT_THROW(Beside<int>(slow).get(), Cancelled);
}

}  // namespace
}  // namespace kiln
