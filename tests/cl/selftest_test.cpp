// The self-test of a device: what gives wrong results fails it, and is named.
#include "cl/selftest.h"

#include <gtest/gtest.h>

#include <string>

#include "support/environment.h"
#include "support/process.h"

namespace kiln {
namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Options let a real compiler round otherwise than Kiln's kernels need.
TEST(SelfTest, NamesWhatIsComputedWrongly) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  EXPECT_EQ(cl::selftest_fault(context), "");
  EXPECT_EQ(cl::selftest_fault(context, "-DKILN_PORTABLE_MASKS=1"), "");
  if (context.info().platform != "Portable Computing Language") return;
  const std::string fault = cl::selftest_fault(context, "-cl-fast-relaxed-math");
  EXPECT_TRUE(has(fault, "sums of scalars") && has(fault, "sums of vectors of 8")) << fault;
  EXPECT_FALSE(has(fault, "integers")) << fault;
}

/// A device that gives one wrong bit is refused, each time anew. One that passed is not tested again.
TEST(SelfTest, RefusesADeviceAndRemembersOneThatPassed) {
  KILN_REQUIRE_DEVICE();
  if (test::fault_library().empty()) GTEST_SKIP() << "no library of faults";
  test::ProcessOptions sound, wrong;
  sound.environment = {{"POCL_CACHE_DIR", test::scratch_folder().string()}};
  wrong.environment = sound.environment;
  wrong.environment["LD_PRELOAD"] = test::fault_library();
  wrong.environment["KILN_FAULT_READ"] = "wrong";
  for (int i = 0; i < 2; ++i) {
    const test::ProcessResult refused = test::run_kiln({"devices"}, wrong);
    EXPECT_EQ(refused.exit_code, 4);
    EXPECT_TRUE(has(refused.errors, "gives wrong results") && has(refused.errors, "driver") &&
                has(refused.errors, "float products and sums of scalars") &&
                has(refused.errors, "Use another device"))
        << refused.errors;
    EXPECT_TRUE(has(refused.output, "computes as it should: no")) << refused.output;
  }
  const test::ProcessResult passed = test::run_kiln({"devices"}, sound);
  EXPECT_EQ(passed.exit_code, 0) << passed.errors;
  EXPECT_TRUE(has(passed.output, "computes as it should: yes")) << passed.output;
  EXPECT_EQ(test::run_kiln({"devices"}, wrong).exit_code, 0) << "tested again";
}

}  // namespace
}  // namespace kiln
