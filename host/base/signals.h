// Handles requests to end, and crashes. Implemented in posix/ and windows/.
#pragma once

#include <cstdint>

namespace kiln::os {

/// From now on, a request to end (Ctrl-C; SIGINT, SIGTERM, SIGHUP; a closed console) is recorded for interrupted(). A
/// third of a second later, or at a second request, `on_deadline` is called, in a signal handler or on another
/// thread. Writing to a closed pipe, or beyond the file size limit, becomes an error that does not end the process.
void catch_interrupts(void (*on_deadline)()) noexcept;
/// True after a request to end.
bool interrupted() noexcept;

/// From now on, `on_crash` is called if the program crashes or aborts, in a signal handler on the faulting thread.
/// Existing handlers are kept.
void catch_crashes(void (*on_crash)(int number)) noexcept;
/// True if the handler of catch_crashes() is installed for a signal.
bool handles_crash(int number) noexcept;
/// True for the number with which `on_crash` is called after an abort().
bool is_abort(int number) noexcept;
/// Ends the process by the crash for which `on_crash` was called, in the same way as if no handler were installed.
void end_by_crash(int number) noexcept;
/// Blocks this thread forever, while another one ends the process.
[[noreturn]] void block_forever() noexcept;

/// A number above 0 that identifies this thread among all running threads. Async-signal-safe.
std::int64_t thread_number() noexcept;
/// True on the main thread. Async-signal-safe.
bool on_main_thread() noexcept;

}  // namespace kiln::os
