#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "base/process.h"
#include "commands.h"
#include "kiln/error.h"

namespace kiln::cli {
namespace {

constexpr const char* kInstallFolder = KILN_INSTALLED_PROGRAMS;

using Path = std::array<char, 4096>;

}  // namespace

const char* requested_lab_command(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    // Flags before the command (--help, --version) and the word `help` are for this program.
    if (word.starts_with('-') || (i == 1 && word == "help")) continue;
    const auto has_name = [&](const auto& command) { return command[0] == word; };
    return std::any_of(kLabCommands.begin(), kLabCommands.end(), has_name) ? argv[i] : nullptr;
  }
  return nullptr;
}

// Allocates no memory before it has tried to start kiln-lab, which thus starts even if memory is short.
int run_lab(const char* command, char** argv) {
  Path folder{}, beside_program{}, installed{};
  os::own_folder(folder);
  std::snprintf(beside_program.data(), beside_program.size(), "%.4000skiln-lab", folder.data());
  std::snprintf(installed.data(), installed.size(), "%.4000s/kiln-lab", kInstallFolder);
  if (folder[0] == '\0') beside_program = installed;
  int start_error = ENOENT;
  for (const Path& program : {beside_program, installed}) {
    const int error = os::become_program(program.data(), argv);
    if (error != ENOENT) start_error = error;
  }
  if (start_error == ENOSYS) {
    std::fprintf(stderr,
                 "kiln: %s needs the program kiln-lab, which does not exist for this system: run "
                 "it on Linux.\n",
                 command);
    return static_cast<int>(ErrorCode::internal);
  }
  std::fprintf(
      stderr,
      "kiln: %s needs the program kiln-lab, which cannot be started, neither as %s nor as %s: %s. ",
      command, beside_program.data(), installed.data(), std::strerror(start_error));
  std::error_code error;
  const std::filesystem::path cache = std::filesystem::canonical(
      std::filesystem::path(folder.data()) / "../../CMakeCache.txt", error);
  if (!error) {
    std::fprintf(stderr, "Build it: cmake --build %s --target kiln_lab\n",
                 cache.parent_path().string().c_str());
  } else {
    std::fputs("Install it beside kiln.\n", stderr);
  }
  return static_cast<int>(ErrorCode::internal);
}

}  // namespace kiln::cli
