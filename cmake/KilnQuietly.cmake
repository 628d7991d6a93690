# Finds a package while suppressing its messages: Debian's Imath, a dependency of OpenEXR, warns about a library of another
# package. Later searches are silent, too, because the targets exist then.
macro(kiln_find_quietly package)
  set(kiln_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
  set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
  find_package(${package} QUIET)
  set(CMAKE_MESSAGE_LOG_LEVEL "${kiln_log_level}")
endmacro()
