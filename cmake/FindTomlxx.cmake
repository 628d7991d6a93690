# toml++, header-only: the target Tomlxx::headers. Debian's own target is a shared library, which programs that link a
# static Kiln would have to find, too.
find_path(Tomlxx_INCLUDE_DIR toml++/toml.h)
mark_as_advanced(Tomlxx_INCLUDE_DIR)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Tomlxx REQUIRED_VARS Tomlxx_INCLUDE_DIR)
if(Tomlxx_FOUND AND NOT TARGET Tomlxx::headers)
  add_library(Tomlxx::headers INTERFACE IMPORTED)
  set_target_properties(Tomlxx::headers PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${Tomlxx_INCLUDE_DIR}"
    INTERFACE_COMPILE_DEFINITIONS TOML_HEADER_ONLY=1)
endif()
