// The kiln-lab program, for comparisons and studies of matches. `kiln chart`, `kiln measure` and `kiln gallery` run it.
#include "program.h"

int main(int argc, char** argv) {
  using namespace kiln::cli;
  constexpr CommandEntry kCommands[] = {
      {"measure", add_measure}, {"chart", add_chart}, {"gallery", add_gallery}};
  return program_main(argc, argv, kCommands);
}
