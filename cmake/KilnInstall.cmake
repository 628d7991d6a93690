# Installs the library, its headers, the CMake package and the pkg-config file.
install(TARGETS kiln EXPORT kiln-targets
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(EXPORT kiln-targets NAMESPACE kiln:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)
set(kiln_has_openvdb ${Vdb_FOUND})
configure_package_config_file(cmake/kiln-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/kiln-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/kiln-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kiln-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/kiln-config-version.cmake
              cmake/FindVdb.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)

# Whoever links a static Kiln links what it was built with.
get_target_property(kiln_links kiln LINK_LIBRARIES)
set(kiln_private "")
foreach(library IN LISTS kiln_links)
  if(library STREQUAL "OpenCL::OpenCL")
    string(APPEND kiln_private " -lOpenCL")
  elseif(library STREQUAL "OpenMeshCore")
    string(APPEND kiln_private " -lOpenMeshCore")
  elseif(library STREQUAL "meshoptimizer::meshoptimizer")
    string(APPEND kiln_private " -lmeshoptimizer")
  elseif(library STREQUAL "Threads::Threads")
    string(APPEND kiln_private " -pthread")
  elseif(library STREQUAL "Vdb::openvdb")
    string(APPEND kiln_private " -lopenvdb -ltbb -lImath")
  endif()
endforeach()
set(kiln_pc_requires "")
set(kiln_pc_flags "")
set(kiln_pc_libs "")
if(kiln_type STREQUAL "STATIC_LIBRARY")
  set(kiln_pc_flags " -DKILN_STATIC")
  set(kiln_pc_libs "${kiln_private}")
  if(KILN_WITH_IO)
    set(kiln_pc_requires "OpenEXR libpng zlib")
  endif()
endif()
# Relative, since an installed tree may be moved.
file(RELATIVE_PATH kiln_pc_up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/kiln.pc.in ${CMAKE_CURRENT_BINARY_DIR}/kiln.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kiln.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
