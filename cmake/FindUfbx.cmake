# ufbx: two source files, ufbx.c and ufbx.h, which programs compile themselves. The target Ufbx::source has their folder,
# which is KILN_UFBX_DIR (CMake or environment variable), or the one of tools/install-packages.
find_path(Ufbx_SOURCE_DIR ufbx.c
  HINTS "${KILN_UFBX_DIR}" "$ENV{KILN_UFBX_DIR}"
  PATHS "$ENV{XDG_CACHE_HOME}/kiln/ufbx" "$ENV{HOME}/.cache/kiln/ufbx" "${PROJECT_SOURCE_DIR}/build/ufbx"
  NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)  # sources are of no platform
mark_as_advanced(Ufbx_SOURCE_DIR)
set(Ufbx_VERSION "")
if(Ufbx_SOURCE_DIR AND EXISTS "${Ufbx_SOURCE_DIR}/ufbx.h")
  file(STRINGS "${Ufbx_SOURCE_DIR}/ufbx.h" Ufbx_VERSION REGEX "#define UFBX_HEADER_VERSION ")
  string(REGEX REPLACE "[^0-9]*([0-9]+), *([0-9]+), *([0-9]+).*" "\\1.\\2.\\3" Ufbx_VERSION "${Ufbx_VERSION}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Ufbx REQUIRED_VARS Ufbx_SOURCE_DIR Ufbx_VERSION VERSION_VAR Ufbx_VERSION)
if(Ufbx_FOUND AND NOT TARGET Ufbx::source)
  add_library(Ufbx::source INTERFACE IMPORTED)
  # System headers, whose warnings are suppressed.
  set_target_properties(Ufbx::source PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${Ufbx_SOURCE_DIR}")
endif()
