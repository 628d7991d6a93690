// Handles interrupts such as Ctrl-C.
#pragma once

namespace kiln::cli {

/// Installs the handlers for interrupts (SIGINT, SIGTERM, SIGHUP; on Windows Ctrl-C, Ctrl-Break and a closed console).
/// An interrupt sets a flag that the work polls, and the work gets a third of a second to end. Then the process removes
/// its temporary files and exits with status 130. Outputs that are being moved to their destinations are completed
/// first.
void catch_interrupts();

bool interrupted();

constexpr int kExitCancelled = 130;

}  // namespace kiln::cli
