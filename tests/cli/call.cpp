#include "cli/call.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <list>
#include <optional>
#include <stdexcept>

#include "kiln/device.h"
#include "kiln/limits.h"
#include "program.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

bool within_call = false;

}  // namespace

// Calls of Device::open() go through this function (the linker's --wrap, tests/CMakeLists.txt). Commands share the tests'
// device: PoCL prepares every program anew for each context that is opened, a sixth of these tests' time.
Device open_device(std::string_view selector) asm(
    "__real__ZN4kiln6Device4openESt17basic_string_viewIcSt11char_traitsIcEE");
Device open_or_share_device(std::string_view selector) asm(
    "__wrap__ZN4kiln6Device4openESt17basic_string_viewIcSt11char_traitsIcEE");
Device open_or_share_device(std::string_view selector) {
  return within_call && selector.empty() ? *device() : open_device(selector);
}

namespace {

// kiln and kiln-lab, as one program.
constexpr cli::CommandEntry kCommands[] = {
    {"bake", cli::add_bake},       {"run", cli::add_run},         {"simplify", cli::add_simplify},
    {"render", cli::add_render},   {"measure", cli::add_measure}, {"chart", cli::add_chart},
    {"gallery", cli::add_gallery}, {"diff", cli::add_diff},       {"view", cli::add_view},
    {"volume", cli::add_volume},   {"devices", cli::add_devices}};

/// A stream of the process that goes to a file.
class Caught {
 public:
  explicit Caught(std::FILE* stream) : stream_(stream), file_(std::tmpfile()) {
    std::fflush(stream_);
    before_ = fcntl(fileno(stream_), F_DUPFD_CLOEXEC, 0);
    if (file_ == nullptr || before_ < 0 || dup2(fileno(file_), fileno(stream_)) < 0)
      throw std::runtime_error("a stream cannot be caught");
  }
  /// Gives the stream back. \returns what was written
  std::string end() {
    std::fflush(stream_);
    dup2(before_, fileno(stream_));
    close(before_);
    std::string text;
    std::rewind(file_);
    for (int c = 0; (c = std::getc(file_)) != EOF;) text += static_cast<char>(c);
    std::fclose(file_);
    return text;
  }

 private:
  std::FILE* stream_;
  std::FILE* file_;
  int before_;
};

/// A variable of the environment, until its end.
class Variable {
 public:
  Variable(const std::string& name, const std::string& value) : name_(name) {
    if (const char* const before = std::getenv(name.c_str())) before_ = before;
    setenv(name.c_str(), value.c_str(), 1);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;
  ~Variable() {
    if (before_) {
      setenv(name_.c_str(), before_->c_str(), 1);
    } else {
      unsetenv(name_.c_str());
    }
  }

 private:
  std::string name_;
  std::optional<std::string> before_;
};

}  // namespace

ProcessResult call_kiln(std::vector<std::string> arguments,
                        const std::map<std::string, std::string>& environment) {
  std::list<Variable> variables;
  for (const auto& [name, value] : environment) variables.emplace_back(name, value);
  arguments.insert(arguments.begin(), "kiln");
  std::vector<char*> words;
  for (std::string& word : arguments) words.push_back(word.data());
  words.push_back(nullptr);
  ProcessResult result;
  const bool shares = environment.count("KILN_DEVICE") == 0 && device() != nullptr;
  Caught output(stdout), errors(stderr);
  within_call = shares;
  result.exit_code = cli::run_program(static_cast<int>(arguments.size()), words.data(), kCommands);
  within_call = false;
  result.errors = errors.end();
  result.output = output.end();
  set_memory_limit(0);
  return result;
}

}  // namespace kiln::test
