// The console on a terminal: a pseudo-terminal stands for the user's, and what it receives is compared by the byte.
#include "report/console.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace kiln::cli {
namespace {

const std::string kClear = "\r\033[K";

/// Standard error on a pseudo-terminal of some columns.
class Terminal {
 public:
  explicit Terminal(unsigned short columns) : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_GE(master_, 0);
    EXPECT_EQ(grantpt(master_), 0);
    EXPECT_EQ(unlockpt(master_), 0);
    slave_ = open(ptsname(master_), O_RDWR | O_NOCTTY);
    EXPECT_GE(slave_, 0);
    winsize size{};
    size.ws_col = columns;
    size.ws_row = 24;
    EXPECT_EQ(ioctl(slave_, TIOCSWINSZ, &size), 0);
    std::fflush(stderr);
    saved_ = dup(STDERR_FILENO);
    dup2(slave_, STDERR_FILENO);
    setenv("TERM", "xterm", 1);
  }
  ~Terminal() {
    std::fflush(stderr);
    dup2(saved_, STDERR_FILENO);
    for (const int file : {saved_, slave_, master_}) close(file);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// What was printed since the last call, with the seconds of a test that has just begun.
  std::string read() const {
    std::string text;
    char bytes[512];
    for (pollfd state{master_, POLLIN, 0}; poll(&state, 1, 0) > 0;) {
      const ssize_t count = ::read(master_, bytes, sizeof bytes);
      if (count <= 0) break;
      text.append(bytes, static_cast<std::size_t>(count));
    }
    const std::string begun = "    0.0";
    for (std::size_t at = text.find('%'); at != text.npos; at = text.find('%', at + 1)) {
      text.replace(at + 1, begun.size(), begun);
    }
    return text;
  }

 private:
  int master_ = -1, slave_ = -1, saved_ = -1;
};

/// A bar of `width` columns.
std::string bar(std::size_t filled, std::size_t width, const std::string& percent,
                const std::string& stage) {
  return kClear + "[" + std::string(filled, '#') + std::string(width - filled, '.') + "] " +
         percent + "%    0.0 s  " + stage;
}

TEST(Console, DrawsABarThatStatesShareAndStage) {
  std::vector<std::string> shown;
  {
    const Terminal terminal(81);
    Console console(false);
    const auto show = [&](double share, const std::string& stage) {
      EXPECT_TRUE(console.progress(share, stage));
      shown.push_back(terminal.read());
    };
    show(0, "reading");
    show(0.5, "baking");
    show(0.502, "baking");  // the same percent and stage
    show(0.502, "writing");
    show(0.51, "writing");
    show(1.5, "writing");
    EXPECT_TRUE(console.stages_at_share(0.25)(0.9, "a stage"));
    shown.push_back(terminal.read());
  }
  const std::vector<std::string> expected = {
      bar(0, 26, "  0", "reading"),  bar(13, 26, " 50", "baking"),  "",
      bar(13, 26, " 50", "writing"), bar(13, 26, " 51", "writing"), bar(26, 26, "100", "writing"),
      bar(6, 26, " 25", "a stage")};
  EXPECT_EQ(shown, expected);
}

TEST(Console, ABarIsNeverAsWideAsTheTerminal) {
  std::string wide, narrow;
  {
    const Terminal terminal(200);
    Console console(false);
    console.progress(0.5, "baking");
    wide = terminal.read();
  }
  {
    const Terminal terminal(31);
    Console console(false);
    console.progress(0.5, "baking a map");
    narrow = terminal.read();
  }
  EXPECT_EQ(wide, bar(16, 32, " 50", "baking"));
  // 30 columns: 10 of the bar, 18 of the numbers, 2 of the stage.
  EXPECT_EQ(narrow, bar(5, 10, " 50", "ba"));
}

TEST(Console, MessagesTakeTheBarsPlace) {
  std::string warned, warned_again, line, ended, report_line;
  {
    const Terminal terminal(81);
    {
      Console console(false, "-");
      console.progress(0.5, "baking");
      terminal.read();
      console.warning("first");
      warned = terminal.read();
      console.warning("second");
      warned_again = terminal.read();
      // With a report on standard output, lines go to standard error.
      console.progress(0.75, "baking");
      terminal.read();
      console.line("a result");
      line = terminal.read();
      console.progress(0.9, "baking");
      terminal.read();
    }
    ended = terminal.read();
  }
  EXPECT_EQ(warned, kClear + "warning: first\r\n");
  EXPECT_EQ(warned_again, "warning: second\r\n");
  EXPECT_EQ(line, kClear + "a result\r\n");
  EXPECT_EQ(ended, kClear);
}

TEST(Console, QuietKeepsWarningsAlone) {
  std::string progress, line, warned;
  {
    const Terminal terminal(81);
    Console console(true, "-");
    EXPECT_TRUE(console.progress(0.5, "baking"));
    progress = terminal.read();
    console.line("a result");
    line = terminal.read();
    console.warning("still here");
    warned = terminal.read();
  }
  EXPECT_EQ(progress, "");
  EXPECT_EQ(line, "");
  EXPECT_EQ(warned, "warning: still here\r\n");
}

TEST(Console, TimeLeftIsLinearOnceItIsReliable) {
  EXPECT_EQ(time_left(0.5, 10), "about 10 s left, ");
  EXPECT_EQ(time_left(0.25, 10), "about 30 s left, ");
  EXPECT_EQ(time_left(0.99, 10), "about 1 s left, ");
  EXPECT_EQ(time_left(0.5, 59), "about 59 s left, ");
  EXPECT_EQ(time_left(0.5, 60), "about 1 min left, ");
  EXPECT_EQ(time_left(0.5, 3599), "about 60 min left, ");
  EXPECT_EQ(time_left(0.5, 3600), "about 1.0 h left, ");
  EXPECT_EQ(time_left(0.2, 3600), "about 4.0 h left, ");
  // Too early, too short a time, done.
  EXPECT_EQ(time_left(0.009, 10), "");
  EXPECT_EQ(time_left(0.01, 10), "about 16 min left, ");
  EXPECT_EQ(time_left(0.5, 1.9), "");
  EXPECT_EQ(time_left(0.5, 2), "about 2 s left, ");
  EXPECT_EQ(time_left(1, 10), "");
}

TEST(Console, WarningsOfAKindAreOneWithTheirNumber) {
  std::string printed;
  {
    const Terminal terminal(81);
    Console console(false);
    print_warnings(
        console, {{"general", "of all", 1}, {"general", "again", 1}},
        {{"b", "first of b", 1}, {"a", "of a", 1}, {"b", "second of b", 1}, {"b", "third", 1}},
        "r.json");
    printed = terminal.read();
  }
  EXPECT_EQ(
      printed,
      "warning: of all\r\nwarning: again\r\nwarning: of a\r\n"
      "warning: first of b (The same or a similar warning occurred at 2 further settings; see "
      "r.json.)\r\n");
}

}  // namespace
}  // namespace kiln::cli
