// The kiln command: parses, runs a subcommand, turns errors into the documented exit codes.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <map>
#include <new>
#include <string>
#include <vector>

#include "arguments/memory_option.h"
#include "arguments/unknown_flags.h"
#include "commands.h"
#include "crash.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "report/flags.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

int cancelled() {
  std::fputs("\nCancelled.\n", stderr);
  return kiln::cli::kExitCancelled;
}

void check_environment() {
  const char* threads = std::getenv("KILN_THREADS");
  if (threads == nullptr) return;
  char* end = nullptr;
  const long value = std::strtol(threads, &end, 10);
  if (end == threads || *end != '\0' || value < 1 || value > 1024) {
    throw CLI::ParseError(
        "KILN_THREADS is '" + std::string(threads) + "': set it to 1 to 1024, or unset it",
        CLI::ExitCodes::ValidationError);
  }
}

/// What was wrong, with what to do where an option is unknown.
std::string usage_message(CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  CLI::App& command = chosen.empty() ? app : *chosen.front();
  for (const std::string& word : app.remaining(true)) {
    if (!word.starts_with("-")) continue;
    return kiln::cli::answer_to_unknown(command, word);
  }
  return error.what();
}

/// Memory that was used is used again, rather than given back and asked for: a quarter of the page faults of a
/// bake were of pages that it had had before.
void keep_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

/// All that may throw.
int run(int argc, char** argv) {
  using namespace kiln;
  CLI::App app("Kiln bakes the detail of high polys into the textures of low polys.", "kiln");
  app.set_version_flag("--version", std::string("kiln ") + version());
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 beyond the limits (diff) or a defect, 2 usage, 3 input, 4 device,\n"
      "5 output, 130 cancelled. 'kiln COMMAND --help' explains a command.");
  std::map<std::string, cli::Run> commands;
  commands["bake"] = cli::add_bake(app);
  commands["simplify"] = cli::add_simplify(app);
  commands["render"] = cli::add_render(app);
  commands["measure"] = cli::add_measure(app);
  commands["chart"] = cli::add_chart(app);
  commands["gallery"] = cli::add_gallery(app);
  commands["diff"] = cli::add_diff(app);
  commands["volume"] = cli::add_volume(app);
  commands["devices"] = cli::add_devices(app);
  cli::add_memory_option(app);

  try {
    // `kiln help COMMAND` as in git.
    std::vector<std::string> words(argv + 1, argv + argc);
    if (!words.empty() && words[0] == "help") {
      words.erase(words.begin());
      if (words.size() > 1) words.resize(1);
      words.push_back("--help");
    }
    // CLI11 would say only that a command is missing.
    if (!words.empty() && !words[0].starts_with('-') && commands.count(words[0]) == 0) {
      std::string known;
      for (const auto& [name, run] : commands) known += (known.empty() ? "" : ", ") + name;
      throw CLI::ParseError("there is no command '" + words[0] + "'; there are " + known,
                            CLI::ExitCodes::ValidationError);
    }
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    app.parse(words);
    for (const CLI::Option* option : app.get_subcommands().front()->get_options()) {
      for (const std::string& value : option->results()) {
        if (value.empty()) {
          throw CLI::ParseError(
              option->get_name() + " was given nothing: leave it out, or give a value",
              CLI::ExitCodes::ValidationError);
        }
      }
    }
    check_environment();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "kiln: %s\n", usage_message(app, error).c_str());
    std::fprintf(stderr, "Run 'kiln --help' or 'kiln COMMAND --help' for what is accepted.\n");
    return static_cast<int>(ErrorCode::usage);
  }
  // Whatever ends the run: a folder that was made for nothing goes.
  struct Tidy {
    bool success = false;
    ~Tidy() {
      if (!success) remove_empty_output_folders();
    }
  } tidy;
  try {
    OutputSet outputs;
    const int result = commands.at(app.get_subcommands().front()->get_name())();
    if (result == cli::kExitCancelled) return cancelled();
    // First: where it fails, no file appears.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      throw Error(ErrorCode::output,
                  "Standard output could not be written: the disk is full, or it "
                  "was closed.");
    }
    outputs.commit();
    tidy.success = result == 0;
    return result;
  } catch (const Error& error) {
    // A driver that is interrupted while it compiles fails in its own way.
    if (cli::interrupted()) return cancelled();
    // What the message of a kernel that PoCL did not build says.
    if (std::strstr(error.what(), "PoCL's cache of kernels") != nullptr) {
      cli::retry();
    }
    std::fprintf(stderr, "kiln: %s\n", cli::with_flags(error.what()).c_str());
    return static_cast<int>(error.code());
  }
}

}  // namespace

int main(int argc, char** argv) {
  using namespace kiln;
  // PoCL installs a process-wide handler for arithmetic traps; ours to decide, so not wanted.
  setenv("POCL_SIGFPE_HANDLER", "0", 0);
  int exit_code = static_cast<int>(ErrorCode::internal);
  try {
    if (cli::supervised(exit_code)) return exit_code;
    keep_memory();
    cli::catch_crashes(argv);
    cli::catch_interrupts();
    exit_code = run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("kiln: Memory ran out. Use a smaller --size, fewer --samples or a lighter mesh.\n",
               stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kiln: %s\n", error.what());
  }
  if (driver_failed()) {
    // Its handlers at exit would wait for locks that it holds for good.
    std::fflush(nullptr);
    _exit(exit_code);
  }
  return exit_code;
}
