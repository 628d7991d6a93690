# OpenVDB with what its headers need: the target Vdb::openvdb.
#
# Its own find module is installed where CMake does not look.
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
  # As system headers: their warnings are not ours.
  set_target_properties(Vdb::openvdb PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${Vdb_INCLUDE_DIR};${Vdb_BOOST_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${Vdb_LIBRARY};${Vdb_TBB_LIBRARY};${Vdb_IMATH_LIBRARY}")
endif()
