# libnifti's reader of NIfTI 1 and 2: the target Nifti2::nifti2.
#
# Its own package configuration, as Debian installs it, wants programs of another package to be there.
find_path(Nifti2_INCLUDE_DIR nifti2_io.h PATH_SUFFIXES nifti)
find_library(Nifti2_LIBRARY nifti2)
find_library(Nifti2_ZNZ_LIBRARY znz)
mark_as_advanced(Nifti2_INCLUDE_DIR Nifti2_LIBRARY Nifti2_ZNZ_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Nifti2
  REQUIRED_VARS Nifti2_LIBRARY Nifti2_ZNZ_LIBRARY Nifti2_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Debian has it in libnifti-dev")
if(Nifti2_FOUND AND NOT TARGET Nifti2::nifti2)
  add_library(Nifti2::nifti2 INTERFACE IMPORTED)
  set_target_properties(Nifti2::nifti2 PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${Nifti2_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${Nifti2_LIBRARY};${Nifti2_ZNZ_LIBRARY}")
endif()
