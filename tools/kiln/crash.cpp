#include "crash.h"

#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/file.h"
#include "cl/driver_state.h"
#include "commands.h"
#include "kiln/files.h"
#include "kiln/kiln.h"

namespace kiln::cli {
namespace {

// In the environment of a run that was begun anew: "1" as it was, "2" with an empty cache.
constexpr const char* kRetry = "KILN_RETRY";

// All that a handler needs, made before: nothing can be allocated in one.
constexpr std::size_t kMostVariables = 4096;
std::array<char*, kMostVariables + 2> environment;
char retry_variable[] = "KILN_RETRY=0";
char** arguments = nullptr;
int tries_before = 0;
bool may_retry = false;
std::atomic<pid_t> handling{0};  // the thread whose crash is handled
static_assert(std::atomic<pid_t>::is_always_lock_free);
constexpr std::array kSignals = {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE, SIGTRAP};
std::array<bool, kSignals.size()> handled{};

void say(const char* text) {
  [[maybe_unused]] const auto ignored = write(STDERR_FILENO, text, std::strlen(text));
}

bool is_variable(const char* entry, const char* name) {
  const std::size_t size = std::strlen(name);
  return std::strncmp(entry, name, size) == 0 && entry[size] == '=';
}

int read_tries() {
  const char* tries = std::getenv(kRetry);
  return tries == nullptr ? 0 : *tries == '1' ? 1 : 2;
}

void prepare_retry(char** argv) {
  tries_before = read_tries();
  std::size_t count = 0;
  for (char** entry = environ; *entry != nullptr && count < kMostVariables; ++entry) {
    if (!is_variable(*entry, kRetry)) environment[count++] = *entry;
  }
  retry_variable[std::strlen(kRetry) + 1] = static_cast<char>('1' + tries_before);
  environment[count++] = retry_variable;
  environment[count] = nullptr;
  arguments = argv;
  may_retry = tries_before < 2;
}

pid_t this_thread() { return static_cast<pid_t>(syscall(SYS_gettid)); }
/// The thread that main() runs on.
bool on_main_thread() { return this_thread() == getpid(); }

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

/// True if a folder of PATH has a program `ld`.
bool find_linker() {
  const char* path = std::getenv("PATH");
  for (std::string_view left = path == nullptr ? "" : path; !left.empty();) {
    const std::size_t size = std::min(left.find(':'), left.size());
    const std::string file = std::string(left.substr(0, size)) + "/ld";
    if (access(file.c_str(), X_OK) == 0) return true;
    left.remove_prefix(std::min(size + 1, left.size()));
  }
  return false;
}

/// Maps of the user's are native code. None of the thread's own state is asked for: the map may have written over it.
[[noreturn]] void end_by_own_map(const char* name) {
  say("kiln: The map ");
  say(name);
  say(" made the driver crash, or its compiler: recursion, arrays larger than its threads' stack, "
      "places beyond an array, division of integers by 0, or expressions of too many terms. Mend "
      "its function.\n");
  _exit(static_cast<int>(ErrorCode::input));
}

[[noreturn]] void end_by_driver() {
  say(!has_topology ? kNoTopology : !has_linker ? kNoLinker : kCrashed);
  _exit(static_cast<int>(ErrorCode::device));
}

extern "C" void on_crash(int number) {
  pid_t first = 0;
  if (!handling.compare_exchange_strong(first, this_thread())) {
    if (first == this_thread()) _exit(static_cast<int>(ErrorCode::device));  // within the handler
    for (;;) pause();  // on two threads at once: the first ends the process
  }
  remove_temporary_files();
  if (const char* map = running_own_map()) end_by_own_map(map);
  if (!in_driver() && on_main_thread()) {
    if (number == SIGABRT) {
      say("kiln: Memory ran out, or a library gave up: see the lines above.\n");
      _exit(static_cast<int>(ErrorCode::internal));
    }
    signal(number, SIG_DFL);
    raise(number);
    return;
  }
  retry();
  end_by_driver();
}

/// LLVM within PoCL ends the process by exit() where it cannot write.
void on_exit_within() {
  if (!in_driver() && on_main_thread()) return;
  remove_temporary_files();
  if (const char* map = running_own_map()) end_by_own_map(map);
  retry();
  end_by_driver();
}

/// Handles uncaught exceptions: on a driver's thread, or in a noexcept function.
[[noreturn]] void on_terminate() {
  remove_temporary_files();
  if (const char* map = running_own_map()) end_by_own_map(map);
  if (in_driver() || !on_main_thread()) end_by_driver();
  say("kiln: Memory ran out, or an error came while another was handled.\n");
  _exit(static_cast<int>(ErrorCode::internal));
}

pid_t child = -1;
extern "C" void pass_on(int number) {
  if (child > 0) kill(child, number);
}

}  // namespace

void retry() noexcept {
  if (!may_retry || !has_linker || !has_topology) return;
  may_retry = false;
  say(tries_before == 1 ? "kiln: The OpenCL driver failed again; PoCL's cache of kernels "
                          "(POCL_CACHE_DIR) may be damaged or its disk full. Trying once more with "
                          "an empty one.\n"
                        : "kiln: The OpenCL driver failed. Trying a second time.\n");
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execve("/proc/self/exe", arguments, environment.data());
}

void catch_crashes(char** argv) noexcept {
  prepare_retry(argv);
  has_linker = find_linker();
  has_topology = access("/sys/devices/system/cpu", F_OK) == 0;
  std::set_terminate(on_terminate);
  if (std::atexit(on_exit_within) != 0) say("kiln: A handler could not be set.\n");
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction before {};
    // A sanitizer's or a parent's is the better one.
    if (sigaction(kSignals[i], nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    struct sigaction action {};
    action.sa_handler = on_crash;
    action.sa_flags = SA_NODEFER | SA_ONSTACK;
    handled[i] = sigaction(kSignals[i], &action, nullptr) == 0;
  }
}

bool handles_crash(int number) noexcept {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    if (kSignals[i] == number) return handled[i];
  }
  return false;
}

bool supervised(int& exit_code) {
  if (read_tries() != 2) return false;
  // Made here, and removed here: no variable names a folder that is removed.
  std::string folder = os::temporary_folder() / "kiln-cache-XXXXXX";
  const bool made = mkdtemp(folder.data()) != nullptr;
  if (made && os::shared_level(folder).empty()) child = fork();
  if (child == 0) {
    os::set_variable("POCL_CACHE_DIR", folder.c_str());
    os::set_variable("KILN_KEEP_BINARIES",
                     "0");  // what is thrown away is not worth compiling twice
    return false;
  }
  if (child < 0) {
    if (made) rmdir(folder.c_str());
    say(kCrashed);
    exit_code = static_cast<int>(ErrorCode::device);
    return true;
  }
  signal(SIGINT, SIG_IGN);  // a terminal's goes to both
  signal(SIGTERM, pass_on);
  signal(SIGHUP, pass_on);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  return true;
}

}  // namespace kiln::cli
