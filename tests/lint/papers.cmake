# Fails where tests/README.md names a test, `Suite.Name`, that no file of tests/ has.
#
# Run as: cmake -DTESTS=<this repository's tests/> -DREADME=<the page> -P papers.cmake
cmake_policy(VERSION 3.25)

set(known "")
file(GLOB_RECURSE files ${TESTS}/*_test.cpp)
foreach(file IN LISTS files)
  file(READ ${file} text)
  string(REGEX MATCHALL "TEST(_P|_F)?\\([A-Za-z0-9]+,[ \n]*[A-Za-z0-9]+\\)" tests "${text}")
  foreach(test IN LISTS tests)
    string(REGEX REPLACE "TEST(_P|_F)?\\(([A-Za-z0-9]+),[ \n]*([A-Za-z0-9]+)\\)" "\\2.\\3" name
      "${test}")
    list(APPEND known ${name})
  endforeach()
endforeach()

file(READ ${README} page)
string(REGEX MATCHALL "`[A-Z][A-Za-z0-9]+\\.[A-Z][A-Za-z0-9]+`" named "${page}")
set(missing "")
foreach(name IN LISTS named)
  string(REPLACE "`" "" name "${name}")
  if(NOT name IN_LIST known)
    string(APPEND missing "${README} names ${name}, which is no test\n")
  endif()
endforeach()
list(LENGTH named count)
if(count EQUAL 0)
  message(FATAL_ERROR "${README} names no test")
elseif(NOT missing STREQUAL "")
  message(FATAL_ERROR "${missing}")
endif()
message(STATUS "${count} tests named")
