#include "support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "support/environment.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Processor seconds of a process so far, over all of its threads.
double processor_seconds(pid_t program) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(program, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool is_time_to_interrupt(pid_t program, const ProcessOptions& options) {
  if (options.interrupt_when && options.interrupt_when()) return true;
  return options.interrupt_after_processor_seconds >= 0 &&
         processor_seconds(program) >= options.interrupt_after_processor_seconds;
}

[[noreturn]] void become(const std::vector<std::string>& command, const ProcessOptions& options,
                         int out, int err) {
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  close(STDIN_FILENO);
  for (const auto& [name, value] : options.environment) setenv(name.c_str(), value.c_str(), 1);
  if (options.file_size_limit != 0) {
    const rlimit limit{options.file_size_limit, options.file_size_limit};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  execvp(words[0], words.data());
  _exit(127);
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& command, const ProcessOptions& options) {
  std::array<int, 2> out{}, err{};
  // O_CLOEXEC keeps the pipes out of programs that another thread starts meanwhile, which would keep them open.
  if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("pipe");
  }
  const double start = now();
  const pid_t child = fork();
  if (child == 0) {
    close(out[0]);
    close(err[0]);
    become(command, options, out[1], err[1]);
  }
  close(out[1]);
  close(err[1]);
  ProcessResult result;
  std::array<pollfd, 2> streams{pollfd{out[0], POLLIN, 0}, pollfd{err[0], POLLIN, 0}};
  int open_streams = 2;
  double signalled = -1;
  while (open_streams > 0) {
    poll(streams.data(), streams.size(), 5);
    for (std::size_t i = 0; i < 2; ++i) {
      if (streams[i].fd < 0 || streams[i].revents == 0) continue;
      std::array<char, 65536> buffer{};
      const ssize_t got = read(streams[i].fd, buffer.data(), buffer.size());
      if (got > 0) {
        (i == 0 ? result.output : result.errors)
            .append(buffer.data(), static_cast<std::size_t>(got));
      } else {
        streams[i].fd = -1;
        --open_streams;
      }
    }
    const double elapsed = now() - start;
    if (signalled < 0 && is_time_to_interrupt(child, options)) {
      kill(child, options.signal);
      signalled = now();
    }
    if (elapsed > options.timeout_seconds) kill(child, SIGKILL);
  }
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  result.peak_bytes = static_cast<std::uint64_t>(used.ru_maxrss) << 10;
  close(out[0]);
  close(err[0]);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.seconds = now() - start;
  if (signalled >= 0) result.seconds_after_signal = now() - signalled;
  return result;
}

ProcessResult run_kiln(std::vector<std::string> arguments, const ProcessOptions& options) {
  arguments.insert(arguments.begin(), kiln_command());
  return run_process(arguments, options);
}

bool only_warnings(const std::string& errors) {
  std::istringstream lines(errors);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("warning: ")) return false;
  }
  return true;
}

std::string path_without(const std::string& program) {
  static std::map<std::string, std::string> made;
  std::string& path = made[program];
  if (!path.empty()) return path;
  const fs::path links = scratch_folder();
  const char* set = std::getenv("PATH");
  std::istringstream folders(set == nullptr ? "/usr/bin:/bin" : set);
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code unreadable;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, unreadable)) {
      const fs::path name = entry.path().filename();
      // the program was found in an earlier folder of PATH, which takes precedence
      std::error_code taken;
      if (name != program) fs::create_symlink(fs::absolute(entry.path()), links / name, taken);
    }
  }
  return path = links.string();
}

ProcessOptions without_python() {
  ProcessOptions options;
  options.environment = {{"PATH", path_without("python3")}};
  return options;
}

std::string found_program(const std::string& name) {
  const std::string found = run_process({"/bin/sh", "-c", "command -v \"$1\"", "sh", name}).output;
  return found.substr(0, found.find('\n'));
}

std::string folder_with(const std::string& name, const std::string& script) {
  const fs::path file = scratch_folder() / name;
  std::ofstream(file) << "#!/bin/sh\n" << script << "\n";
  fs::permissions(file, fs::perms::owner_all);
  return file.parent_path().string();
}

bool has_matplotlib() {
  static const bool found = [] {
    constexpr const char* kScript =
        "IFS=:; for folder in $PATH; do \"$folder/python3\" -c 'import importlib.util, sys; "
        "sys.exit(importlib.util.find_spec(\"matplotlib\") is None)' 2>/dev/null && exit 0; done; "
        "exit 1";
    return run_process({"/bin/sh", "-c", kScript}).exit_code == 0;
  }();
  return found;
}

}  // namespace kiln::test
