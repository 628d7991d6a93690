# The README's program is tests/package/main.cpp, which is built and run.
#
# Run as: cmake -DREADME=README.md -DPROGRAM=tests/package/main.cpp -P readme.cmake
cmake_policy(VERSION 3.25)

file(READ "${README}" readme)
file(READ "${PROGRAM}" program)
set(opening "<!-- tests/package/main.cpp -->\n```cpp\n")
string(FIND "${readme}" "${opening}" start)
if(start EQUAL -1)
  message(FATAL_ERROR "README.md has no block marked '<!-- tests/package/main.cpp -->'")
endif()
string(LENGTH "${opening}" length)
math(EXPR start "${start} + ${length}")
string(SUBSTRING "${readme}" ${start} -1 rest)
string(FIND "${rest}" "```" end)
string(SUBSTRING "${rest}" 0 ${end} block)
if(NOT block STREQUAL program)
  message(FATAL_ERROR "README.md's program differs from tests/package/main.cpp:\n${block}")
endif()
