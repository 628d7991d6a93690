// The commands that faults are tried on: each with the smallest inputs for which it does all that it does.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kiln::test {

/// Number of tries of a command where nobody asks for a number of points.
enum class Often { always, once, never };

struct FaultCommand {
  const char* name;
  /// Its words after "kiln". \param in  a folder of fault_inputs() \param out  that of its outputs
  std::vector<std::string> (*words)(const std::filesystem::path& in,
                                    const std::filesystem::path& out);
  Often often = Often::always;
  /// Each run finds no kept binaries of kernels, so that PoCL reads their sources again.
  bool without_binaries = false;
};

/// Every command of kiln's, those with ways of their own to write several times.
const std::vector<FaultCommand>& fault_commands();

/// A new folder with what they read.
std::filesystem::path fault_inputs();

}  // namespace kiln::test
