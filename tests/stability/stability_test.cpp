#include <gtest/gtest.h>
TEST(Stability, Placeholder) { FAIL(); }
