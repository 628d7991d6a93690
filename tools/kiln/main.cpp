// The kiln command: parses, runs a subcommand, turns errors into the documented exit codes.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <new>
#include <string>

#include "commands.h"
#include "interrupt.h"
#include "kiln/kiln.h"

int main(int argc, char** argv) {
  using namespace kiln;
  // PoCL installs a process-wide handler for arithmetic traps; ours to decide, so not wanted.
  setenv("POCL_SIGFPE_HANDLER", "0", 0);
  cli::catch_interrupts();

  CLI::App app("Kiln bakes the detail of dense meshes into the textures of light ones.", "kiln");
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
  commands["diff"] = cli::add_diff(app);
  commands["devices"] = cli::add_devices(app);

  try {
    // CLI11 would say only that a command is missing.
    if (argc > 1 && argv[1][0] != '-' && commands.count(argv[1]) == 0) {
      std::string known;
      for (const auto& [name, run] : commands) known += (known.empty() ? "" : ", ") + name;
      throw CLI::ValidationError(
          "", "there is no command '" + std::string(argv[1]) + "'; there are " + known);
    }
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "kiln: %s\n", error.what());
    std::fprintf(stderr, "Run 'kiln --help' or 'kiln COMMAND --help' for what is accepted.\n");
    return static_cast<int>(ErrorCode::usage);
  }
  try {
    return commands.at(app.get_subcommands().front()->get_name())();
  } catch (const Error& error) {
    std::fprintf(stderr, "kiln: %s\n", error.what());
    return static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    std::fprintf(
        stderr, "kiln: Memory ran out. Use a smaller --size, fewer --samples or a lighter mesh.\n");
    return static_cast<int>(ErrorCode::internal);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kiln: %s\n", error.what());
    return static_cast<int>(ErrorCode::internal);
  }
}
