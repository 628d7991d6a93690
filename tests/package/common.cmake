# What the package's tests share; see run.cmake.
cmake_policy(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\nfailed (${status}):\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

if(KIND STREQUAL "shared")
  set(shared ON)
else()
  set(shared OFF)
endif()

# The one that Kiln is built with, and the others there are.
set(compilers ${CXX})
foreach(name g++ clang++)
  get_filename_component(own "${CXX}" NAME)
  find_program(other_${name} ${name})
  if(other_${name} AND NOT own STREQUAL name)
    list(APPEND compilers ${other_${name}})
  endif()
endforeach()

# build_kiln(SOURCE FOLDER OPTION...)
function(build_kiln source folder)
  run(${CMAKE_COMMAND} -S ${source} -B ${folder} -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX}
      -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS=${COMMON_FLAGS}"
      "-DCMAKE_CXX_FLAGS_RELEASE=${FLAGS}" ${ARGN})
  run(${CMAKE_COMMAND} --build ${folder} -j 2)
endfunction()
