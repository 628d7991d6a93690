#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "commands.h"
#include "kiln/error.h"

namespace kiln::cli {
namespace {

constexpr const char* kInstalled = KILN_INSTALLED_PROGRAMS;

using Path = std::array<char, PATH_MAX>;

/// The folder of this program, with a stroke; empty where the system does not say.
Path own_folder() {
  Path path{};
  if (readlink("/proc/self/exe", path.data(), path.size() - 1) < 0) return {};
  char* const stroke = std::strrchr(path.data(), '/');
  if (stroke != nullptr) stroke[1] = '\0';
  return path;
}

}  // namespace

const char* asked_of_lab(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    // Flags before the command (--help, --version) and the word `help` belong to the program.
    if (word.starts_with('-') || (i == 1 && word == "help")) continue;
    const auto is_it = [&](const auto& command) { return command[0] == word; };
    return std::any_of(kLabCommands.begin(), kLabCommands.end(), is_it) ? argv[i] : nullptr;
  }
  return nullptr;
}

// No memory is taken here: whatever fails, kiln-lab does or does not start.
int run_lab(const char* command, char** argv) {
  Path beside{}, installed{}, cache{}, built{};
  const Path folder = own_folder();
  std::snprintf(beside.data(), beside.size(), "%.4000skiln-lab", folder.data());
  std::snprintf(installed.data(), installed.size(), "%.4000s/kiln-lab", kInstalled);
  if (folder[0] == '\0') beside = installed;
  int reason = ENOENT;
  for (const Path& program : {beside, installed}) {
    execv(program.data(), argv);
    if (errno != ENOENT) reason = errno;
  }
  std::fprintf(
      stderr, "kiln: %s is run by kiln-lab, which cannot be started, neither as %s nor as %s: %s. ",
      command, beside.data(), installed.data(), std::strerror(reason));
  std::snprintf(cache.data(), cache.size(), "%.4000s../../CMakeCache.txt", folder.data());
  if (realpath(cache.data(), built.data()) != nullptr) {
    *std::strrchr(built.data(), '/') = '\0';
    std::fprintf(stderr, "Build it: cmake --build %s --target kiln_lab\n", built.data());
  } else {
    std::fputs("Install it beside kiln.\n", stderr);
  }
  return static_cast<int>(ErrorCode::internal);
}

}  // namespace kiln::cli
