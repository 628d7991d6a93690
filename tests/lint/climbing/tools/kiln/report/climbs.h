#include "arguments/command_line.h"
