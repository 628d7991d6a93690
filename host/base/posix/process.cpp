#include "base/process.h"

#include <dlfcn.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>
#include <thread>

extern char** environ;

namespace kiln::os {

namespace fs = std::filesystem;

namespace {
constexpr const char* kOwnProgramPath = "/proc/self/exe";
}

void read_arguments(int& /*argc*/, char**& /*argv*/) {}

std::vector<std::string> own_arguments() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> arguments;
  for (std::string word; std::getline(in, word, '\0');) arguments.push_back(word);
  return arguments;
}

fs::path own_program() { return kOwnProgramPath; }

void own_folder(std::span<char> to) noexcept {
  const ssize_t size = readlink(kOwnProgramPath, to.data(), to.size());
  const bool is_whole = size >= 0 && static_cast<std::size_t>(size) < to.size();
  to[is_whole ? static_cast<std::size_t>(size) : 0] = '\0';
  char* const slash = std::strrchr(to.data(), '/');
  if (slash != nullptr) slash[1] = '\0';
}

std::vector<fs::path> programs_of_path(const std::string& name, const std::string& unset) {
  const char* const set = std::getenv("PATH");
  std::vector<fs::path> programs;
  for (std::string_view remaining = set == nullptr ? std::string_view(unset) : set;
       !remaining.empty();) {
    const std::size_t size = std::min(remaining.find(':'), remaining.size());
    const fs::path file = fs::path(remaining.substr(0, size)) / name;
    if (size != 0 && access(file.c_str(), X_OK) == 0) programs.push_back(file);
    remaining.remove_prefix(std::min(size + 1, remaining.size()));
  }
  return programs;
}

int become_program(const char* program, char** argv) noexcept {
  execv(program, argv);
  return errno;
}

bool run_own_program(const std::vector<std::string>& words,
                     const std::function<bool()>& interrupted) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t child = 0;
  if (posix_spawn(&child, kOwnProgramPath, nullptr, nullptr, arguments.data(), environ) != 0)
    return false;
  bool is_interrupt_sent = false;
  for (int status = 0; waitpid(child, &status, WNOHANG) == 0;) {
    if (interrupted() && !is_interrupt_sent) {
      kill(child, SIGINT);
      is_interrupt_sent = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

void* load_library(const std::string& path, std::string& reason) {
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) reason = dlerror();
  return library;
}

void* find_library_function(void* library, const char* name) noexcept {
  return dlsym(library, name);
}

namespace {

// Data that is prepared for the signal handler, since handlers must not allocate.
constexpr std::size_t kMaxVariables = 4096;
std::array<char*, kMaxVariables + 2> restart_environment;
std::array<char, 64> restart_variable{};
char** restart_arguments = nullptr;

pid_t child_process = -1;
extern "C" void forward_signal(int number) {
  if (child_process > 0) kill(child_process, number);
}

}  // namespace

bool can_restart() noexcept { return true; }

void prepare_restart(char** argv, const std::string& variable) {
  variable.copy(restart_variable.data(), restart_variable.size() - 1);
  const std::size_t name = variable.find('=') + 1;
  std::size_t count = 0;
  for (char** entry = environ; *entry != nullptr && count < kMaxVariables; ++entry) {
    if (std::strncmp(*entry, variable.c_str(), name) != 0) restart_environment[count++] = *entry;
  }
  restart_environment[count++] = restart_variable.data();
  restart_environment[count] = nullptr;
  restart_arguments = argv;
}

void restart() noexcept {
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execve(kOwnProgramPath, restart_arguments, restart_environment.data());
}

SplitEnd split_process() {
  child_process = fork();
  if (child_process == 0) return {SplitEnd::Kind::child, 0};
  if (child_process < 0) return {};
  signal(SIGINT, SIG_IGN);  // a terminal sends the signal to both processes
  signal(SIGTERM, forward_signal);
  signal(SIGHUP, forward_signal);
  int status = 0;
  while (waitpid(child_process, &status, 0) < 0 && errno == EINTR) {
  }
  return {SplitEnd::Kind::parent, WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
}

}  // namespace kiln::os
