# OpenVDB with the dependencies of its headers: the target Vdb::openvdb.
#
# Debian installs OpenVDB's own find module in a folder that CMake does not search.
find_path(Vdb_INCLUDE_DIR openvdb/openvdb.h)
find_path(Vdb_BOOST_INCLUDE_DIR boost/numeric/conversion/conversion_traits.hpp)
find_library(Vdb_LIBRARY openvdb)
find_library(Vdb_TBB_LIBRARY tbb)
find_library(Vdb_IMATH_LIBRARY NAMES Imath Imath-3_1)
mark_as_advanced(Vdb_INCLUDE_DIR Vdb_BOOST_INCLUDE_DIR Vdb_LIBRARY Vdb_TBB_LIBRARY
  Vdb_IMATH_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Vdb
  REQUIRED_VARS Vdb_LIBRARY Vdb_TBB_LIBRARY Vdb_IMATH_LIBRARY Vdb_INCLUDE_DIR Vdb_BOOST_INCLUDE_DIR)
if(Vdb_FOUND AND NOT TARGET Vdb::openvdb)
  add_library(Vdb::openvdb INTERFACE IMPORTED)
  # System headers, whose warnings are suppressed.
  set_target_properties(Vdb::openvdb PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${Vdb_INCLUDE_DIR};${Vdb_BOOST_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${Vdb_LIBRARY};${Vdb_TBB_LIBRARY};${Vdb_IMATH_LIBRARY}")
endif()
