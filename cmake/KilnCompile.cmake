# Compile options of Kiln's own targets, as interface targets that are never exported.
add_library(kiln_warnings INTERFACE)
target_compile_options(kiln_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Wunused
  -Woverloaded-virtual -Wformat=2
  $<$<BOOL:${KILN_WERROR}>:-Werror>)
# GCC 12 gives false positives of these warnings in its own std::string (GCC bugs 105329, 105651, 105762).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(kiln_warnings INTERFACE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow
    -Wno-stringop-overread)
endif()

# KILN_SANITIZE, such as address;undefined, applies to all of Kiln's targets.
add_library(kiln_sanitizers INTERFACE)
if(KILN_SANITIZE)
  string(REPLACE ";" "," kiln_sanitizer_list "${KILN_SANITIZE}")
  target_compile_options(kiln_sanitizers INTERFACE
    -fsanitize=${kiln_sanitizer_list} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(kiln_sanitizers INTERFACE -fsanitize=${kiln_sanitizer_list})
endif()

# KILN_COVERAGE instruments the library for gcovr. Counters are not atomic, which would be several times slower: threads
# may lose counts, but a line that ran has a count above 0.
add_library(kiln_coverage INTERFACE)
if(KILN_COVERAGE)
  target_compile_options(kiln_coverage INTERFACE --coverage)
  target_link_options(kiln_sanitizers INTERFACE --coverage)
endif()

# Precompiled headers of the standard library, which take longer to parse than Kiln's own code. Names in <> make the
# generated header identical in every clone, so that all share compiler caches.
set(kiln_standard_headers <algorithm> <array> <atomic> <cmath> <cstdint> <cstdio> <cstring> <exception>
  <filesystem> <functional> <limits> <map> <memory> <mutex> <numeric> <optional> <span> <string>
  <string_view> <thread> <tuple> <utility> <variant> <vector>)
add_library(kiln_compile INTERFACE)
# GLM's vectors are those of host/ in double precision.
find_path(KILN_GLM_INCLUDE glm/glm.hpp DOC "Folder of GLM's headers" REQUIRED)
target_include_directories(kiln_compile SYSTEM INTERFACE ${KILN_GLM_INCLUDE})
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Compiler caches need this option to support precompiled headers.
  target_compile_options(kiln_compile INTERFACE -fpch-preprocess)
  # No garbage collection in the compiler below 1 GiB: saves 5% of its time for 20% more memory.
  target_compile_options(kiln_compile INTERFACE --param=ggc-min-heapsize=1048576)
  # When GCC 12 vectorises two neighbours, it omits the rounding from double to float and back. Results would differ
  # from other compilers, and checks of a low poly would see other vertices than its file has.
  target_compile_options(kiln_compile INTERFACE -fno-tree-slp-vectorize)
endif()
