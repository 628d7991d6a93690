# The manual's examples run: each line of each block tagged sh, one after another, in one fresh folder. And
# each command has one.
#
# Run as: cmake -DREADME=tools/kiln/README.md -DKILN=<kiln> -DSAMPLE=<kiln_sample> -DWORK=<scratch folder>
#               -P manual.cmake
cmake_policy(VERSION 3.25)

file(REAL_PATH "${KILN}" kiln)
file(REAL_PATH "${SAMPLE}" sample)
file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}/bin" "${WORK}/examples")
file(CREATE_LINK "${kiln}" "${WORK}/bin/kiln" SYMBOLIC)
file(CREATE_LINK "${sample}" "${WORK}/bin/kiln_sample" SYMBOLIC)
file(REAL_PATH "${WORK}/bin" programs)
find_program(sh sh REQUIRED)
find_program(linker ld)
if(linker)
  file(CREATE_LINK "${linker}" "${WORK}/bin/ld" SYMBOLIC)  # PoCL links kernels by it
endif()
# No python3 among them: pictures of data, a second each, are drawn where ChartCommand, MeasureCommand and cli/plot look
# at them.
set(ENV{PATH} "${programs}")

execute_process(COMMAND "${kiln}" devices RESULT_VARIABLE status OUTPUT_QUIET ERROR_QUIET)
if(status EQUAL 4 AND NOT DEFINED ENV{CI})
  message(STATUS "skipped: no OpenCL device")
  return()
endif()

# No lists of lines: brackets and semicolons would join and part them.
file(READ "${README}" rest)
set(number 0)  # of the line
set(inside OFF)
set(command "")
set(examples "\n")
while(NOT rest STREQUAL "")
  math(EXPR number "${number} + 1")
  string(FIND "${rest}" "\n" end)
  if(end EQUAL -1)
    set(line "${rest}")
    set(rest "")
  else()
    string(SUBSTRING "${rest}" 0 ${end} line)
    math(EXPR end "${end} + 1")
    string(SUBSTRING "${rest}" ${end} -1 rest)
  endif()
  if(line STREQUAL "```sh")
    set(inside ON)
    continue()
  elseif(line MATCHES "^```")
    set(inside OFF)
    continue()
  elseif(NOT inside OR line STREQUAL "" OR line MATCHES "^#")
    continue()
  endif()
  string(APPEND command "${line}\n")
  if(line MATCHES "\\\\$")
    continue()  # goes on in the next line
  endif()
  # What a device's kernels are tuned to stays out of the cache that tests share.
  unset(own_cache)
  if(command MATCHES " --tune")
    file(MAKE_DIRECTORY "${WORK}/cache")
    file(CHMOD "${WORK}/cache" PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
    set(own_cache ${CMAKE_COMMAND} -E env "POCL_CACHE_DIR=${WORK}/cache")
  endif()
  execute_process(COMMAND ${own_cache} ${sh} -e -c "${command}" WORKING_DIRECTORY "${WORK}/examples"
    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${README}:${number}: this example fails (${status}):\n${command}${output}")
  endif()
  message(STATUS "${number}: ${line}")
  string(APPEND examples "${command}")
  set(command "")
endwhile()

execute_process(COMMAND "${kiln}" --help OUTPUT_VARIABLE help)
string(REGEX MATCHALL "\n  [a-z]+ " names "${help}")
if(names STREQUAL "")
  message(FATAL_ERROR "'kiln --help' lists no commands:\n${help}")
endif()
foreach(name IN LISTS names)
  string(STRIP "${name}" name)
  if(NOT examples MATCHES "\nkiln ${name}[ \n]")
    message(FATAL_ERROR "${README} has no example of 'kiln ${name}'")
  endif()
endforeach()
