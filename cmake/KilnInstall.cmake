# Installs the library, its headers, the CMake package and the pkg-config file.
install(TARGETS ${kiln_parts} EXPORT kiln-targets
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES include/kiln/interop/openmesh.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kiln/interop)
install(EXPORT kiln-targets NAMESPACE kiln:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)
set(kiln_has_openvdb ${Vdb_FOUND})
set(kiln_optional_packages "")  # "JPEG;TIFF": those that were found
foreach(package JPEG WebP TIFF Zstd Deflate Stb assimp draco)
  if(KILN_WITH_IO AND ${package}_FOUND)
    list(APPEND kiln_optional_packages ${package})
  endif()
endforeach()
configure_package_config_file(cmake/kiln-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/kiln-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/kiln-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kiln-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/kiln-config-version.cmake
              cmake/KilnQuietly.cmake cmake/FindDeflate.cmake cmake/FindStb.cmake cmake/FindVdb.cmake cmake/FindWebP.cmake cmake/FindZstd.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)

# Programs that link a static Kiln must also link its dependencies.
set(kiln_private "")
if(NOT BUILD_SHARED_LIBS)
  set(kiln_private " -lkiln_geometry -lOpenCL -lmeshoptimizer -pthread")
  if(TARGET Vdb::openvdb)
    string(APPEND kiln_private " -lopenvdb -ltbb -lImath")
  endif()
endif()
set(kiln_pc_requires "")
set(kiln_pc_flags "")
set(kiln_pc_libs "")
set(kiln_pc_before "")
if(NOT BUILD_SHARED_LIBS)
  set(kiln_pc_flags " -DKILN_STATIC")
  set(kiln_pc_before "-lkiln_measure -lkiln_volume ")
  if(KILN_WITH_IO)
    set(kiln_pc_before "-lkiln_job ${kiln_pc_before}")
  endif()
  set(kiln_pc_libs "${kiln_private}")
  if(KILN_WITH_IO)
    set(kiln_pc_requires "OpenEXR libpng zlib")
    foreach(package IN LISTS kiln_optional_packages)
      if(package STREQUAL "JPEG")
        string(APPEND kiln_pc_requires " libjpeg")
      elseif(package STREQUAL "WebP")
        string(APPEND kiln_pc_requires " libwebp")
      elseif(package STREQUAL "Zstd")
        string(APPEND kiln_pc_requires " libzstd")
      elseif(package STREQUAL "Deflate")
        string(APPEND kiln_pc_requires " libdeflate")
      elseif(package STREQUAL "TIFF")
        string(APPEND kiln_pc_requires " libtiff-4")
      elseif(package STREQUAL "assimp")
        string(APPEND kiln_pc_requires " assimp")
      elseif(package STREQUAL "draco")
        string(APPEND kiln_pc_requires " draco")
      endif()
    endforeach()
  endif()
endif()
# A relative path keeps the installed tree relocatable.
file(RELATIVE_PATH kiln_pc_up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/kiln.pc.in ${CMAKE_CURRENT_BINARY_DIR}/kiln.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kiln.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
