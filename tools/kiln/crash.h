// Handling of crashes in OpenCL drivers: exceptions on the driver's threads, aborts, and invalid memory accesses.
#pragma once

namespace kiln::cli {

/// If a driver crashes, one message is written and nothing unfinished is left behind. The exit
/// code is that of a device. Memory or files may have been short for a moment: the run is begun
/// once more as it was. PoCL crashes, too, where its cache of kernels is damaged or on a full disk:
/// where the second run fails, a third has an empty cache of its own. All kernels are compiled
/// again for it. A crash of Kiln's own stays a crash.
/// \param argv  of main(), kept
void catch_crashes(char** argv) noexcept;

/// Begins the run anew: first as it was, then with an empty cache of PoCL's. Does nothing where both were
/// done, or cannot be.
void retry() noexcept;

/// In a run that was begun anew for the second time: makes an empty cache, runs the command as a child, waits for it and
/// removes that cache.
/// \returns true where the run is over; \param exit_code  is its exit code then
bool supervised(int& exit_code);

}  // namespace kiln::cli
