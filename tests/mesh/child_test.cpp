// Work in a child of the process: what comes back of it, however it ends.
#include "base/child.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "kiln/error.h"
#include "kiln/progress.h"

namespace kiln {
namespace {

constexpr ChildLimits kLimits{.seconds = 60, .bytes = std::uint64_t{1} << 30};

std::string wait_forever() {
  for (;;) pause();
}

TEST(Child, SaysHowItEnded) {
  std::string text;
  EXPECT_EQ(run_in_child(
                kLimits, [] { return std::string("text"); }, text),
            ChildEnd::done);
  EXPECT_EQ(text, "text");
  text.clear();
  EXPECT_EQ(run_in_child(
                kLimits, []() -> std::string { std::abort(); }, text),
            ChildEnd::crashed);
  EXPECT_EQ(text, "");
}

// It takes no processor time, so that no limit of the system's ends it.
TEST(Child, ThatWaitsForeverIsEnded) {
  std::string text;
  EXPECT_EQ(run_in_child({.seconds = 0, .bytes = kLimits.bytes}, wait_forever, text),
            ChildEnd::slow);
}

TEST(Child, EndsWhereTheCallerCancels) {
  std::string text;
  const ProgressScope scope([](double, std::string_view) { return false; });
  try {
    run_in_child(kLimits, wait_forever, text);
    ADD_FAILURE() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace kiln
