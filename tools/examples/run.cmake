# Runs an example and checks its output; see example() in CMakeLists.txt.
cmake_policy(VERSION 3.25)

file(READ ${SOURCE} text)
string(REGEX REPLACE "[][;]" "." text "${text}")  # replaces characters that CMake lists and quoting treat specially
string(REGEX MATCHALL "[^\n]*[^ \t\n][^\n]*" lines "${text}")
list(FILTER lines EXCLUDE REGEX "^[ \t]*//")
list(LENGTH lines count)
if(count GREATER MOST_LINES)
  message(FATAL_ERROR "${SOURCE} has ${count} lines of code: at most ${MOST_LINES} are promised.")
endif()
execute_process(COMMAND ${PROGRAM} ${ARGUMENTS} RESULT_VARIABLE status OUTPUT_VARIABLE output
  ERROR_VARIABLE errors)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} failed (${status}):\n${output}${errors}")
endif()
if(NOT output MATCHES "${PATTERN}")
  message(FATAL_ERROR "${PROGRAM} says:\n${output}and not ${PATTERN}")
endif()
message(STATUS "${count} lines; ${output}")
