// The `kiln` program. Commands for comparisons and studies are in a program of their own, kiln-lab.
#include "commands.h"
#include "program.h"

int main(int argc, char** argv) {
  using namespace kiln::cli;
  if (const char* command = requested_lab_command(argc, argv)) return run_lab(command, argv);
  constexpr CommandEntry kCommands[] = {
      {"bake", add_bake},     {"run", add_run},        {"simplify", add_simplify},
      {"render", add_render}, {"measure", nullptr},    {"chart", nullptr},
      {"gallery", nullptr},   {"diff", add_diff},      {"view", add_view},
      {"volume", add_volume}, {"devices", add_devices}};
  return program_main(argc, argv, kCommands);
}
