#include "interrupt.h"

#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>

#include "kiln/files.h"

namespace kiln::cli {
namespace {

std::atomic<bool> interrupt_came{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void on_deadline(int) {
  if (placing_outputs()) return;  // in a moment all of them are there
  remove_temporary_files();
  static const char message[] = "\nCancelled.\n";
  [[maybe_unused]] const auto ignored = write(STDERR_FILENO, message, sizeof message - 1);
  _exit(kExitCancelled);
}

extern "C" void on_interrupt(int) {
  if (interrupt_came.exchange(true)) on_deadline(0);  // a second one does not wait
  itimerval timer{};
  timer.it_value.tv_usec = 330000;
  setitimer(ITIMER_REAL, &timer, nullptr);
}

void handle(int number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  // Signals that a parent ignores (nohup) stay ignored.
  struct sigaction before {};
  if (number != SIGALRM && sigaction(number, nullptr, &before) == 0 &&
      before.sa_handler == SIG_IGN) {
    return;
  }
  sigaction(number, &action, nullptr);
}

}  // namespace

void catch_interrupts() {
  handle(SIGALRM, on_deadline);
  handle(SIGINT, on_interrupt);
  handle(SIGTERM, on_interrupt);
  handle(SIGHUP, on_interrupt);
  // A full pipe or file-size limit is an error that the writer reports, not a reason to die.
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() { return interrupt_came.load(); }

}  // namespace kiln::cli
