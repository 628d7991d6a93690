// One Device and one Source for many threads: the same bytes as one after another.
//
// tools/gates threads runs this program under ThreadSanitizer.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "bake/all_matches.h"
#include "bake/golden_scene.h"
#include "kiln/session.h"
#include "support/environment.h"

namespace kiln {
namespace {

constexpr std::uint32_t kThreads = 4;

/// Less under ThreadSanitizer, where everything takes twenty times as long.
std::uint32_t map_size() { return std::getenv("KILN_SMALL_THREADS_TEST") == nullptr ? 64 : 24; }

/// A bake by each match that there is, and one by several.
std::vector<BakeOptions> all_bakes() {
  return test::bakes_by_all_matches(map_size(), {MapKind::normal, {"height"}, {"id"}, {"ao"}});
}

void expect_same(const BakeResult& a, const BakeResult& b, const std::string& what) {
  ASSERT_EQ(a.maps.size(), b.maps.size()) << what;
  for (std::size_t i = 0; i < a.maps.size(); ++i) {
    EXPECT_TRUE(a.maps[i].image.pixels == b.maps[i].image.pixels)
        << what << ", " << a.maps[i].kind.name;
  }
  EXPECT_TRUE(a.coverage == b.coverage) << what;
  ASSERT_TRUE(a.match && b.match) << what;
  EXPECT_TRUE(a.match->triangle == b.match->triangle && a.match->u == b.match->u &&
              a.match->v == b.match->v && a.match->status == b.match->status)
      << what;
  EXPECT_EQ(a.report.missed, b.report.missed) << what;
}

/// Runs `work(thread)` on all threads; what one throws fails the test.
void run_threads(const std::function<void(std::uint32_t)>& work) {
  std::vector<std::string> errors(kThreads);
  {
    std::vector<std::jthread> threads;
    for (std::uint32_t i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] {
        try {
          work(i);
        } catch (const std::exception& error) {
          errors[i] = error.what();
        }
      });
    }
  }
  for (const std::string& error : errors) EXPECT_EQ(error, "");
}

class Threads : public ::testing::Test {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    if (!expected_.empty()) return;  // made once for all
    for (const BakeOptions& options : bakes_) {
      expected_.push_back(bake(Source(*test::device(), high_), low_, options));
      ASSERT_GT(expected_.back().report.samples, expected_.back().report.missed)
          << options.match.method.name;
    }
  }

  /// Every bake, each thread from another one on, of `sources(thread)`.
  void bake_all(const std::function<Source(std::uint32_t)>& sources) {
    std::vector<std::vector<BakeResult>> results(kThreads);
    run_threads([&](std::uint32_t thread) {
      const Source source = sources(thread);
      for (std::size_t i = 0; i < bakes_.size(); ++i) {
        results[thread].push_back(bake(source, low_, bakes_[(i + thread * 2) % bakes_.size()]));
      }
    });
    for (std::uint32_t thread = 0; thread < kThreads; ++thread) {
      ASSERT_EQ(results[thread].size(), bakes_.size());
      for (std::size_t i = 0; i < bakes_.size(); ++i) {
        const std::size_t which = (i + thread * 2) % bakes_.size();
        expect_same(
            results[thread][i], expected_[which],
            std::string(bakes_[which].match.method.name) + " of thread " + std::to_string(thread));
      }
    }
  }

  const Mesh high_ = test::golden_high(), low_ = test::golden_low();
  const std::vector<BakeOptions> bakes_ = all_bakes();
  static inline std::vector<BakeResult> expected_;
};

TEST_F(Threads, ShareOneSource) {
  // A device of its own: so that kernels are built at the same time, too.
  const Device device = Device::open(test::device()->info().name);
  const Source source(device, high_);
  bake_all([&](std::uint32_t) { return source; });
  // Structures were made once, and counted by whoever made them.
  const Source alone(device, high_);
  for (const BakeOptions& options : bakes_) bake(alone, low_, options);
  EXPECT_EQ(source.stats().device_bytes, alone.stats().device_bytes);
}

TEST_F(Threads, ShareOneDevice) {
  const Device device = Device::open(test::device()->info().name);
  bake_all([&](std::uint32_t) { return Source(device, high_); });
}

TEST_F(Threads, HaveADeviceEach) {
  const std::string name = test::device()->info().name;
  bake_all([&](std::uint32_t) { return Source(Device::open(name), high_); });
}

TEST_F(Threads, HaveSessionsBesideEachOther) {
  const Source source(*test::device(), high_);
  std::vector<Match> matches(kThreads);
  std::vector<std::vector<float>> maps(kThreads);
  const auto run = [&](std::uint32_t thread) {
    BakeOptions options;
    options.width = options.height = map_size();
    ViewSession views(source, low_, options);
    for (const Vec3 toward : {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0.5F}}) views.add(toward);
    matches[thread] = views.match();
    BakeSession session(*test::device(), high_, low_, options);
    session.bake();
    session.set_positions(
        0, std::vector<Vec3>(high_.positions.begin() + 1, high_.positions.begin() + 2));
    maps[thread] = session.bake().maps.front().image.pixels;
  };
  run(0);
  const Match match = matches[0];
  const std::vector<float> map = maps[0];
  run_threads(run);
  for (std::uint32_t thread = 0; thread < kThreads; ++thread) {
    EXPECT_TRUE(matches[thread].triangle == match.triangle) << thread;
    EXPECT_TRUE(matches[thread].status == match.status) << thread;
    EXPECT_TRUE(maps[thread] == map) << thread;
  }
}

}  // namespace
}  // namespace kiln
