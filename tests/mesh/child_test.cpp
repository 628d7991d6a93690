// Work in a child of the process: what comes back of it, however it ends.
#include "base/child.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
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
            ChildEnd::finished);
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
            ChildEnd::timed_out);
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

// A program may hang while it works, after it has closed its pipes, or in a program of its own that keeps them open.
TEST(Child, ProgramsThatHangAreEndedWithinTheirLimit) {
  struct Case {
    const char* script;
    bool is_stopped;
  };
  for (const auto& [script, is_stopped] :
       {Case{"exec sleep 1000", true}, Case{"exec >&- 2>&-; exec sleep 1000", true},
        Case{"kill -STOP $$", true}, Case{"exec yes", true},
        Case{"sleep 5 & echo done; exit 3", false}, Case{"exec >&- 2>&-; exit 3", false}}) {
    const auto start = std::chrono::steady_clock::now();
    std::optional<RunningProgram> program = RunningProgram::start({"/bin/sh", "-c", script}, "/");
    ASSERT_TRUE(program);
    program->begin("", is_stopped ? 0.5 : 300, [] { return false; });
    const ProgramResult result = program->finish();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    EXPECT_EQ(result.exit_code, is_stopped ? 128 + SIGKILL : 3) << script;
    EXPECT_EQ(result.errors.find("stopped after") != std::string::npos, is_stopped) << script;
    EXPECT_LT(taken.count(), is_stopped ? 60 : 4) << script;
  }
  // The same if nobody waits for the result, and if the caller cancels.
  const auto start = std::chrono::steady_clock::now();
  for (const bool cancelled : {false, true}) {
    std::optional<RunningProgram> program =
        RunningProgram::start({"/bin/sh", "-c", "exec >&- 2>&-; exec sleep 1000"}, "/");
    program->begin("", 300, [=] { return cancelled; });
    if (cancelled) EXPECT_EQ(program->finish().exit_code, 128 + SIGKILL);
  }
  EXPECT_LT((std::chrono::steady_clock::now() - start) / std::chrono::seconds(1), 60);
}

}  // namespace
}  // namespace kiln
