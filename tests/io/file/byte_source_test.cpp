// Files as readers see them: what another process does to them meanwhile is noticed.
#include "io/file/byte_source.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

FailWith failure() {
  return [](const std::string&, const std::string& problem, const Message&) {
    throw std::runtime_error(problem);
  };
}

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

/// What the reader of a file says that was written to after it was opened; empty: it was read.
std::string problem_of(const fs::path& path, const std::string& meanwhile) {
  const auto source = open_file(path, failure());
  if (!meanwhile.empty()) {
    write(path, meanwhile);
    // Clocks of file systems are coarse.
    fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(1));
  }
  try {
    read_whole(*source, failure());
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST(ByteSource, AFileThatIsWrittenToWhileItIsReadIsRefused) {
  const fs::path path = test::scratch_folder() / "mesh.obj";
  write(path, "v 0 0 0");
  EXPECT_EQ(problem_of(path, ""), "");
  EXPECT_EQ(problem_of(path, "v 0 0"), "it changed while it was read: it had 7 bytes, and then 5");
  EXPECT_EQ(problem_of(path, "v 0 0 0 1"),
            "it changed while it was read: it had 5 bytes, and then 9");
  EXPECT_EQ(problem_of(path, "v 0 0 9 1"), "it changed while it was read");
  EXPECT_EQ(problem_of(path, ""), "");
}

}  // namespace
}  // namespace kiln
