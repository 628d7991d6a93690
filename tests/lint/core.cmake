# Fails where <kiln/kiln.h> includes more headers than a small core needs, or makes a program read more of the standard
# library than it does: what an include costs a compiler, without a clock. Lines are not counted: comments cost nothing.
#
# Run as: cmake -DHEADERS=<folder of kiln/kiln.h> -P core.cmake
cmake_policy(VERSION 3.25)

# <filesystem> and <functional> are the dear ones. Streams, algorithms, maps, threads and regular expressions stay
# behind the library.
set(allowed array cstddef cstdint cstring filesystem functional limits memory optional span stdexcept string string_view
    type_traits utility vector)

set(core kiln.h)
set(next kiln.h)
while(next)
  list(POP_FRONT next header)
  file(READ ${HEADERS}/kiln/${header} text)
  string(REGEX MATCHALL "#include [<\"][^>\"]+" includes "${text}")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "#include [<\"]" "" include "${include}")
    if(include MATCHES "^kiln/(.*)")
      if(NOT CMAKE_MATCH_1 IN_LIST core)
        list(APPEND core ${CMAKE_MATCH_1})
        list(APPEND next ${CMAKE_MATCH_1})
      endif()
    elseif(NOT include IN_LIST allowed)
      message(FATAL_ERROR "kiln/${header} includes <${include}>, which every program would pay for: include it in "
          "host/, or add it to this list with a measured reason.")
    endif()
  endforeach()
endwhile()
list(LENGTH core headers)
if(headers GREATER 25)
  message(FATAL_ERROR "<kiln/kiln.h> is ${headers} headers: at most 25. What few programs need has a header of its own to "
      "include.")
endif()
message(STATUS "<kiln/kiln.h>: ${headers} headers")
