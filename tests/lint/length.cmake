# Fails where a source is longer than a reader keeps in mind: C++, OpenCL C and CMake, headers among them.
#
# Run as: cmake -DROOT=<folder> -DLIMIT=<lines> -P length.cmake
cmake_policy(VERSION 3.25)

set(found "")
set(count 0)
file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/*.cpp ${ROOT}/*.h ${ROOT}/*.cl ${ROOT}/*.clh ${ROOT}/*.cmake
  ${ROOT}/CMakeLists.txt)
foreach(file IN LISTS files)
  if(file MATCHES "^(build|out|[.])")
    continue()
  endif()
  math(EXPR count "${count} + 1")
  file(READ ${ROOT}/${file} text)
  string(REGEX REPLACE "[^\n]+" "" text "${text}")
  string(LENGTH "${text}" length)
  if(length GREATER LIMIT)
    string(APPEND found "${file} has ${length} lines; at most ${LIMIT}\n")
  endif()
endforeach()
if(count EQUAL 0)
  message(FATAL_ERROR "${ROOT} has no source")
endif()
if(found)
  message(FATAL_ERROR "${found}")
endif()
message(STATUS "${count} sources of at most ${LIMIT} lines")
