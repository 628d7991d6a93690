// What a driver does in its despair: throw on a thread of its own, abort, or touch what is not there.
#pragma once

namespace kiln::cli {

/// Where a driver crashes, one message is written, nothing unfinished is left behind, and the exit code is
/// that of a device. PoCL does so where its cache of kernels is damaged or on a full disk: the run is
/// begun once more, with an empty cache of its own. A crash of Kiln's own stays a crash.
/// \param argv  of main(), kept
void catch_crashes(char** argv) noexcept;

/// Begins the run anew with an empty cache of PoCL's, where it has one and that was not done yet; else
/// does nothing.
void retry_with_empty_cache() noexcept;

/// In a run that was begun anew: runs the command as a child, waits for it and removes the empty cache.
/// \returns true where it did; \param exit_code  is the child's then
bool supervised(int& exit_code);

}  // namespace kiln::cli
