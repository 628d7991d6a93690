# Fails where <kiln/kiln.h> grows beyond a small core, or makes a program read more of the standard library than
# it does: what an include costs a compiler, without a clock.
#
# Run as: cmake -DHEADERS=<folder of kiln/kiln.h> -P core.cmake
cmake_policy(VERSION 3.25)

# <filesystem> and <functional> are the dear ones. Streams, algorithms, maps, threads and regular expressions stay
# behind the library.
set(allowed array cstddef cstdint cstring filesystem functional limits memory optional span stdexcept string string_view
    type_traits utility vector)

set(core kiln.h)
set(next kiln.h)
set(lines 0)
while(next)
  list(POP_FRONT next header)
  file(READ ${HEADERS}/kiln/${header} text)
  string(REGEX MATCHALL "\n" ends "${text}")
  list(LENGTH ends count)
  math(EXPR lines "${lines} + ${count}")
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
if(headers GREATER 25 OR lines GREATER 2000)
  message(FATAL_ERROR "<kiln/kiln.h> is ${headers} headers and ${lines} lines: at most 25 and 2,000. What few "
      "programs need has a header of its own to include.")
endif()
message(STATUS "<kiln/kiln.h>: ${headers} headers, ${lines} lines")
