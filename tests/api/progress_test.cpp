// Long work: signs of life, cancelling, threads, and what a session says it changed.
#include "kiln/progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "base/progress_guard.h"
#include "kiln/bake.h"
#include "kiln/contour.h"
#include "kiln/limits.h"
#include "kiln/plan.h"
#include "kiln/session.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "support/volumes.h"

namespace kiln {

extern std::chrono::milliseconds min_progress_interval;

namespace {

TEST(ProgressGuard, ParallelLoopsAndSerialOnesTellTheirCaller) {
  for (const int threads : {1, 3}) {
    int calls = 0;
    ProgressGuard heart([&](double, std::string_view) { return ++calls < 4; });
    std::atomic<int> pieces{0};
    EXPECT_THROW(parallel_for(
                     1000, 1,
                     [&](std::size_t, std::size_t) {
                       ++pieces;
                       std::this_thread::sleep_for(std::chrono::milliseconds(5));
                     },
                     threads),
                 Cancelled);
    EXPECT_EQ(calls, 4);
    // Four beats, 50 ms apart, are 40 pieces a thread.
    EXPECT_LT(pieces, 600);
  }
}

TEST(ProgressGuard, IsSilentWithoutACallbackAndInsideOne) {
  ProgressGuard none((Progress()));
  ProgressGuard::poll();
  int calls = 0;
  ProgressGuard heart([&](double, std::string_view) {
    ++calls;
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    ProgressGuard::poll();  // the callback itself uses Kiln
    return true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  ProgressGuard::poll();
  EXPECT_EQ(calls, 1);
}

TEST(ProgressGuard, WhatTheCallbackThrowsComesOut) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::cube());
  BakeOptions options{.width = 16, .height = 16};
  options.progress = [](double, std::string_view) -> bool { throw std::runtime_error("mine"); };
  EXPECT_THROW(bake(source, test::cube(), options), std::runtime_error);
  options.progress = {};
  EXPECT_EQ(bake(source, test::cube(), options).maps.size(), 1U);  // nothing is left behind
}

TEST(Progress, ASourceIsBuiltOrCancelled) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = test::icosphere(4);
  std::vector<double> told;
  const auto built = Source::build(*test::device(), mesh, [&](double done, std::string_view) {
    told.push_back(done);
    return true;
  });
  ASSERT_TRUE(built);
  EXPECT_EQ(built->stats().triangles, mesh.triangles.size());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.front(), 0);
  EXPECT_EQ(told.back(), 1);
  EXPECT_FALSE(
      Source::build(*test::device(), mesh, [](double, std::string_view) { return false; }));
  EXPECT_TRUE(Source::build(*test::device(), mesh, {}));
}

/// Cancels at every call there is, one after the other.
TEST(Progress, EveryCallMayCancel) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000);
  const Mesh low = test::BumpySphere::light(12, 8);
  const Source source(*test::device(), high);
  BakeOptions options{.width = 128, .height = 128};
  for (int last = 1;; ++last) {
    int calls = 0;
    bool finished = false;  // nothing is left to cancel
    options.progress = [&](double done, std::string_view) {
      finished = done == 1;
      return ++calls < last;
    };
    const BakeResult result = bake(source, low, options);
    EXPECT_LE(calls, last);
    EXPECT_EQ(result.cancelled, calls == last && !finished);
    EXPECT_EQ(result.maps.empty(), result.cancelled);
    if (!result.cancelled) {
      EXPECT_GT(calls, 2);
      return;
    }
  }
}

/// While it lives, each poll calls, not one in 50 ms: what is counted then does not depend on the machine's speed.
struct EachPollCalls {
  EachPollCalls() { min_progress_interval = std::chrono::milliseconds(0); }
  ~EachPollCalls() { min_progress_interval = std::chrono::milliseconds(50); }
  EachPollCalls(const EachPollCalls&) = delete;
  EachPollCalls& operator=(const EachPollCalls&) = delete;
};

TEST(Progress, BakesPollOften) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000);
  const Mesh low = test::BumpySphere::light(24, 12);
  int calls = 0;
  const Progress note = [&](double, std::string_view) { return ++calls > 0; };
  BakeOptions options{.width = 256, .height = 256};
  options.progress = note;
  const EachPollCalls each;
  const auto source = Source::build(*test::device(), high, note);
  EXPECT_GT(calls, 10) << "Source";
  calls = 0;
  bake(*source, low, options);
  EXPECT_GT(calls, 25) << "bake()";
}

/// Long work that takes no callback, by name.
std::vector<std::pair<std::string, std::function<void()>>> silent_work(const Device& device) {
  const auto high = std::make_shared<const Mesh>(test::BumpySphere::dense(20000));
  const auto some = std::make_shared<const Mesh>(simplify(*high, {.faces = 3000}));
  const auto volume = std::make_shared<const Volume>(test::make_float_volume(
      {80, 80, 80}, [](double x, double y, double z) { return test::gyroid_field(x, y, z, 16); }));
  const auto source = std::make_shared<const Source>(device, *some);
  return {
      {"simplify", [=] { simplify(*high, {.faces = 1000}); }},
      {"unwrap", [=] { unwrap(*some, {.method = UnwrapMethod::charts}); }},
      {"contour", [=] { contour(device, *volume, {.iso = 0}); }},
      {"extract", [=] { extract(device, *volume, {.contour = {.iso = 0}, .faces = 2000}); }},
      {"plan_low_poly",
       [=] {
         LowPolyPlanOptions options;
         options.max_error = 3;
         options.bake.width = options.bake.height = 64;
         const LowPolyPlan light = plan_low_poly(*source, *some, options);
         if (light.cancelled) throw Error(ErrorCode::cancelled, "cancelled");
       }},
  };
}

TEST(ProgressScope, HearsOfWorkWithoutACallback) {
  KILN_REQUIRE_DEVICE();
  const EachPollCalls each;
  for (const auto& [name, work] : silent_work(*test::device())) {
    int calls = 0;
    {
      const ProgressScope scope([&](double done, std::string_view) {
        EXPECT_GE(done, 0);
        EXPECT_LE(done, 1);
        ++calls;
        return true;
      });
      work();
    }
    EXPECT_GT(calls, 50) << name;
    const int before = calls;
    if (name == "unwrap") work();  // the scope has ended
    EXPECT_EQ(calls, before);
  }
}

TEST(ProgressScope, StopsWorkWithoutACallback) {
  KILN_REQUIRE_DEVICE();
  for (const auto& [name, work] : silent_work(*test::device())) {
    int calls = 0;
    const ProgressScope scope([&](double, std::string_view) { return ++calls < 2; });
    try {
      // A quick machine ends some of them before they beat twice.
      for (int turn = 0; turn < 100; ++turn) work();
      ADD_FAILURE() << name << " went on after " << calls << " calls";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled) << name;
      EXPECT_STREQ(error.id(), "cancelled") << name;
    }
    EXPECT_EQ(calls, 2) << name;
  }
}

TEST(ProgressScope, ACallbackOfTheWorkGoesFirst) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::cube());
  int own = 0, outer = 0;
  BakeOptions options{.width = 16, .height = 16};
  options.progress = [&](double, std::string_view) { return ++own > 0; };
  const ProgressScope scope([&](double, std::string_view) { return ++outer > 0; });
  EXPECT_FALSE(bake(source, test::cube(), options).cancelled);
  EXPECT_GT(own, 0);
  EXPECT_EQ(outer, 0);
}

TEST(ProgressScope, TellsWhatItIsTold) {
  double told = -1;
  std::string doing;
  ProgressScope scope([&](double done, std::string_view stage) {
    told = done;
    doing = stage;
    return done < 1;
  });
  scope.at(0.25, "loading");
  EXPECT_EQ(told, 0.25);
  EXPECT_EQ(doing, "loading");
  EXPECT_THROW(scope.at(1, "ending"), Error);
  ProgressScope((Progress())).at(1, "nobody hears");
}

TEST(Threads, TheLimitHoldsAndChangesNothing) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(300000);
  const auto hashes = [&] {
    const Source source(*test::device(), high);
    return match(source, test::BumpySphere::light(12, 8), {.width = 64, .height = 64}).match;
  };
  set_thread_limit(1);
  EXPECT_EQ(thread_limit(), 1);
  std::atomic<int> at_once{0}, most{0}, wanted{0};
  const auto count = [&](std::size_t, std::size_t) {
    const int now = ++at_once;
    if (now > most) most = now;
    // A second thread may take its time to begin: the first one waits for it.
    int waits = 0;
    do {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } while (most < wanted && ++waits < 20'000);
    if (waits == 20'000) wanted = 0;  // none comes
    --at_once;
  };
  parallel_for(20, 1, count);
  EXPECT_EQ(most, 1);
  wanted = 2;
  const Match one = hashes();
  set_thread_limit(5);
  parallel_for(200, 1, count);
  EXPECT_GT(most, 1);
  EXPECT_LE(most, 5);
  const Match five = hashes();
  set_thread_limit(0);
  EXPECT_GE(thread_limit(), 1);
  EXPECT_EQ(one.source_hash, five.source_hash);
  EXPECT_EQ(one.triangle, five.triangle);
  for (const int wrong : {-1, 1025}) {
    try {
      set_thread_limit(wrong);
      FAIL();
    } catch (const Error& error) {
      EXPECT_STREQ(error.id(), "thread-limit");
    }
  }
}

bool inside(const Rectangle& box, std::uint32_t x, std::uint32_t y) {
  return x >= box.x && x < box.x + box.width && y >= box.y && y < box.y + box.height;
}

TEST(Session, NothingChangesOutsideTheDirtyRectangle) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh = test::plane(16, 16);
  mesh.normals.clear();  // they follow the positions
  mesh.normal_triangles.clear();
  BakeOptions options{.width = 64, .height = 64};
  options.match.method = MatchMethod::uv;
  options.encoding.gutter = 2;
  BakeSession session(*test::device(), mesh, test::plane(1, 1), options);
  session.bake();
  EXPECT_EQ(session.last_update().dirty, (Rectangle{0, 0, 64, 64}));
  session.bake();
  EXPECT_EQ(session.last_update().dirty, (Rectangle{}));
  for (std::uint32_t vertex = 20; vertex < 280; vertex += 37) {
    const Image before = session.bake().maps[0].image;
    Vec3 p = session.high().positions[vertex];
    p.z += 0.01F;
    session.set_positions(vertex, {&p, 1});
    const Image after = session.bake().maps[0].image;
    const Rectangle box = session.last_update().dirty;
    EXPECT_LT(box.width * box.height, 64U * 64 / 4);
    bool changed = false;
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) {
        const bool same = std::memcmp(before.at(x, y), after.at(x, y), 3 * sizeof(float)) == 0;
        changed = changed || !same;
        EXPECT_TRUE(same || inside(box, x, y)) << x << ", " << y;
      }
    }
    EXPECT_TRUE(changed);
  }
}

}  // namespace
}  // namespace kiln
