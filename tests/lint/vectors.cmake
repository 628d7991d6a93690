# Fails where a vector of GLM is declared without a value: it would be uninitialised.
#
# Run as: cmake -DROOT=<folder that has host/> -P vectors.cmake
cmake_policy(VERSION 3.25)

file(GLOB_RECURSE files ${ROOT}/host/*.h ${ROOT}/host/*.cpp ${ROOT}/tools/*.h ${ROOT}/tools/*.cpp)
set(type "(Vec[23]d|std::array<Vec[23]d, [A-Za-z0-9_:]+>)")
set(found "")
foreach(file IN LISTS files)
  file(STRINGS ${file} lines REGEX "^ *(mutable |static )?${type} [A-Za-z0-9_, {}]+;")
  foreach(line IN LISTS lines)
    # Each declarator must have braces.
    string(REGEX REPLACE ";.*" "" left "${line}")
    string(REGEX REPLACE "^ *(mutable |static )?${type} " "" left "${left}")
    string(REGEX REPLACE "[A-Za-z0-9_]+{[^{}]*}" "" left "${left}")
    if(left MATCHES "[A-Za-z]")
      string(APPEND found "${file}: ${line}\n")
    endif()
  endforeach()
endforeach()
if(found)
  message(FATAL_ERROR "Vectors without a value; write `Vec3d sum{};`:\n${found}")
endif()
