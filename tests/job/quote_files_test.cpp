// Names of files in messages.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "job/mesh_files.h"

namespace kiln {
namespace {

/// Three files are named; of more, two, and the number of the others.
TEST(QuoteFiles, NamesThreeAtMost) {
  EXPECT_EQ(quote_files({"a"}), "'a'");
  EXPECT_EQ(quote_files({"a", "b"}), "'a' and 'b'");
  EXPECT_EQ(quote_files({"a", "b", "c"}), "'a', 'b' and 'c'");
  EXPECT_EQ(quote_files({"a", "b", "c", "d"}), "'a', 'b' and 2 more");
  EXPECT_EQ(quote_files({"a", "b", "c", "d", "e"}), "'a', 'b' and 3 more");
}

}  // namespace
}  // namespace kiln
