#include "base/signals.h"

#include <signal.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <atomic>

namespace kiln::os {
namespace {

/// Time after an interrupt within which the process should end by itself; then deadline() is called.
constexpr suseconds_t kMaxEndMicroseconds = 330000;

std::atomic<bool> is_interrupt_received{false};
static_assert(std::atomic<bool>::is_always_lock_free);
void (*deadline)() = nullptr;

extern "C" void on_alarm(int) { deadline(); }

extern "C" void on_interrupt(int) {
  // A second request to end interrupts the wait
  if (is_interrupt_received.exchange(true)) deadline();
  itimerval deadline_timer{};
  deadline_timer.it_value.tv_usec = kMaxEndMicroseconds;
  setitimer(ITIMER_REAL, &deadline_timer, nullptr);
}

void install_handler(int number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  // Signals that the parent process ignores (nohup) stay ignored.
  struct sigaction previous_action {};
  if (number != SIGALRM && sigaction(number, nullptr, &previous_action) == 0 &&
      previous_action.sa_handler == SIG_IGN) {
    return;
  }
  sigaction(number, &action, nullptr);
}

constexpr std::array kCrashSignals = {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE, SIGTRAP};
std::array<bool, kCrashSignals.size()> handled{};

}  // namespace

void catch_interrupts(void (*on_deadline)()) noexcept {
  deadline = on_deadline;
  install_handler(SIGALRM, on_alarm);
  install_handler(SIGINT, on_interrupt);
  install_handler(SIGTERM, on_interrupt);
  install_handler(SIGHUP, on_interrupt);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() noexcept { return is_interrupt_received.load(); }

void catch_crashes(void (*on_crash)(int number)) noexcept {
  for (std::size_t i = 0; i < kCrashSignals.size(); ++i) {
    struct sigaction previous_action {};
    // Existing handlers, such as a sanitizer's, are kept.
    if (sigaction(kCrashSignals[i], nullptr, &previous_action) != 0 ||
        previous_action.sa_handler != SIG_DFL)
      continue;
    struct sigaction action {};
    action.sa_handler = on_crash;
    action.sa_flags = SA_NODEFER | SA_ONSTACK;
    handled[i] = sigaction(kCrashSignals[i], &action, nullptr) == 0;
  }
}

bool handles_crash(int number) noexcept {
  for (std::size_t i = 0; i < kCrashSignals.size(); ++i) {
    if (kCrashSignals[i] == number) return handled[i];
  }
  return false;
}

bool is_abort(int number) noexcept { return number == SIGABRT; }

void end_by_crash(int number) noexcept {
  signal(number, SIG_DFL);
  raise(number);
}

void block_forever() noexcept {
  for (;;) pause();
}

std::int64_t thread_number() noexcept { return syscall(SYS_gettid); }
bool on_main_thread() noexcept { return thread_number() == getpid(); }

}  // namespace kiln::os
