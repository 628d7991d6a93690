# Kiln as a part of another project's build: add_subdirectory, shared, and FetchContent, static. Both without
# file formats (KILN_WITH_IO=OFF), and with hidden visibility.
#
# Run as: cmake -DROOT=<kiln's sources> -DWORK=<scratch folder> -DGENERATOR=... -DCXX=... -DFLAGS=<of a release>
#               -DCOMMON_FLAGS=<of all builds> -DWAY=subdirectory|fetch -DKIND=shared|static -P parent.cmake
cmake_policy(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

build_kiln(${ROOT}/tests/package/parent ${WORK}/build -DKILN_ROOT=${ROOT} -DWAY=${WAY}
  -DBUILD_SHARED_LIBS=${shared})
run(${WORK}/build/host)
run(${WORK}/build/own_memory)
message(STATUS "${output}")

# Neither the libraries of file formats, nor anything of Kiln installed, nor its symbols in a plugin.
file(GLOB_RECURSE library ${WORK}/build/*libkiln.so ${WORK}/build/libplugin.so)
foreach(file IN LISTS library)
  run(ldd ${file})
  if(output MATCHES "OpenEXR|OpenMesh|libpng|Iex|openvdb")
    message(FATAL_ERROR "${file} needs libraries of file formats:\n${output}")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK}/prefix)
run(${CMAKE_COMMAND} --install ${WORK}/build --prefix ${WORK}/prefix)
file(GLOB_RECURSE installed RELATIVE ${WORK}/prefix ${WORK}/prefix/*)
if(NOT installed STREQUAL "bin/host")
  message(FATAL_ERROR "a parent installs Kiln's files, too: ${installed}")
endif()
run(nm -DC --defined-only ${WORK}/build/libplugin.so)
if(output MATCHES "kiln::")
  message(FATAL_ERROR "the plugin exports Kiln:\n${output}")
endif()
