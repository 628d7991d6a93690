# Fails where a room that reads rows of maps and matches, or the command, knows one of them by its name:
# MapKind::normal, MatchMethod::ray, or the name as a text.
#
# Run as: cmake -DROOT=<folder that has host/ and tools/> -P names.cmake
cmake_policy(VERSION 3.25)

# Rooms of the lower floors name kernels, which are called like the matches that launch them.
set(rooms source render volume bake measure plan)

# Of the command, experiments name what they compare, and which maps they look at. What no setting of `kiln chart`
# names, it takes from the rows. A GLB's material has places for certain maps (host/job/asset.cpp). Everything else of
# jobs and the command reads rows.
set(experiments host/job/asset.cpp tools/lab/chart_settings.cpp
  tools/lab/chart_volume.cpp tools/lab/gallery.cpp)
# Words of other lists, too: values of --ao-by, --visibility-test and --study.
set(other_words "\"views\"")

# All names, as their own files and public headers say them.
set(tree ${CMAKE_CURRENT_LIST_DIR}/../..)
file(GLOB files ${tree}/include/kiln/map.h ${tree}/include/kiln/match.h ${tree}/host/detail/*.cpp)
set(names "")
foreach(file IN LISTS files)
  file(READ ${file} text)
  string(REGEX MATCHALL "(MapKind|MatchMethod)( |::)?[a-z_]*{\"[a-z_]+\"}|row_of\\(\"[a-z_]+\"" rows "${text}")
  foreach(row IN LISTS rows)
    string(REGEX MATCH "\"[a-z_]+\"" name "${row}")
    list(APPEND names ${name})
  endforeach()
endforeach()
list(LENGTH names count)
if(count LESS 20)
  message(FATAL_ERROR "Only ${count} names of maps and matches were found: mend names.cmake.")
endif()

set(found "")
foreach(room IN LISTS rooms)
  file(GLOB files RELATIVE ${ROOT}/host ${ROOT}/host/${room}/*.h ${ROOT}/host/${room}/*.cpp)
  foreach(file IN LISTS files)
    file(READ ${ROOT}/host/${file} text)
    string(REGEX MATCHALL "(MapKind|MatchMethod)::[a-z_]+|\"[a-z_]+\"" words "${text}")
    foreach(word IN LISTS words)
      if("${word}" MATCHES "::" OR "${word}" IN_LIST names)
        string(APPEND found "host/${file} knows ${word} by name\n")
      endif()
    endforeach()
  endforeach()
endforeach()

# A text that begins braces or stands in brackets is a key of a report: {"ray", a.ray}, json["ray"]. What is asked of
# obeys() and the like is an option, and some are called as the maps that hold them are: obeys(map, "opacity").
file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/host/options/*.h ${ROOT}/host/options/*.cpp ${ROOT}/host/job/*.h
  ${ROOT}/host/job/*.cpp ${ROOT}/tools/kiln/*.h ${ROOT}/tools/kiln/*.cpp ${ROOT}/tools/lab/*.h
  ${ROOT}/tools/lab/*.cpp)
list(REMOVE_ITEM files ${experiments})
foreach(file IN LISTS files)
  file(READ ${ROOT}/${file} text)
  string(REGEX REPLACE "//[^\n]*" "" text "${text}")
  string(REGEX REPLACE "(MapKind|MatchMethod){\"" "\\1::" text "${text}")
  string(REGEX REPLACE "[[{]\"[a-z_]+\"" "" text "${text}")
  string(REGEX REPLACE "(obeys|map_uses|needs_texture)\\([^()\";]*, \"[a-z_]+\"" "" text "${text}")
  string(REGEX MATCHALL "(MapKind|MatchMethod)::[a-z_]+|\"[a-z_]+\"" words "${text}")
  foreach(word IN LISTS words)
    if("${word}" MATCHES "::" OR ("${word}" IN_LIST names AND NOT "${word}" IN_LIST other_words))
      string(APPEND found "${file} knows ${word} by name\n")
    endif()
  endforeach()
endforeach()
if(found)
  message(FATAL_ERROR "Rooms read what they need to know of a map or match from its row, but:\n${found}")
endif()
message(STATUS "${count} maps and matches, known by name to none of ${rooms}, and to the command's experiments alone")
