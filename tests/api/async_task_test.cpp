// Work beside other work: its result, its errors, signs of life while one waits for it.
#include "base/async_task.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "base/progress_guard.h"
#include "kiln/limits.h"

namespace kiln {
namespace {

/// Sets the thread limit while it lives.
struct Threads {
  explicit Threads(int count) { set_thread_limit(count); }
  ~Threads() { set_thread_limit(0); }
};

TEST(AsyncTask, HandsOnWhatWasMade) {
  const Threads two(2);
  const std::thread::id here = std::this_thread::get_id();
  AsyncTask<std::thread::id> other([] { return std::this_thread::get_id(); });
  EXPECT_NE(other.get(), here);
}

TEST(AsyncTask, WorksWhenItIsAskedOnOneThread) {
  const Threads one(1);
  bool begun = false;
  AsyncTask<std::thread::id> work([&] {
    begun = true;
    return std::this_thread::get_id();
  });
  EXPECT_FALSE(begun);
  EXPECT_EQ(work.get(), std::this_thread::get_id());
}

TEST(AsyncTask, HandsOnErrors) {
  for (const int threads : {1, 2}) {
    const Threads limit(threads);
    AsyncTask<int> work([]() -> int { throw std::runtime_error("no"); });
    EXPECT_THROW(work.get(), std::runtime_error);
  }
}

TEST(AsyncTask, GivesSignsOfLifeAndMayBeStopped) {
  const Threads two(2);
  const auto slow = [] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return 7;
  };
  int told = 0;
  const ProgressGuard alive([&](double, std::string_view) { return ++told > 0; });
  EXPECT_EQ(AsyncTask<int>(slow).get(), 7);
  EXPECT_GE(told, 2);
  const ProgressGuard stop([](double, std::string_view) { return false; });
  EXPECT_THROW(AsyncTask<int>(slow).get(), Cancelled);
}

}  // namespace
}  // namespace kiln
