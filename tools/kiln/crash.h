// Handles crashes in OpenCL drivers: exceptions on the driver's threads, aborts, and invalid memory accesses.
#pragma once

namespace kiln::cli {

/// Installs the handlers. If a driver crashes, one message is printed, temporary files are removed, and the exit code
/// is that of device errors. Memory or disk space may have been short for a moment, so the run is repeated once without
/// changes. PoCL also crashes if its kernel cache is damaged or its disk is full, so a third run uses an empty cache of
/// its own, for which all kernels are compiled again. Crashes in Kiln's own code are not handled.
/// \param argv  argument of main(); must stay valid
void catch_crashes(char** argv) noexcept;

/// Restarts the run: first without changes, then with an empty cache of PoCL. Returns if both were done already, or if
/// the process cannot restart.
void restart_after_crash() noexcept;

/// In the third try, creates an empty kernel cache, runs the command in a child process, waits for it, and removes the
/// cache.
/// \param exit_code  receives the child's exit code if the result is true
/// \returns true if the run is over
bool retry_in_child(int& exit_code);

}  // namespace kiln::cli
