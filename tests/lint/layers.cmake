# Fails where an #include of host/ climbs: a room includes from rooms on lower floors and from itself. So do the folders
# of tools/kiln. Headers of POSIX and of Windows are for base and cl alone; in the command, for what replaces functions of
# glibc. No file but examples includes all of the public API's core at once.
#
# Run as: cmake -DROOT=<folder that has host/> -P layers.cmake
cmake_policy(VERSION 3.25)

# Floors from the ground up; rooms of one floor do not see each other.
set(floors
  "base"
  "cl mesh"
  "texel clean"
  "accel image pack io"
  "source render simplify unwrap asset"
  "match detail volume"
  "bake"
  "measure"
  "plan"
  "options"
  "job"
  "batch"
  "c")
set(level 0)
foreach(floor IN LISTS floors)
  separate_arguments(rooms UNIX_COMMAND "${floor}")
  foreach(room IN LISTS rooms)
    set(level_${room} ${level})
  endforeach()
  math(EXPR level "${level} + 1")
endforeach()

set(posix "(sys/[a-z_]+|arpa/[a-z]+|net[a-z/]*|aio|dirent|dlfcn|fcntl|ftw|glob|grp|langinfo|libgen|malloc|poll|pthread|pwd|sched|semaphore|signal|spawn|strings|syslog|termios|unistd|utime|windows|wordexp)[.]h")
set(found "")
file(GLOB_RECURSE files RELATIVE ${ROOT}/host ${ROOT}/host/*.h ${ROOT}/host/*.cpp)
foreach(file IN LISTS files)
  string(REGEX MATCH "^[^/]+" room "${file}")
  if(NOT DEFINED level_${room})
    string(APPEND found "host/${file} stands in no room of tests/lint/layers.cmake\n")
    continue()
  endif()
  file(STRINGS ${ROOT}/host/${file} lines)
  set(number 0)
  foreach(line IN LISTS lines)
    math(EXPR number "${number} + 1")
    if(line MATCHES "^[ \t]*#[ \t]*include[ \t]+<${posix}>" AND NOT room STREQUAL "base")
      string(APPEND found "host/${file}:${number} includes a header of POSIX, which is for base\n")
    endif()
    if(NOT line MATCHES "^[ \t]*#[ \t]*include[ \t]+\"([^\"]+)\"")
      continue()
    endif()
    set(included "${CMAKE_MATCH_1}")
    string(REGEX MATCH "^[^/]+" target "${included}")
    # The public API, and the structs that host and kernels share, are open to all.
    if(target STREQUAL room OR target STREQUAL "kiln" OR target STREQUAL "shared")
      continue()
    endif()
    if(NOT DEFINED level_${target} OR NOT level_${target} LESS level_${room})
      string(APPEND found "host/${file}:${number} includes \"${included}\"\n")
    endif()
  endforeach()
endforeach()
# Folders of the command, from the ground up, and what each must not include.
set(above_report "arguments|picture|command")
set(above_arguments "report|picture|command")
set(above_picture "report|arguments|command")
file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/tools/kiln/*.h ${ROOT}/tools/kiln/*.cpp)
list(REMOVE_ITEM files tools/kiln/replaced_threads.cpp)
foreach(file IN LISTS files)
  string(REGEX REPLACE "^tools/kiln/([^/]+)/.*" "\\1" folder "${file}")
  if(DEFINED above_${folder})
    file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]+\"(${above_${folder}})/")
    foreach(line IN LISTS lines)
      string(APPEND found "${file}: ${line} climbs\n")
    endforeach()
  endif()
  file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]+<${posix}>")
  foreach(line IN LISTS lines)
    string(APPEND found "${file}: ${line} is for base\n")
  endforeach()
endforeach()
# <kiln/kiln.h> is for programs that use Kiln: in here, each change of one of its headers would compile all files anew.
file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/host/*.h ${ROOT}/host/*.cpp ${ROOT}/tests/*.h ${ROOT}/tests/*.cpp
  ${ROOT}/tools/*.h ${ROOT}/tools/*.cpp)
list(FILTER files EXCLUDE REGEX "^(tests/(package|lint)|tools/examples)/")
foreach(file IN LISTS files)
  file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]+[<\"]kiln/kiln[.]h")
  if(lines)
    string(APPEND found "${file} includes kiln/kiln.h: include the headers it uses\n")
  endif()
endforeach()
if(found)
  message(FATAL_ERROR "Includes of host/ and tools/kiln go down the floors only (host/README.md), and name single headers, but:\n${found}")
endif()
