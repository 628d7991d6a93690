# Installs Kiln to a fresh prefix and uses it from outside: by find_package and by pkg-config, with each
# compiler there is; builds and runs the examples; of a shared library, checks what it exports.
#
# Run as: cmake -DKIND=static|shared -DBUILT=<kiln's build folder of that kind, or empty>
#               -DROOT=<kiln's sources> -DWORK=<scratch folder> -DLIBRARY=<build folder of the other kind>
#               -DGENERATOR=... -DCXX=... -DFLAGS=<of a release> -DWERROR=ON|OFF -P run.cmake
#
# Where BUILT is empty the library is built here first; that build is kept for the next run.
cmake_policy(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

if(BUILT STREQUAL "")
  set(BUILT ${LIBRARY})
  build_kiln(${ROOT} ${BUILT} -DBUILD_SHARED_LIBS=${shared} -DKILN_BUILD_CLI=OFF
    -DKILN_WERROR=${WERROR})
endif()

set(prefix ${WORK}/prefix)
file(REMOVE_RECURSE ${prefix})
run(${CMAKE_COMMAND} --install ${BUILT} --prefix ${prefix})
set(ENV{LD_LIBRARY_PATH} "")
file(GLOB_RECURSE packages ${prefix}/*/kiln.pc)
cmake_path(GET packages PARENT_PATH package_folder)
set(ENV{PKG_CONFIG_PATH} ${package_folder})
find_program(PKG_CONFIG pkg-config)

foreach(compiler IN LISTS compilers)
  cmake_path(GET compiler FILENAME id)
  set(consumer ${WORK}/consumer-${id})
  file(REMOVE_RECURSE ${consumer})
  # The build tree must not be what makes it work: its library is not what the consumer may link.
  run(${CMAKE_COMMAND} -S ${ROOT}/tests/package -B ${consumer} -G ${GENERATOR}
      -DCMAKE_CXX_COMPILER=${compiler} -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS_RELEASE=${FLAGS}"
      -DCMAKE_PREFIX_PATH=${prefix})
  run(${CMAKE_COMMAND} --build ${consumer})
  file(STRINGS ${consumer}/CMakeCache.txt found REGEX "^kiln_DIR:")
  if(NOT found MATCHES "=${prefix}/")
    message(FATAL_ERROR "the consumer found another kiln: ${found}")
  endif()
  run(${consumer}/probe)
  message(STATUS "${id}, find_package: ${output}")
  set(scene ${WORK}/scene)
  file(REMOVE_RECURSE ${scene})
  file(COPY ${ROOT}/tests/package/high.ply ${ROOT}/tests/package/low.obj DESTINATION ${scene})
  run(${CMAKE_COMMAND} -E chdir ${scene} ${consumer}/bake)
  run(${CMAKE_COMMAND} -E chdir ${scene} ${consumer}/check)

  if(PKG_CONFIG)
    run(${PKG_CONFIG} --cflags --libs kiln)
    separate_arguments(flags UNIX_COMMAND "${output}")
    run(${compiler} -std=c++20 -Wall -Wextra -Werror ${ROOT}/tests/package/probe.cpp ${flags}
        -Wl,-rpath,${package_folder}/.. -o ${WORK}/probe-${id})
    run(${WORK}/probe-${id})
    message(STATUS "${id}, pkg-config: ${output}")
  endif()
endforeach()

if(KIND STREQUAL "shared")
  file(GLOB_RECURSE library ${prefix}/*/libkiln.so)
  run(${CMAKE_COMMAND} -DLIBRARY=${library} -DHEADERS=${prefix}/include/kiln
      -P ${ROOT}/tests/package/symbols.cmake)
  message(STATUS "${output}")
endif()

set(examples ${WORK}/examples)
file(REMOVE_RECURSE ${examples})
run(${CMAKE_COMMAND} -S ${ROOT}/tools/examples -B ${examples} -G ${GENERATOR}
    -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS_RELEASE=${FLAGS}"
    -DCMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${examples})
run(${CMAKE_CTEST_COMMAND} --test-dir ${examples} --output-on-failure)
