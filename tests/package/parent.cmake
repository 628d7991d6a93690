# Kiln as a part of another project's build: add_subdirectory, shared, and FetchContent, static. Both without
# file formats (KILN_WITH_IO=OFF), and with hidden visibility.
#
# Run as: cmake -DROOT=<kiln's sources> -DWORK=<scratch folder> -DGENERATOR=... -DCXX=... -DFLAGS=<of a release>
#               -DCOMMON_FLAGS=<of all builds> -DWAY=subdirectory|fetch -DKIND=shared|static -P parent.cmake
cmake_policy(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

# As on a machine that has none of the libraries of file formats.
set(absent "")
foreach(package OpenMesh OpenEXR Imath PNG ZLIB Vdb)
  list(APPEND absent -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
build_kiln(${ROOT}/tests/package/parent ${WORK}/build -DKILN_ROOT=${ROOT} -DWAY=${WAY}
  -DBUILD_SHARED_LIBS=${shared} ${absent})
if(GENERATOR STREQUAL "Ninja")
  run(${CMAKE_MAKE_PROGRAM} -C ${WORK}/build -t deps)
  if(NOT output MATCHES "/kiln/bake.h")
    message(FATAL_ERROR "the build's dependencies are not understood")
  endif()
  if(output MATCHES "[^\n]*/(OpenMesh|OpenEXR|Imath|openvdb|png\\.h|zlib\\.h)[^\n]*")
    message(FATAL_ERROR "a header of file formats is included: ${CMAKE_MATCH_0}")
  endif()
endif()
run(${WORK}/build/host)
run(${WORK}/build/own_memory)
message(STATUS "${output}")

# What nothing links is not built.
file(GLOB_RECURSE built RELATIVE ${WORK}/build ${WORK}/build/*.a)
if(built MATCHES "kiln_(volume|measure|job)")
  message(FATAL_ERROR "parts of Kiln are built that nothing links: ${built}")
endif()

# Neither the libraries of file formats, nor anything of Kiln installed, nor its symbols in a plugin.
file(GLOB_RECURSE library ${WORK}/build/*libkiln.so ${WORK}/build/libplugin.so)
foreach(file IN LISTS library)
  if(file MATCHES "libkiln.so$")  # what is not there says so: it does not lack
    run(${CMAKE_COMMAND} -DLIBRARY=${file} -DHEADERS=${ROOT}/include/kiln
        -P ${ROOT}/tests/package/symbols.cmake)
    message(STATUS "${output}")
  endif()
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
# Templates of the standard library over Kiln's types are not Kiln's.
run(nm -D --defined-only ${WORK}/build/libplugin.so)
if(output MATCHES "_Z(N|NK|TI|TIN|TSN|TVN)4kiln")
  message(FATAL_ERROR "the plugin exports Kiln:\n${output}")
endif()
