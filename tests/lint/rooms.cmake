# Fails where a room of host/ has no README, or one that does not say what lives there, what never does and what it
# may include, or is longer than a reader takes in at once.
#
# Run as: cmake -DROOT=<folder that has host/> -P rooms.cmake
cmake_policy(VERSION 3.25)

set(limit 20)
# Tables and derivations of these rooms stand in their READMEs.
set(long "match;volume")

set(found "")
file(GLOB rooms RELATIVE ${ROOT}/host LIST_DIRECTORIES true ${ROOT}/host/*)
foreach(room IN LISTS rooms)
  if(NOT IS_DIRECTORY ${ROOT}/host/${room})
    continue()
  endif()
  set(page ${ROOT}/host/${room}/README.md)
  if(NOT EXISTS ${page})
    string(APPEND found "host/${room} has no README.md\n")
    continue()
  endif()
  file(READ ${page} text)
  foreach(part "Lives here:" "Never here:" "May include:")
    if(NOT text MATCHES "[*][*]${part}[*][*]")
      string(APPEND found "host/${room}/README.md has no '${part}'\n")
    endif()
  endforeach()
  string(REGEX REPLACE "[^\n]+" "" lines "${text}")
  string(LENGTH "${lines}" count)
  if(count GREATER limit AND NOT room IN_LIST long)
    string(APPEND found "host/${room}/README.md has ${count} lines; at most ${limit}\n")
  endif()
endforeach()
if(found)
  message(FATAL_ERROR "${found}")
endif()
list(LENGTH rooms count)
message(STATUS "${count} rooms")
