#include "picture/plot.h"

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
#include <cstdlib>
#include <cstring>
#include <future>
#include <sstream>
#include <string_view>
#include <utility>

#include "interrupt.h"
#include "kiln/error.h"
#include "kiln/files.h"

extern char** environ;

namespace kiln::cli {
struct RunningProgram::Process {
  /// Both ends are closed with it.
  struct Pipe {
    int read_end = -1, write_end = -1;
    Pipe() {
      int ends[2];
      if (pipe2(ends, O_CLOEXEC) == 0) read_end = ends[0], write_end = ends[1];
    }
    ~Pipe() {
      close_end(read_end);
      close_end(write_end);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    static void close_end(int& end) {
      if (end >= 0) close(end);
      end = -1;
    }
  };

  pid_t id = 0;  ///< 0: has ended
  Pipe input, output, errors;
  std::string given;                   ///< To its standard input
  std::future<ProgramResult> working;  ///< From begin() on

  ~Process() {
    if (id != 0) kill(id, SIGKILL);
    if (working.valid()) working.wait();
    wait();
  }
  bool exchange(std::string_view left, double limit_seconds, ProgramResult& result);
  /// \returns its status, once it has ended
  int wait() {
    int status = 0;
    if (id == 0) return status;
    while (waitpid(id, &status, 0) < 0 && errno == EINTR) continue;
    id = 0;
    return status;
  }
};

namespace {

constexpr int kNice = 5;

[[noreturn]] void not_started(const std::string& program, int error) {
  throw Error(ErrorCode::internal,
              "The program " + program + " could not be started: " + std::strerror(error) + ".");
}

}  // namespace

/// Writes to it and reads from it until it closes both: in turn, so that no pipe fills up and stops either.
/// \param left  what is to be written
/// \returns false where it took too long, or was interrupted
bool RunningProgram::Process::exchange(std::string_view left, double limit_seconds,
                                       ProgramResult& result) {
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_seconds);
  const std::array<std::string*, 2> texts = {&result.output, &result.errors};
  std::array<char, 65536> buffer;
  fcntl(input.write_end, F_SETFL, O_NONBLOCK);
  std::array<int*, 2> ends = {&output.read_end, &errors.read_end};
  while (*ends[0] >= 0 || *ends[1] >= 0) {
    if (left.empty()) Pipe::close_end(input.write_end);
    std::array<pollfd, 3> polled = {
        {{*ends[0], POLLIN, 0}, {*ends[1], POLLIN, 0}, {input.write_end, POLLOUT, 0}}};
    constexpr int kMilliseconds = 100;
    const int ready = poll(polled.data(), polled.size(), kMilliseconds);
    if (interrupted() || std::chrono::steady_clock::now() > deadline) return false;
    if (ready < 0 && errno != EINTR) break;
    if (ready <= 0) continue;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (*ends[i] < 0 || polled[i].revents == 0) continue;
      const ssize_t count = read(*ends[i], buffer.data(), buffer.size());
      if (count > 0) {
        texts[i]->append(buffer.data(), static_cast<std::size_t>(count));
      } else if (count == 0 || errno != EINTR) {
        Pipe::close_end(*ends[i]);
      }
    }
    if (input.write_end < 0 || polled[2].revents == 0) continue;
    const ssize_t count = write(input.write_end, left.data(), left.size());
    if (count > 0) {
      left.remove_prefix(static_cast<std::size_t>(count));
    } else if (count < 0 && errno != EINTR && errno != EAGAIN) {
      left = {};  // It does not read any more.
    }
  }
  return true;
}

RunningProgram::RunningProgram(std::unique_ptr<Process> process) : process_(std::move(process)) {}
RunningProgram::RunningProgram(RunningProgram&&) noexcept = default;
RunningProgram& RunningProgram::operator=(RunningProgram&&) noexcept = default;
RunningProgram::~RunningProgram() = default;

std::optional<RunningProgram> RunningProgram::start(std::vector<std::string> command,
                                                    const std::filesystem::path& folder) {
  auto process = std::make_unique<Process>();
  for (const Process::Pipe* pipe : {&process->input, &process->output, &process->errors}) {
    if (pipe->read_end < 0) not_started(command[0], errno);
  }
  std::vector<char*> arguments;
  for (std::string& argument : command) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, process->input.read_end, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, process->output.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, process->errors.write_end, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  // Signals that we ignore (see catch_interrupts) the program should not.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t defaults;
  sigemptyset(&defaults);
  sigaddset(&defaults, SIGPIPE);
  sigaddset(&defaults, SIGXFSZ);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  pid_t id = 0;
  const int status =
      posix_spawnp(&id, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (status == ENOENT || status == EACCES || status == ENOTDIR) return std::nullopt;
  if (status != 0) not_started(command[0], status);
  // Whoever starts it works meanwhile, and should not wait for it.
  setpriority(PRIO_PROCESS, static_cast<id_t>(id), kNice);
  process->id = id;
  Process::Pipe::close_end(process->input.read_end);
  Process::Pipe::close_end(process->output.write_end);
  Process::Pipe::close_end(process->errors.write_end);
  return RunningProgram(std::move(process));
}

void RunningProgram::begin(std::string input, double limit_seconds) {
  process_->given = std::move(input);
  process_->working = std::async(std::launch::async, [process = process_.get(), limit_seconds] {
    ProgramResult result;
    if (!process->exchange(process->given, limit_seconds, result)) {
      kill(process->id, SIGKILL);
      result.errors += "stopped after " + std::to_string(std::lround(limit_seconds)) + " seconds";
    }
    return result;
  });
}

bool RunningProgram::began() const { return process_->working.valid(); }

bool RunningProgram::began_with(std::string_view input) const {
  return began() && process_->given == input;
}

ProgramResult RunningProgram::finish() {
  ProgramResult result = process_->working.get();
  const int ended = process_->wait();
  result.exit_code = WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
  return result;
}

extern const char kPlotScript[];  // picture/plot.py, by CMakeLists.txt

namespace {

namespace fs = std::filesystem;

constexpr int kNoMatplotlib = 69;      // the script's exit code
constexpr double kLimitSeconds = 300;  // matplotlib's first run lists all fonts
constexpr const char* kScriptName = "kiln_plot.py";

}  // namespace

Json plot_panel(const std::string& y_title) {
  return {{"y_title", y_title},
          {"curves", Json::array()},
          {"levels", Json::array()},
          {"rings", {{"title", ""}, {"x", Json::array()}, {"y", Json::array()}}}};
}

Json ticks_around(double least, double most) {
  Json ticks = Json::array();
  double tick = 1.0 / 256;
  while (4 * tick <= least) tick *= 4;
  for (; ticks.size() < 2 || ticks.back().number() < most; tick *= 4) ticks.push_back(tick);
  return ticks;
}

std::vector<std::string> plot_files(const std::string& name) {
  return {name + "_plot.json", name + ".png", kScriptName};
}

std::optional<RunningProgram> start_python() {
  const char* set = std::getenv("PATH");
  std::istringstream folders(set == nullptr ? "/usr/bin:/bin" : set);
  // The first one's place, and what it goes on to where it has no matplotlib.
  std::vector<std::string> command = {"", "-c", kPlotScript, "-", "-"};
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path python = fs::path(folder) / "python3";
    if (folder.empty() || access(python.c_str(), X_OK) != 0) continue;
    command.front().empty() ? command.front() = python : command.emplace_back(python);
  }
  if (command.front().empty()) return std::nullopt;
  // Not in the plot's folder: Python would take a json.py there for its own.
  return RunningProgram::start(std::move(command), "/");
}

void begin_plot(RunningProgram& python, const Plot& plot) {
  python.begin(plot.data.dump(), kLimitSeconds);
}

bool save_plots(const fs::path& folder, const std::vector<Plot>& plots,
                std::vector<std::string>& outputs, std::vector<Warning>& warnings,
                std::optional<RunningProgram> python) {
  std::string by_hand;
  for (const Plot& plot : plots) {
    const auto saved = [&](const std::string& file) {
      outputs.push_back((folder / file).string());
      return folder / file;
    };
    save_text(saved(plot.name + "_plot.json"), plot.data.dump(1) + "\n");
    const std::string command = std::string("python3 ") + kScriptName + " " + plot.name +
                                "_plot.json " + plot.name + ".png";
    // If Python fails for one plot, it fails for all.
    std::optional<ProgramResult> result;
    const std::string text = plot.data.dump();
    if (python && python->began() && !python->began_with(text)) python.reset();
    if (by_hand.empty() && !python) python = start_python();
    if (by_hand.empty() && python) {
      if (!python->began()) python->begin(text, kLimitSeconds);
      result = python->finish();
    }
    python.reset();
    if (interrupted()) return false;
    if (result && result->exit_code == kNoMatplotlib) result.reset();
    constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";
    if (!result) {
      by_hand += (by_hand.empty() ? "" : " && ") + command;
    } else if (result->exit_code != 0 || result->output.substr(0, kPng.size()) != kPng) {
      std::string reason = result->errors;
      std::replace(reason.begin(), reason.end(), '\n', ' ');
      warnings.push_back({"no-plot",
                          plot.name + ".png is not drawn: Python ended with exit code " +
                              std::to_string(result->exit_code) + ": " + reason,
                          1});
    } else {
      save_text(saved(plot.name + ".png"), result->output);
    }
  }
  if (!by_hand.empty()) {
    save_text(folder / kScriptName, kPlotScript);
    outputs.push_back((folder / kScriptName).string());
    warnings.push_back({"no-plot",
                        "Python with matplotlib is not installed, so there is no picture: install "
                        "the package python3-matplotlib, then run '" +
                            by_hand + "' in " + folder.string() + ".",
                        1});
  }
  return true;
}

}  // namespace kiln::cli
