// Programs that take the driver long to build: waits that give signs of life, and waits that end early.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "base/progress_guard.h"
#include "cl/context.h"
#include "cl/embedded.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// Kernels that no cache of the driver knows, and that take a compiler a while. \param last  of the last line
std::string long_source(int kernels, const std::string& last = "") {
  std::string text;
  const std::string unique = std::to_string(std::random_device()());
  for (int i = 0; i < kernels; ++i) {
    text += "__kernel void k" + std::to_string(i) + "(__global float* a) {\n";
    for (int line = 0; line < 20; ++line) {
      text += "a[" + std::to_string(line) + "] = sin(a[" + std::to_string(line + 1) + "]) + " +
              unique + ".0f;\n";
    }
    text += "}\n";
  }
  return text + last;
}

/// While it lives, polls of this thread are counted; above `most` they cancel.
struct Counting {
  explicit Counting(int most)
      : guard([this, most](double, std::string_view) { return ++calls <= most; }) {}
  int calls = 0;
  ProgressGuard guard;
};

TEST(Build, WaitsForTheCompilerGiveSignsOfLife) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  const Counting counting(1 << 30);
  const cl::Kernel kernel = context.kernel_with("image", "k3", long_source(60), "mine");
  EXPECT_NE(kernel.get(), nullptr);
  EXPECT_GT(counting.calls, 4);
}

TEST(Build, GoesOnWhereAWaitEndsAndServesTheNext) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  // The next who asks still has to wait, if the first left early. This thread may sleep through a build: of some.
  int waits = 0;
  for (int i = 0; i < 5 && waits == 0; ++i) {
    const std::string source = long_source(60);
    {
      const Counting counting(0);
      EXPECT_THROW(context.kernel_with("image", "k3", source, "mine"), Cancelled);
    }
    const Counting counting(1 << 30);
    EXPECT_NE(context.kernel_with("image", "k3", source, "mine").get(), nullptr);
    waits = counting.calls;
    const double built = context.build_seconds();
    EXPECT_NE(context.kernel_with("image", "k4", source, "mine").get(), nullptr);
    EXPECT_EQ(context.build_seconds(), built);  // once for all
  }
  EXPECT_GT(waits, 0) << "it waited for the compiler";
}

TEST(Build, MayBeLeftBehindWithTheDevice) {
  KILN_REQUIRE_DEVICE();
  const Device device = Device::open(test::device()->info().name);
  const Counting counting(0);
  EXPECT_THROW(context_of(device).kernel_with("image", "k3", long_source(60), "mine"), Cancelled);
}

TEST(Build, FailsAgainWhereItIsAskedForAgain) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  const std::string source = long_source(1, "no such type;\n");
  for (int i = 0; i < 2; ++i) {
    const Counting counting(1 << 30);
    try {
      context.kernel_with("image", "k0", source, "mine.cl");
      FAIL() << "built";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      EXPECT_NE(std::string(error.what()).find("mine.cl"), std::string::npos);
    }
  }
}

/// A source is the text of all its pieces, joined once.
TEST(Build, EmbeddedSourcesAreJoinedFromTheirPieces) {
  for (const char* const family : {"hemisphere_cast", "image", "builtins"}) {
    const std::string_view source = ocl::embedded_source(family);
    std::string joined;
    std::size_t pieces = 0;
    for (const char* const* piece = ocl::embedded_pieces(family); *piece != nullptr; ++piece) {
      joined += *piece;
      ++pieces;
    }
    EXPECT_EQ(source, joined) << family;
    EXPECT_EQ(pieces, source.size() / 12000 + 1) << family;
    EXPECT_TRUE(source.starts_with("#line 1 \"kernels/")) << family;
    EXPECT_TRUE(source.ends_with("\n")) << family;
    EXPECT_EQ(ocl::embedded_source(family).data(), source.data()) << family;
  }
  EXPECT_NE(ocl::embedded_source("hemisphere_cast").find("kernel void kiln_hemisphere_cast"),
            std::string_view::npos);
  EXPECT_EQ(ocl::embedded_pieces("none"), nullptr);
  EXPECT_TRUE(ocl::embedded_source("none").empty());
}

}  // namespace
}  // namespace kiln
