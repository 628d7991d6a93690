#include "crash.h"

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>

#include "base/file.h"
#include "base/process.h"
#include "base/signals.h"
#include "base/terminal.h"
#include "cl/driver_state.h"
#include "commands.h"
#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln::cli {
namespace {

// Environment variable of a repeated run: "1" for the second try, "2" for the third, which uses an empty kernel cache.
constexpr const char* kRetryVariable = "KILN_RETRY";

int tries_before = 0;
bool may_retry = false;
// Number of the thread that handles a crash; 0 if none does
std::atomic<std::int64_t> crashed_thread{0};
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

void write_error(const char* text) { os::write_error(text); }

int read_tries() {
  const char* repeats = std::getenv(kRetryVariable);
  return repeats == nullptr ? 0 : *repeats == '1' ? 1 : 2;
}

void prepare_retry(char** argv) {
  tries_before = read_tries();
  os::prepare_restart(argv, std::string(kRetryVariable) + "=" + std::to_string(tries_before + 1));
  may_retry = os::can_restart() && tries_before < 2;
}

constexpr const char* kDriverCrashedText =
    "kiln: The OpenCL driver crashed; see the lines above for a reason. Otherwise it may have run "
    "out of memory, or PoCL's kernel cache is damaged or its disk full: remove the cache, or set "
    "POCL_CACHE_DIR to another folder.\n";

constexpr const char* kNoLinker =
    "kiln: The OpenCL driver failed: PoCL links kernels with the program 'ld', which is not in "
    "PATH. Install it (apt install binutils), or add its folder to PATH.\n";
bool has_linker = true;

constexpr const char* kNoTopology =
    "kiln: The OpenCL driver failed: PoCL needs /sys to detect the processors, but it is not "
    "mounted. Mount it (mount -t sysfs sys /sys).\n";
bool has_topology = true;

// Message for systems on which the process cannot restart itself (Windows), where PoCL is rare.
constexpr const char* kCrashedOnce =
    "kiln: The OpenCL driver crashed; see the lines above for a reason. Otherwise it may have run "
    "out of memory. Run the command again, or update the driver.\n";

/// Ends the process after a crash in a map that the user has defined, which runs as native code. Reads no thread-local
/// state, since the map may have overwritten the thread's stack.
[[noreturn]] void end_after_own_map_crash(const char* name) {
  write_error("kiln: The map ");
  write_error(name);
  write_error(
      " crashed the driver or its compiler. Possible causes are recursion, arrays larger than a "
      "thread's stack, accesses beyond an array, division of integers by 0, and expressions with "
      "too many terms. Correct its function.\n");
  os::end_process(static_cast<int>(ErrorCode::input));
}

[[noreturn]] void end_after_driver_crash() {
  write_error(!os::can_restart() ? kCrashedOnce
              : !has_topology    ? kNoTopology
              : !has_linker      ? kNoLinker
                                 : kDriverCrashedText);
  os::end_process(static_cast<int>(ErrorCode::device));
}

void on_crash(int number) {
  std::int64_t first_thread = 0;
  if (!crashed_thread.compare_exchange_strong(first_thread, os::thread_number())) {
    if (first_thread == os::thread_number())
      os::end_process(static_cast<int>(ErrorCode::device));  // The crash handler itself has crashed
    // Two threads crashed at once: the first one ends the process, so this one waits.
    os::block_forever();
  }
  remove_temporary_files();
  if (const char* map = running_own_map()) end_after_own_map_crash(map);
  if (!in_driver() && os::on_main_thread()) {
    if (os::is_abort(number)) {
      write_error("kiln: Out of memory, or a library aborted: see the lines above.\n");
      os::end_process(static_cast<int>(ErrorCode::internal));
    }
    os::end_by_crash(number);
    return;
  }
  restart_after_crash();
  end_after_driver_crash();
}

/// Handles calls of exit() by LLVM within PoCL, which calls it if it cannot write a file.
void on_exit_in_driver() {
  if (!in_driver() && os::on_main_thread()) return;
  remove_temporary_files();
  if (const char* map = running_own_map()) end_after_own_map_crash(map);
  restart_after_crash();
  end_after_driver_crash();
}

/// Handles uncaught exceptions, which occur on threads of a driver or in noexcept functions.
[[noreturn]] void on_terminate() {
  remove_temporary_files();
  if (const char* map = running_own_map()) end_after_own_map_crash(map);
  if (in_driver() || !os::on_main_thread()) end_after_driver_crash();
  write_error("kiln: Out of memory, or an error occurred while another one was handled.\n");
  os::end_process(static_cast<int>(ErrorCode::internal));
}

}  // namespace

void restart_after_crash() noexcept {
  if (!may_retry || !has_linker || !has_topology) return;
  may_retry = false;
  write_error(tries_before == 1
                  ? "kiln: The OpenCL driver failed again; PoCL's kernel cache (POCL_CACHE_DIR) "
                    "may be damaged or its disk full. Trying once more with an empty cache.\n"
                  : "kiln: The OpenCL driver failed. Trying a second time.\n");
  os::restart();
}

void catch_crashes(char** argv) noexcept {
  prepare_retry(argv);
  if (os::can_restart()) {
    std::error_code error;
    has_linker = !os::programs_of_path("ld").empty();
    has_topology = std::filesystem::exists("/sys/devices/system/cpu", error);
  }
  std::set_terminate(on_terminate);
  if (std::atexit(on_exit_in_driver) != 0)
    write_error("kiln: The handler for exits could not be installed.\n");
  os::catch_crashes(on_crash);
}

bool retry_in_child(int& exit_code) {
  if (read_tries() != 2) return false;
  // The folder is created and removed in this process, so that no environment variable can name a folder to remove.
  const std::filesystem::path folder = os::create_temporary_folder("kiln-cache-");
  const bool has_folder = !folder.empty();
  os::SplitEnd end;
  if (has_folder && os::find_unsafe_level(folder).empty()) end = os::split_process();
  if (end.kind == os::SplitEnd::Kind::child) {
    os::set_environment_variable("POCL_CACHE_DIR", folder.string().c_str());
    // This cache is removed after the run, so storing binaries of kernels in it would be useless.
    os::set_environment_variable("KILN_KEEP_BINARIES", "0");
    return false;
  }
  exit_code = end.exit_code;
  std::error_code error;
  if (end.kind == os::SplitEnd::Kind::failed) {
    write_error(kDriverCrashedText);
    exit_code = static_cast<int>(ErrorCode::device);
  }
  if (has_folder) std::filesystem::remove_all(folder, error);
  return true;
}

}  // namespace kiln::cli
