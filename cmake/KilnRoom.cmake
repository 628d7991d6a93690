# kiln_room(TARGET FILE...): adds a room's files to a target, and compiles neighbours together, since headers take
# longer than most files do (KILN_TOGETHER; the target says UNITY_BUILD_MODE GROUP). Groups follow the order of the
# list, each up to about 140 KB of source: few enough to be quick, enough of them for two processors. Files of one
# group share their unnamed namespaces, so no private name may stand in two neighbours.
function(kiln_room target)
  if(BUILD_SHARED_LIBS)
    set(target kiln)  # the one library file
  endif()
  cmake_path(GET CMAKE_CURRENT_SOURCE_DIR FILENAME room)
  list(GET ARGN 0 first)  # a room may have several lists
  string(MAKE_C_IDENTIFIER "${room}_${first}" room)
  set(group 1)
  set(bytes 0)
  foreach(file IN LISTS ARGN)
    set(path "${CMAKE_CURRENT_SOURCE_DIR}/${file}")
    file(SIZE "${path}" size)
    math(EXPR bytes "${bytes} + ${size}")
    if(bytes GREATER 140000)
      math(EXPR group "${group} + 1")
      set(bytes ${size})
    endif()
    target_sources(${target} PRIVATE "${path}")
    set_source_files_properties("${path}" TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${room}_${group})
  endforeach()
endfunction()
