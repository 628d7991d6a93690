# Finds a package whose own files talk of what does not concern us: Debian's Imath, of OpenEXR, names a library of
# another package. What is found so is found again in silence, since its targets are there.
macro(kiln_find_quietly package)
  set(kiln_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
  set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
  find_package(${package} QUIET)
  set(CMAKE_MESSAGE_LOG_LEVEL "${kiln_log_level}")
endmacro()
