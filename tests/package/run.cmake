# Installs Kiln to a fresh prefix, builds the consumer against it and runs it.
#
# Run as: cmake -DKIND=static|shared -DBUILT=<kiln's build folder of that kind, or empty>
#               -DROOT=<kiln's sources> -DWORK=<scratch folder> -DLIBRARY=<build folder of the other kind>
#               -DGENERATOR=... -DCXX=... -DFLAGS=<of a release> -DWERROR=ON|OFF -P run.cmake
#
# Where BUILT is empty the library is built here first; that build is kept for the next run.
cmake_policy(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\nfailed (${status}):\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(common -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=Release)
if(KIND STREQUAL "shared")
  set(shared ON)
else()
  set(shared OFF)
endif()

if(BUILT STREQUAL "")
  set(BUILT ${LIBRARY})
  run(${CMAKE_COMMAND} -S ${ROOT} -B ${BUILT} ${common} -DBUILD_SHARED_LIBS=${shared}
      -DKILN_BUILD_CLI=OFF -DKILN_BUILD_TESTS=OFF "-DCMAKE_CXX_FLAGS_RELEASE=${FLAGS}"
      -DKILN_WERROR=${WERROR})
  run(${CMAKE_COMMAND} --build ${BUILT} -j 2)
endif()

set(prefix ${WORK}/prefix)
set(consumer ${WORK}/consumer)
file(REMOVE_RECURSE ${prefix} ${consumer})
run(${CMAKE_COMMAND} --install ${BUILT} --prefix ${prefix})
# The build tree must not be what makes it work: its library is not what the consumer may link.
run(${CMAKE_COMMAND} -S ${ROOT}/tests/package -B ${consumer} ${common} -DCMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${consumer})

file(STRINGS ${consumer}/CMakeCache.txt found REGEX "^kiln_DIR:")
if(NOT found MATCHES "=${prefix}/")
  message(FATAL_ERROR "the consumer found another kiln: ${found}")
endif()

set(ENV{LD_LIBRARY_PATH} "")
run(${consumer}/probe)
message(STATUS "${output}")
set(scene ${WORK}/scene)
file(REMOVE_RECURSE ${scene})
file(COPY ${ROOT}/tests/package/high.ply ${ROOT}/tests/package/low.obj DESTINATION ${scene})
run(${CMAKE_COMMAND} -E chdir ${scene} ${consumer}/bake)
run(${CMAKE_COMMAND} -E chdir ${scene} ${consumer}/check)
