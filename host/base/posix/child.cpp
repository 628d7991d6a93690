#include "base/child.h"

#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>

#include "base/progress_guard.h"

namespace kiln {

namespace {

using Clock = std::chrono::steady_clock;
// ratio of the wall-clock limit to the limit of processor time: on a busy machine, a process may get a tenth of a
// processor
constexpr std::uint64_t kWallClockFactor = 10;

/// Size of this process's address space, on Linux; 0: unknown.
rlim_t address_space() {
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  unsigned long address_space_pages = 0;
  const bool has_read = std::fscanf(file, "%lu", &address_space_pages) == 1;
  std::fclose(file);
  return has_read ? rlim_t{address_space_pages} * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) : 0;
}

/// Runs in the child: executes the work within limits, writes its result, and exits.
[[noreturn]] void work_and_exit(const ChildLimits& limits, const std::function<std::string()>& work,
                                int to) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  std::set_terminate([] { _exit(1); });
  const int null_device = open("/dev/null", O_WRONLY);
  if (null_device >= 0) dup2(null_device, STDERR_FILENO);  // the C library's messages are discarded
  const auto limit = [](auto what, rlim_t most) {
    const rlimit equal_limits{most, most};
    setrlimit(what, &equal_limits);
  };
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.seconds);
  if (const rlim_t now = address_space(); now != 0) limit(RLIMIT_AS, now + limits.bytes);
  std::string answer_text;
  try {
    answer_text = work();
  } catch (...) {
    answer_text = "it takes too much memory";
  }
#ifdef __GLIBC__
  // Traverses the allocator's free blocks: if the work has corrupted the heap, the child crashes here, so that its
  // result is not used.
  malloc_trim(0);
#endif
  const bool is_written =
      write(to, answer_text.data(), answer_text.size()) == static_cast<ssize_t>(answer_text.size());
  _exit(is_written ? 0 : 1);
}

}  // namespace

ChildEnd run_in_child(const ChildLimits& limits, const std::function<std::string()>& work,
                      std::string& returned) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) return ChildEnd::not_run;
  const pid_t child = fork();
  if (child == 0) work_and_exit(limits, work, pipe_ends[1]);
  close(pipe_ends[1]);
  std::exception_ptr cancellation;
  const auto kill_child = [&] {
    if (child > 0) kill(child, SIGKILL);
  };
  const auto end = Clock::now() + std::chrono::seconds(kWallClockFactor * limits.seconds);
  char part[512];
  for (;;) {
    pollfd answer_pipe{pipe_ends[0], POLLIN, 0};
    constexpr int kPollMilliseconds = 50;
    const int ready = poll(&answer_pipe, 1, kPollMilliseconds);
    if (Clock::now() > end) kill_child();
    if (ready == 0 || (ready < 0 && errno == EINTR)) {
      try {
        if (!cancellation) ProgressGuard::poll();
      } catch (...) {
        cancellation = std::current_exception();
        kill_child();
      }
      continue;
    }
    const ssize_t count = read(pipe_ends[0], part, sizeof part);
    if (count > 0) returned.append(part, static_cast<std::size_t>(count));
    if (count == 0 || (count < 0 && errno != EINTR)) break;
  }
  close(pipe_ends[0]);
  if (child < 0) return ChildEnd::not_run;
  int exit_status = 0;
  pid_t ended_process = 0;
  do {
    ended_process = waitpid(child, &exit_status, 0);
  } while (ended_process < 0 && errno == EINTR);
  if (cancellation) std::rethrow_exception(cancellation);
  // A program's handler may turn abort() into an exit, so any exit status other than 0 counts as a crash.
  if (ended_process != child || (WIFEXITED(exit_status) && WEXITSTATUS(exit_status) == 0))
    return ChildEnd::finished;
  const bool has_timed_out = WIFSIGNALED(exit_status) &&
                             (WTERMSIG(exit_status) == SIGXCPU || WTERMSIG(exit_status) == SIGKILL);
  return has_timed_out ? ChildEnd::timed_out : ChildEnd::crashed;
}

}  // namespace kiln
