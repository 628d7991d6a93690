# What kiln.h costs a compiler beside the standard headers that it includes: CPU seconds, the least of several
# tries in turns. A ratio, since machines differ: at most four tenths of what the standard headers take. It says
# the milliseconds, of which 150 are the aim.
#
# Run as: cmake -DCXX=<compiler> -DHEADERS=<folder of kiln/kiln.h> -DWORK=<scratch folder> [-DTRIES=9]
#               -P header_cost.cmake
cmake_policy(VERSION 3.25)

find_program(SH sh)
if(NOT SH)
  message(STATUS "no sh: skipped")
  return()
endif()
if(NOT DEFINED TRIES)
  set(TRIES 9)
endif()
file(GLOB headers ${HEADERS}/kiln/*.h)
list(FILTER headers EXCLUDE REGEX "/opencl.h$")
set(standard "")
foreach(header IN LISTS headers)
  file(STRINGS ${header} lines REGEX "^#include <")
  list(APPEND standard ${lines})
endforeach()
list(REMOVE_DUPLICATES standard)
list(JOIN standard "\n" standard)
file(WRITE ${WORK}/standard.cpp "${standard}\n")
file(WRITE ${WORK}/kiln.cpp "${standard}\n#include <kiln/kiln.h>\n")

# Milliseconds of the user's CPU time, by the shell's own count of its children.
function(cost file result)
  execute_process(COMMAND ${SH} -c "\"$0\" -std=c++20 -fsyntax-only -I\"$1\" \"$2\" && times"
      ${CXX} ${HEADERS} ${file} OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCH "\n([0-9]+)m([0-9]+)[.,]([0-9][0-9])" found "${output}")
  if(NOT found)
    message(FATAL_ERROR "the shell's times are not understood: ${output}")
  endif()
  math(EXPR ms "(${CMAKE_MATCH_1} * 60 + ${CMAKE_MATCH_2}) * 1000 + 1${CMAKE_MATCH_3} * 10 - 1000")
  set(${result} ${ms} PARENT_SCOPE)
endfunction()

set(least_standard 1000000)
set(least_kiln 1000000)
foreach(try RANGE 1 ${TRIES})
  foreach(what standard kiln)
    cost(${WORK}/${what}.cpp ms)
    if(ms LESS least_${what})
      set(least_${what} ${ms})
    endif()
  endforeach()
endforeach()
math(EXPR own "${least_kiln} - ${least_standard}")
math(EXPR bound "${least_standard} * 4 / 10")
set(text "kiln.h: ${own} ms beside ${least_standard} ms of standard headers (${CXX})")
if(own GREATER bound)
  message(FATAL_ERROR "${text}: at most ${bound}")
endif()
message(STATUS "${text}")
