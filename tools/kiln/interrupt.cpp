#include "interrupt.h"

#include "base/signals.h"
#include "base/terminal.h"
#include "kiln/files.h"

namespace kiln::cli {
namespace {

void on_deadline() {
  // The moves of outputs to their destinations are completed first.
  if (is_committing_outputs()) return;
  remove_temporary_files();
  os::write_error("\nCancelled.\n");
  os::end_process(kExitCancelled);
}

}  // namespace

void catch_interrupts() { os::catch_interrupts(on_deadline); }

bool interrupted() { return os::interrupted(); }

}  // namespace kiln::cli
