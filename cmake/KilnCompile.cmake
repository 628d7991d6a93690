# How our own targets are compiled, through interface targets that are never exported: warnings.
add_library(kiln_warnings INTERFACE)
target_compile_options(kiln_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Wunused
  -Woverloaded-virtual -Wformat=2
  $<$<BOOL:${KILN_WERROR}>:-Werror>)
# GCC 12 finds these in its own std::string where nothing is wrong (GCC bugs 105329, 105651, 105762).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(kiln_warnings INTERFACE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow
    -Wno-stringop-overread)
endif()

# KILN_SANITIZE=address;undefined and the like, for all of our own targets.
add_library(kiln_sanitizers INTERFACE)
if(KILN_SANITIZE)
  string(REPLACE ";" "," kiln_sanitizer_list "${KILN_SANITIZE}")
  target_compile_options(kiln_sanitizers INTERFACE
    -fsanitize=${kiln_sanitizer_list} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(kiln_sanitizers INTERFACE -fsanitize=${kiln_sanitizer_list})
endif()

# KILN_COVERAGE: the library counts which of its lines run, for gcovr. Threads may lose counts to each other; a line
# that ran stays one that ran, and atomic counts take several times as long.
add_library(kiln_coverage INTERFACE)
if(KILN_COVERAGE)
  target_compile_options(kiln_coverage INTERFACE --coverage)
  target_link_options(kiln_sanitizers INTERFACE --coverage)
endif()

# Precompiled headers: the standard library's, which cost more to parse than our own code. Named by <>, so
# that the generated header is the same text in every clone and a compiler's cache serves them all.
set(kiln_standard_headers <algorithm> <array> <atomic> <cmath> <cstdint> <cstdio> <cstring> <exception>
  <filesystem> <functional> <limits> <map> <memory> <mutex> <numeric> <optional> <span> <string>
  <string_view> <thread> <tuple> <utility> <variant> <vector>)
add_library(kiln_compile INTERFACE)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Without it, caches of compilers cannot look into what was precompiled.
  target_compile_options(kiln_compile INTERFACE -fpch-preprocess)
  # The compiler collects no garbage below 1 GiB: a twentieth of its time, for a fifth more memory.
  target_compile_options(kiln_compile INTERFACE --param=ggc-min-heapsize=1048576)
  # GCC 12 takes two neighbours from double to float and back without rounding them, where it makes one vector of
  # both: other bytes than elsewhere, and a low poly whose checks saw other vertices than its file has.
  target_compile_options(kiln_compile INTERFACE -fno-tree-slp-vectorize)
endif()
