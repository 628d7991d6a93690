# Warnings for our own targets, through an interface target that is never exported.
add_library(kiln_warnings INTERFACE)
target_compile_options(kiln_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-qual -Wunused
  -Woverloaded-virtual -Wformat=2
  $<$<BOOL:${KILN_WERROR}>:-Werror>)

# KILN_SANITIZE=address;undefined and the like, for all of our own targets.
add_library(kiln_sanitizers INTERFACE)
if(KILN_SANITIZE)
  string(REPLACE ";" "," kiln_sanitizer_list "${KILN_SANITIZE}")
  target_compile_options(kiln_sanitizers INTERFACE
    -fsanitize=${kiln_sanitizer_list} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(kiln_sanitizers INTERFACE -fsanitize=${kiln_sanitizer_list})
endif()
