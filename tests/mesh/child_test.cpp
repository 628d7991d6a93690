// Work in a child of the process: what comes back of it, however it ends.
#include "base/child.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>

#include "base/running_program.h"
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

// A program that writes without end must not fill memory: what is beyond the limit is read and discarded.
TEST(Child, TextsOfProgramsAreBounded) {
  constexpr std::size_t kLimit = std::size_t{64} << 20;
  std::optional<RunningProgram> program = RunningProgram::start(
      {"/bin/sh", "-c", "echo warned >&2; head -c 70000000 /dev/zero; echo end >&2"}, "/");
  ASSERT_TRUE(program);
  program->begin("", 300, [] { return false; });
  const ProgramResult result = program->finish();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.output.size(), kLimit);
  EXPECT_EQ(result.errors, "warned\nend\n");
}

}  // namespace
}  // namespace kiln
