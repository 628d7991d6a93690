// What CMake writes: two files that are compiled as one.
#include "../one.cpp"
#include "../two.cpp"
