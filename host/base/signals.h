// Requests to end, and crashes. Implemented in posix/ and windows/.
#pragma once

#include <cstdint>

namespace kiln::os {

/// From now on, a request to end (Ctrl-C; SIGINT, SIGTERM, SIGHUP; a closed console) is noted, for interrupted(). A third
/// of a second later, or at a second request, `on_deadline` is called: in a handler of a signal, or on another thread.
/// Writing to a closed pipe and beyond a limit of file sizes are errors from now on, and end no process.
void catch_interrupts(void (*on_deadline)()) noexcept;
/// True once a request came.
bool interrupted() noexcept;

/// From now on, `on_crash` is called where the program crashes or aborts, on the thread that did, in a handler of a signal.
/// Handlers that others have set stay.
void catch_crashes(void (*on_crash)(int number)) noexcept;
/// True of a signal whose handler is that of catch_crashes().
bool handles_crash(int number) noexcept;
/// True of the number that `on_crash` is called with where the program aborted itself.
bool is_abort(int number) noexcept;
/// Lets the crash that `on_crash` was called for end the process, as without a handler.
void crash_unhandled(int number) noexcept;
/// Stops this thread for good: another one ends the process.
[[noreturn]] void stop_thread() noexcept;

/// A number of this thread that no other has now; above 0. Async-signal-safe.
std::int64_t thread_number() noexcept;
/// True on the thread that main() runs on. Async-signal-safe.
bool on_main_thread() noexcept;

}  // namespace kiln::os
