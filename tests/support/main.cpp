#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdio>

namespace {

/// Processor seconds of this process, and of all child processes that it has waited for.
double processor_seconds() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage use{};
    getrusage(who, &use);
    for (const timeval& part : {use.ru_utime, use.ru_stime}) {
      sum += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
    }
  }
  return sum;
}

/// Adds processor seconds to the report of each test case, besides wall-clock seconds. Unlike these, they do not depend
/// on other load.
class CountSeconds : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo& /*test*/) override { start_ = processor_seconds(); }
  void OnTestEnd(const testing::TestInfo& /*test*/) override {
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", processor_seconds() - start_);
    testing::Test::RecordProperty("processor_seconds", text);
  }

  double start_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  testing::UnitTest::GetInstance()->listeners().Append(new CountSeconds);
  return RUN_ALL_TESTS();
}
