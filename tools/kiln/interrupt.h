// Ctrl-C.
#pragma once

namespace kiln::cli {

/// From now on an interrupt (SIGINT, SIGTERM, SIGHUP; on Windows
/// Ctrl-C, Ctrl-Break and a closed console) sets a flag that the work polls; the work has
/// a third of a second to end. Then the process removes its temporary files and exits with 130.
/// Outputs that are being put in place are finished first.
void catch_interrupts();

bool interrupted();

constexpr int kExitCancelled = 130;

}  // namespace kiln::cli
