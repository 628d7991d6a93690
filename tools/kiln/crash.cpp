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
#include "kiln/files.h"
#include "kiln/kiln.h"

namespace kiln::cli {
namespace {

// In the environment of a run that was begun anew: "1" as it was, "2" with an empty cache.
constexpr const char* kRetry = "KILN_RETRY";

int tries_before = 0;
bool may_retry = false;
std::atomic<std::int64_t> handling{0};  // the thread whose crash is handled
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

void say(const char* text) { os::write_error(text); }

int read_tries() {
  const char* tries = std::getenv(kRetry);
  return tries == nullptr ? 0 : *tries == '1' ? 1 : 2;
}

void prepare_retry(char** argv) {
  tries_before = read_tries();
  os::prepare_restart(argv, std::string(kRetry) + "=" + std::to_string(tries_before + 1));
  may_retry = os::can_restart() && tries_before < 2;
}

constexpr const char* kCrashed =
    "kiln: The OpenCL driver crashed; lines above may say why. Else memory may have run out within "
    "it, or "
    "PoCL's cache of kernels is damaged or on a full disk: remove it, or set POCL_CACHE_DIR to "
    "another folder.\n";

constexpr const char* kNoLinker =
    "kiln: The OpenCL driver gave up: PoCL links kernels with the program 'ld', and no folder of "
    "PATH has one. "
    "Install it (apt install binutils), or add its folder to PATH.\n";
bool has_linker = true;

constexpr const char* kNoTopology =
    "kiln: The OpenCL driver gave up: PoCL reads from /sys which processors there are, and it is "
    "not mounted here. "
    "Mount it (mount -t sysfs sys /sys).\n";
bool has_topology = true;

// For drivers of Windows, among which PoCL is rare.
constexpr const char* kCrashedOnce =
    "kiln: The OpenCL driver crashed; lines above may say why. Else memory may have run out within "
    "it. Kiln begins a run anew by itself on Linux alone: run it once more, or update the "
    "driver.\n";

/// Maps of the user's are native code. None of the thread's own state is asked for: the map may have written over it.
[[noreturn]] void end_by_own_map(const char* name) {
  say("kiln: The map ");
  say(name);
  say(" made the driver crash, or its compiler: recursion, arrays larger than its threads' stack, "
      "places beyond an array, division of integers by 0, or expressions of too many terms. Mend "
      "its function.\n");
  os::end_process(static_cast<int>(ErrorCode::input));
}

[[noreturn]] void end_by_driver() {
  say(!os::can_restart() ? kCrashedOnce
      : !has_topology    ? kNoTopology
      : !has_linker      ? kNoLinker
                         : kCrashed);
  os::end_process(static_cast<int>(ErrorCode::device));
}

void on_crash(int number) {
  std::int64_t first = 0;
  if (!handling.compare_exchange_strong(first, os::thread_number())) {
    if (first == os::thread_number())
      os::end_process(static_cast<int>(ErrorCode::device));  // within the handler
    os::stop_thread();  // on two threads at once: the first ends the process
  }
  remove_temporary_files();
  if (const char* map = running_own_map()) end_by_own_map(map);
  if (!in_driver() && os::on_main_thread()) {
    if (os::is_abort(number)) {
      say("kiln: Memory ran out, or a library gave up: see the lines above.\n");
      os::end_process(static_cast<int>(ErrorCode::internal));
    }
    os::crash_unhandled(number);
    return;
  }
  retry();
  end_by_driver();
}

/// LLVM within PoCL ends the process by exit() where it cannot write.
void on_exit_within() {
  if (!in_driver() && os::on_main_thread()) return;
  remove_temporary_files();
  if (const char* map = running_own_map()) end_by_own_map(map);
  retry();
  end_by_driver();
}

/// Handles uncaught exceptions: on a driver's thread, or in a noexcept function.
[[noreturn]] void on_terminate() {
  remove_temporary_files();
  if (const char* map = running_own_map()) end_by_own_map(map);
  if (in_driver() || !os::on_main_thread()) end_by_driver();
  say("kiln: Memory ran out, or an error came while another was handled.\n");
  os::end_process(static_cast<int>(ErrorCode::internal));
}

}  // namespace

void retry() noexcept {
  if (!may_retry || !has_linker || !has_topology) return;
  may_retry = false;
  say(tries_before == 1 ? "kiln: The OpenCL driver failed again; PoCL's cache of kernels "
                          "(POCL_CACHE_DIR) may be damaged or its disk full. Trying once more with "
                          "an empty one.\n"
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
  if (std::atexit(on_exit_within) != 0) say("kiln: A handler could not be set.\n");
  os::catch_crashes(on_crash);
}

bool supervised(int& exit_code) {
  if (read_tries() != 2) return false;
  // Made here, and removed here: no variable names a folder that is removed.
  const std::filesystem::path folder = os::create_temporary_folder("kiln-cache-");
  const bool made = !folder.empty();
  os::SplitEnd end;
  if (made && os::shared_level(folder).empty()) end = os::split_process();
  if (end.kind == os::SplitEnd::Kind::copy) {
    os::set_variable("POCL_CACHE_DIR", folder.string().c_str());
    // What is thrown away is not worth compiling twice.
    os::set_variable("KILN_KEEP_BINARIES", "0");
    return false;
  }
  exit_code = end.exit_code;
  std::error_code error;
  if (end.kind == os::SplitEnd::Kind::failed) {
    say(kCrashed);
    exit_code = static_cast<int>(ErrorCode::device);
  }
  if (made) std::filesystem::remove_all(folder, error);
  return true;
}

}  // namespace kiln::cli
