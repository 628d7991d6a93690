// The self-test of a device: what computes wrongly fails it, and is named.
#include "cl/selftest.h"

#include <gtest/gtest.h>

#include "shared/selftest.h"
#include "support/environment.h"

namespace kiln {
namespace {

TEST(SelfTest, PassesHere) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  EXPECT_EQ(cl::selftest_fault(context.info(), cl::selftest_results(context)), "");
}

}  // namespace
}  // namespace kiln
