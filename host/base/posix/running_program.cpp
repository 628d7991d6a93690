#include "base/running_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <future>
#include <utility>

#include "kiln/error.h"

extern char** environ;

namespace kiln {
namespace {

// Maximum size of each of the two texts in ProgramResult
constexpr std::size_t kMaxTextBytes = std::size_t{64} << 20;

}  // namespace

struct RunningProgram::Process {
  /// A pipe; the destructor closes both ends.
  struct Pipe {
    int read_end = -1, write_end = -1;
    Pipe() {
      int ends[2];
      if (pipe2(ends, O_CLOEXEC) == 0) read_end = ends[0], write_end = ends[1];
    }
    ~Pipe() {
      close_descriptor(read_end);
      close_descriptor(write_end);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    static void close_descriptor(int& end) {
      if (end >= 0) close(end);
      end = -1;
    }
  };

  pid_t id = 0;  ///< process id; 0 after the program has ended
  Pipe input, output, errors;
  std::string input_bytes;                   ///< data for the program's standard input
  std::function<bool()> interrupted;         ///< the program is killed when this returns true
  std::future<ProgramResult> future_result;  ///< the running exchange; valid after begin()

  ~Process() {
    if (id != 0) kill(id, SIGKILL);
    if (future_result.valid()) future_result.wait();
    wait();
  }
  using Clock = std::chrono::steady_clock;
  bool exchange_data(std::string_view remaining, Clock::time_point deadline, ProgramResult& result);
  bool wait_until_ended(Clock::time_point deadline) const;
  /// True if the program has ended, even if other programs still hold its pipes open. The exit status is left for
  /// wait().
  bool has_ended() const {
    siginfo_t exit_status{};
    return waitid(P_PID, static_cast<id_t>(id), &exit_status, WEXITED | WNOHANG | WNOWAIT) != 0 ||
           exit_status.si_pid != 0;
  }
  /// Waits for the program. \returns its exit status
  int wait() {
    int status = 0;
    if (id == 0) return status;
    while (waitpid(id, &status, 0) < 0 && errno == EINTR) continue;
    id = 0;
    return status;
  }
};

namespace {

constexpr int kNiceIncrement = 5;

[[noreturn]] void throw_not_started(const std::string& program, int error) {
  throw Error(ErrorCode::internal,
              "The program " + program + " could not be started: " + std::strerror(error) + ".");
}

}  // namespace

/// Writes the program's input and reads its output until the program closes its pipes, or until it has ended although
/// another program that it started still holds them open. Writing and reading are interleaved, so that a full pipe
/// blocks neither process.
/// \param remaining the input that is to be written
/// \returns false on a timeout, or if it was interrupted
bool RunningProgram::Process::exchange_data(std::string_view remaining, Clock::time_point deadline,
                                            ProgramResult& result) {
  const std::array<std::string*, 2> texts = {&result.output, &result.errors};
  std::array<char, 65536> read_buffer;
  fcntl(input.write_end, F_SETFL, O_NONBLOCK);
  std::array<int*, 2> ends = {&output.read_end, &errors.read_end};
  while (*ends[0] >= 0 || *ends[1] >= 0) {
    if (remaining.empty()) Pipe::close_descriptor(input.write_end);
    std::array<pollfd, 3> poll_entries = {
        {{*ends[0], POLLIN, 0}, {*ends[1], POLLIN, 0}, {input.write_end, POLLOUT, 0}}};
    constexpr int kMilliseconds = 100;
    const int ready = poll(poll_entries.data(), poll_entries.size(), kMilliseconds);
    if (interrupted() || Clock::now() > deadline) return false;
    if (ready < 0 && errno != EINTR) break;
    if (ready == 0 && has_ended()) break;
    if (ready <= 0) continue;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (*ends[i] < 0 || poll_entries[i].revents == 0) continue;
      const ssize_t count = read(*ends[i], read_buffer.data(), read_buffer.size());
      if (count > 0) {
        // Further output is still read, so that the program can end, but discarded, so that it does not fill the
        // memory.
        const std::size_t free_bytes = kMaxTextBytes - std::min(kMaxTextBytes, texts[i]->size());
        texts[i]->append(read_buffer.data(), std::min(free_bytes, static_cast<std::size_t>(count)));
      } else if (count == 0 || errno != EINTR) {
        Pipe::close_descriptor(*ends[i]);
      }
    }
    if (input.write_end < 0 || poll_entries[2].revents == 0) continue;
    const ssize_t count = write(input.write_end, remaining.data(), remaining.size());
    if (count > 0) {
      remaining.remove_prefix(static_cast<std::size_t>(count));
    } else if (count < 0 && errno != EINTR && errno != EAGAIN) {
      remaining = {};  // the program has closed its input
    }
  }
  return true;
}

/// Waits for a program that may have closed its pipes without ending. \returns as exchange_data()
bool RunningProgram::Process::wait_until_ended(Clock::time_point deadline) const {
  constexpr int kMilliseconds = 2;
  while (!has_ended()) {
    if (interrupted() || Clock::now() > deadline) return false;
    poll(nullptr, 0, kMilliseconds);
  }
  return true;
}

RunningProgram::RunningProgram(std::unique_ptr<Process> process) : process_(std::move(process)) {}
RunningProgram::RunningProgram(RunningProgram&&) noexcept = default;
RunningProgram& RunningProgram::operator=(RunningProgram&&) noexcept = default;
RunningProgram::~RunningProgram() = default;

bool RunningProgram::is_supported() noexcept { return true; }

std::optional<RunningProgram> RunningProgram::start(std::vector<std::string> command,
                                                    const std::filesystem::path& folder) {
  auto process = std::make_unique<Process>();
  for (const Process::Pipe* pipe : {&process->input, &process->output, &process->errors}) {
    if (pipe->read_end < 0) throw_not_started(command[0], errno);
  }
  std::vector<char*> arguments;
  for (std::string& argument : command) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t file_actions;
  posix_spawn_file_actions_init(&file_actions);
  posix_spawn_file_actions_adddup2(&file_actions, process->input.read_end, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&file_actions, process->output.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&file_actions, process->errors.write_end, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&file_actions, folder.c_str());
  // Signals that this process ignores (catch_interrupts()) are reset to their defaults in the program.
  posix_spawnattr_t spawn_attributes;
  posix_spawnattr_init(&spawn_attributes);
  sigset_t default_signals;
  sigemptyset(&default_signals);
  sigaddset(&default_signals, SIGPIPE);
  sigaddset(&default_signals, SIGXFSZ);
  posix_spawnattr_setsigdefault(&spawn_attributes, &default_signals);
  posix_spawnattr_setflags(&spawn_attributes, POSIX_SPAWN_SETSIGDEF);
  pid_t id = 0;
  const int status =
      posix_spawnp(&id, arguments[0], &file_actions, &spawn_attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&file_actions);
  posix_spawnattr_destroy(&spawn_attributes);
  if (status == ENOENT || status == EACCES || status == ENOTDIR) return std::nullopt;
  if (status != 0) throw_not_started(command[0], status);
  // The program gets a lower priority than this process, which works at the same time.
  setpriority(PRIO_PROCESS, static_cast<id_t>(id), kNiceIncrement);
  process->id = id;
  Process::Pipe::close_descriptor(process->input.read_end);
  Process::Pipe::close_descriptor(process->output.write_end);
  Process::Pipe::close_descriptor(process->errors.write_end);
  return RunningProgram(std::move(process));
}

void RunningProgram::begin(std::string input, double limit_seconds,
                           std::function<bool()> interrupted) {
  process_->input_bytes = std::move(input);
  process_->interrupted = std::move(interrupted);
  process_->future_result =
      std::async(std::launch::async, [process = process_.get(), limit_seconds] {
        ProgramResult result;
        const auto deadline =
            Process::Clock::now() + std::chrono::duration_cast<Process::Clock::duration>(
                                        std::chrono::duration<double>(limit_seconds));
        if (!process->exchange_data(process->input_bytes, deadline, result) ||
            !process->wait_until_ended(deadline)) {
          kill(process->id, SIGKILL);
          result.errors += std::string(result.errors.empty() ? "" : " ") + "stopped after " +
                           std::to_string(std::lround(limit_seconds)) + " seconds";
        }
        return result;
      });
}

bool RunningProgram::has_begun() const { return process_->future_result.valid(); }

bool RunningProgram::has_begun_with_input(std::string_view input) const {
  return has_begun() && process_->input_bytes == input;
}

ProgramResult RunningProgram::finish() {
  ProgramResult result = process_->future_result.get();
  const int exit_status = process_->wait();
  result.exit_code =
      WIFEXITED(exit_status) ? WEXITSTATUS(exit_status) : 128 + WTERMSIG(exit_status);
  return result;
}

}  // namespace kiln
