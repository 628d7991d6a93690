#include "base/running_program.h"

namespace kiln {

struct RunningProgram::Process {};

RunningProgram::RunningProgram(std::unique_ptr<Process> process) : process_(std::move(process)) {}
RunningProgram::RunningProgram(RunningProgram&&) noexcept = default;
RunningProgram& RunningProgram::operator=(RunningProgram&&) noexcept = default;
RunningProgram::~RunningProgram() = default;

bool RunningProgram::is_supported() noexcept { return false; }
std::optional<RunningProgram> RunningProgram::start(std::vector<std::string> /*command*/,
                                                    const std::filesystem::path& /*folder*/) {
  return std::nullopt;
}

// RunningProgram is not supported on Windows, so these functions are never called.
void RunningProgram::begin(std::string /*input*/, double /*limit_seconds*/,
                           std::function<bool()> /*interrupted*/) {}
bool RunningProgram::has_begun() const { return false; }
bool RunningProgram::has_begun_with_input(std::string_view /*input*/) const { return false; }
ProgramResult RunningProgram::finish() { return {}; }

}  // namespace kiln
