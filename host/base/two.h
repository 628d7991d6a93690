// Two numbers in a register: the compilers' vector extension.
#pragma once

namespace kiln {

using Two = double __attribute__((vector_size(16)));

}  // namespace kiln
