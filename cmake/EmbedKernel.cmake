# Flattens one OpenCL kernel and its includes into a C++ source, with #line marks and a depfile.
#
# Run as: cmake -DINPUT=kernels/accel/ray.cl -DROOT=kernels -DOUTPUT=ray.cpp -DDEPFILE=ray.d
#               -DFAMILY=ray -P EmbedKernel.cmake
#
# `#include "lib/x.clh"` is resolved against ROOT, once per file. Each line keeps its original file and line number, so
# that compiler messages and debuggers name the true place. Comment lines become empty and indentation is removed, which
# halves the text.
#
# The text is an array of literals of at most 12,000 bytes, ended by a null pointer and joined by host/cl/embedded.cpp:
# C++ compilers need not accept literals above 65,536 characters (16,380 bytes in MSVC), and adjacent literals count as one.

cmake_policy(VERSION 3.25)

set(dependencies "")
set(included "")
set(text "")

function(flatten file)
  if(file IN_LIST included)
    return()
  endif()
  list(APPEND included "${file}")
  set(path "${ROOT}/${file}")
  list(APPEND dependencies "${path}")
  file(READ "${path}" content)
  # Semicolons and brackets confuse CMake lists: hide them while splitting into lines.
  string(REPLACE "\\" "@KILN_BACKSLASH@" content "${content}")
  string(REPLACE ";" "@KILN_SEMICOLON@" content "${content}")
  string(REPLACE "[" "@KILN_OPEN@" content "${content}")
  string(REPLACE "]" "@KILN_CLOSE@" content "${content}")
  string(REPLACE "\n" ";" lines "${content}")
  set(number 0)
  string(APPEND text "#line 1 \"kernels/${file}\"\n")
  foreach(line IN LISTS lines)
    math(EXPR number "${number} + 1")
    if(line MATCHES "^[ \t]*#[ \t]*include[ \t]+\"([^\"]+)\"")
      flatten("${CMAKE_MATCH_1}")
      math(EXPR next "${number} + 1")
      string(APPEND text "#line ${next} \"kernels/${file}\"\n")
    elseif(line MATCHES "^[ \t]*//")
      string(APPEND text "\n")
    else()
      string(REGEX REPLACE "^[ \t]+" "" line "${line}")
      string(APPEND text "${line}\n")
    endif()
  endforeach()
  set(dependencies "${dependencies}" PARENT_SCOPE)
  set(included "${included}" PARENT_SCOPE)
  set(text "${text}" PARENT_SCOPE)
endfunction()

file(RELATIVE_PATH name "${ROOT}" "${INPUT}")
flatten("${name}")

string(REPLACE "@KILN_SEMICOLON@" ";" text "${text}")
string(REPLACE "@KILN_OPEN@" "[" text "${text}")
string(REPLACE "@KILN_CLOSE@" "]" text "${text}")
string(REPLACE "@KILN_BACKSLASH@" "\\" text "${text}")

# Raw string literals can contain any text except their end mark. Pieces end with a line, unless it is longer than they
# may be.
set(most 12000)
set(literals "")
string(LENGTH "${text}" length)
set(start 0)
while(start LESS length)
  string(SUBSTRING "${text}" ${start} ${most} piece)
  string(LENGTH "${piece}" taken)
  math(EXPR end "${start} + ${taken}")
  string(FIND "${piece}" "\n" last REVERSE)
  if(end LESS length AND last GREATER -1)
    math(EXPR taken "${last} + 1")
    string(SUBSTRING "${piece}" 0 ${taken} piece)
  endif()
  string(APPEND literals "    R\"KILN(${piece})KILN\",\n")
  math(EXPR start "${start} + ${taken}")
endwhile()

file(WRITE "${OUTPUT}.new"
  "// Generated from kernels/${name} by cmake/EmbedKernel.cmake.\n"
  "namespace kiln::ocl::embedded {\n"
  "extern const char* const ${FAMILY}[];\n"
  "const char* const ${FAMILY}[] = {\n${literals}    nullptr};\n"
  "}  // namespace kiln::ocl::embedded\n")
file(RENAME "${OUTPUT}.new" "${OUTPUT}")
string(REPLACE " " "\\ " dependencies "${dependencies}")
string(REPLACE " " "\\ " target "${OUTPUT}")
string(REPLACE ";" " \\\n  " dependency_text "${dependencies}")
file(WRITE "${DEPFILE}" "${target}: \\\n  ${dependency_text}\n")
