# kiln_room(TARGET FILE...): adds a room's files to a target in unity groups, since headers take longer to compile than
# most files (KILN_TOGETHER; the target has UNITY_BUILD_MODE GROUP). Groups are consecutive files of up to about 140 KB in
# total: large enough to save time, small enough for parallel builds. Files of a group share their unnamed namespaces:
# lint/private-names checks that no two files of a group have a private name in common, and preset debug, which compiles
# each file alone, that none uses another's.
function(kiln_room target)
  if(BUILD_SHARED_LIBS)
    set(target kiln)  # shared builds have a single library
  endif()
  cmake_path(GET CMAKE_CURRENT_SOURCE_DIR FILENAME room)
  list(GET ARGN 0 first)  # a room may call this several times
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
