#include "base/signals.h"

#include <atomic>
#include <csignal>

#include "base/windows/api.h"

namespace kiln::os {
namespace {

constexpr DWORD kMillisecondsToEnd = 330;

std::atomic<bool> is_interrupt_received{false};
void (*deadline)() = nullptr;
const DWORD main_thread = GetCurrentThreadId();

/// The system calls this on a separate thread for each event. If the console was closed, it ends the process when this
/// returns.
BOOL WINAPI on_control(DWORD /*event*/) {
  if (!is_interrupt_received.exchange(true)) Sleep(kMillisecondsToEnd);
  deadline();
  // the main thread finishes outputs that are being moved into place, and ends the program
  block_forever();
}

void (*crash_callback)(int number) = nullptr;
constexpr int kExceptionNumber = 0;  // stands for system exceptions, which have no signal number

LONG WINAPI on_exception(EXCEPTION_POINTERS* /*pointers*/) {
  crash_callback(kExceptionNumber);
  return EXCEPTION_CONTINUE_SEARCH;
}

}  // namespace

void catch_interrupts(void (*on_deadline)()) noexcept {
  deadline = on_deadline;
  SetConsoleCtrlHandler(on_control, TRUE);
}

bool interrupted() noexcept { return is_interrupt_received.load(); }

void catch_crashes(void (*on_crash)(int number)) noexcept {
  crash_callback = on_crash;
  // Suppresses error dialogs, which would block until a user closes them.
  SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX);
  SetUnhandledExceptionFilter(on_exception);
  std::signal(SIGABRT, on_crash);
}

bool handles_crash(int number) noexcept { return number == SIGABRT; }
bool is_abort(int number) noexcept { return number == SIGABRT; }
void end_by_crash(int number) noexcept {
  if (number == SIGABRT) std::signal(SIGABRT, SIG_DFL);
}

void block_forever() noexcept {
  for (;;) Sleep(INFINITE);
}

std::int64_t thread_number() noexcept { return GetCurrentThreadId(); }
bool on_main_thread() noexcept { return GetCurrentThreadId() == main_thread; }

}  // namespace kiln::os
