#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <string>
#include <string_view>

#include "base/file.h"
#include "base/memory.h"
#include "base/process.h"
#include "base/system_memory.h"
#include "base/terminal.h"
#include "cl/driver_state.h"
#include "crash.h"
#include "interrupt.h"
#include "kiln/files.h"
#include "kiln/option_error.h"
#include "kiln/reasons.h"
#include "program.h"
#include "report/console.h"

namespace {

using kiln::cli::UsageError;

int cancelled() {
  std::fputs("\nCancelled.\n", stderr);
  return kiln::cli::kExitCancelled;
}

/// Sets the OpenCL driver in a package of Kiln (tools/package), if there is one, as the driver for machines without
/// any.
void set_packaged_driver() {
  std::array<char, 4096> folder{};
  kiln::os::own_folder(folder);
  std::error_code error;
  const auto driver = std::filesystem::path(folder.data()) / "lib/kiln_cpu/lib/libpocl.so";
  if (folder[0] == '\0' || std::getenv("KILN_OPENCL_DRIVER") != nullptr) return;
  if (std::filesystem::exists(driver, error))
    kiln::os::set_environment_variable("KILN_OPENCL_DRIVER", driver.string().c_str());
}

/// Parses and runs the command line. Exceptions other than UsageError and Error are left to the caller.
int run_words(int argc, char** argv, std::span<const kiln::cli::CommandEntry> commands) {
  using namespace kiln;
  cli::Program program(commands);
  cli::Run command;
  try {
    command = program.parse({argv + 1, argv + argc});
    if (!command) return 0;  // parse() has printed help or the version
  } catch (const UsageError& error) {
    cli::print_line(stderr, "kiln: " + program.explain(error));
    cli::print_line(stderr, "Run 'kiln --help' or 'kiln COMMAND --help' for the accepted options.");
    return static_cast<int>(ErrorCode::usage);
  }
  // Removes empty folders that the run created, however it ends.
  struct FolderCleanup {
    bool has_succeeded = false;
    ~FolderCleanup() {
      if (!has_succeeded) remove_empty_output_folders();
    }
  } folder_cleanup;
  try {
    OutputSet outputs;
    const int result = command();
    if (result == cli::kExitCancelled) return cancelled();
    // Standard output is closed first: if that fails, no file is moved to its destination.
    cli::finish_output();
    outputs.commit();
    folder_cleanup.has_succeeded = result == 0;
    return result;
  } catch (const Error& error) {
    // An interrupt during the compilation of a kernel appears as an error of the driver.
    if (cli::interrupted()) return cancelled();
    if (std::string_view(error.id()) == "kernel-cache") cli::restart_after_crash();
    cli::print_line(stderr, "kiln: " + error.message().text(option_as_flag));
    return static_cast<int>(error.code());
  }
}

}  // namespace

int kiln::cli::run_program(int argc, char** argv, std::span<const CommandEntry> commands) {
  try {
    return run_words(argc, argv, commands);
  } catch (const std::bad_alloc&) {
    std::fputs(
        "kiln: Out of memory, or --memory-limit was reached. Use a smaller --size, fewer "
        "--samples or a "
        "lighter mesh, or raise --memory-limit.\n",
        stderr);
  } catch (const std::exception& error) {
    cli::print_line(stderr, std::string("kiln: ") + error.what());
  }
  return static_cast<int>(ErrorCode::internal);
}

int kiln::cli::program_main(int argc, char** argv, std::span<const CommandEntry> commands) {
  os::read_arguments(argc, argv);
  if (!os::reserve_streams()) {
    std::fputs(
        "kiln: The standard output, input or error stream is closed, and /dev/null does not open "
        "in its place.\n",
        stderr);
    return static_cast<int>(ErrorCode::output);
  }
  os::prepare_streams();
  // Without this variable, PoCL would install a process-wide handler for arithmetic traps.
  if (std::getenv("POCL_SIGFPE_HANDLER") == nullptr)
    os::set_environment_variable("POCL_SIGFPE_HANDLER", "0");
  int exit_code = static_cast<int>(ErrorCode::internal);
  if (cli::retry_in_child(exit_code)) return exit_code;
  set_packaged_driver();
  os::keep_free_blocks();
  obey_memory_limit();
  cli::catch_crashes(argv);
  cli::catch_interrupts();
  exit_code = run_program(argc, argv, commands);
  if (driver_failed()) {
    // Skips the driver's exit handlers, which would wait forever for locks that the driver still
    // holds.
    std::fflush(nullptr);
    os::end_process(exit_code);
  }
  return exit_code;
}
