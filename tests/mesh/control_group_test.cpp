// Memory that control groups leave, by files as the kernel has them.
#include "base/control_group.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

class ControlGroups : public testing::Test {
 protected:
  void write(const std::string& path, const std::string& text) const {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text << "\n";
  }
  std::uint64_t left() const {
    return free_in_control_groups(root_.string(), (root_ / "own").string());
  }
  fs::path root_ = test::scratch_folder();
};

TEST_F(ControlGroups, AreNoneWithoutFiles) {
  EXPECT_EQ(left(), kNoNumber);
  write("own", "0::/");
  EXPECT_EQ(left(), kNoNumber);
}

TEST_F(ControlGroups, OfVersion2) {
  write("memory.max", "1000000");
  write("memory.current", "700000");
  EXPECT_EQ(left(), 300000U);
  // Cached files are given back, those of tmpfs are not.
  write("memory.stat", "anon 300000\nfile 250000\nshmem 50000");
  EXPECT_EQ(left(), 500000U);
  write("memory.max", "max");
  EXPECT_EQ(left(), kNoNumber);
  // Groups around and of the process, where it is no container.
  write("own", "0::/outer/inner");
  write("outer/memory.max", "900000");
  write("outer/memory.current", "800000");
  write("outer/inner/memory.max", "max");
  write("outer/inner/memory.current", "1");
  EXPECT_EQ(left(), 100000U);
  write("outer/inner/memory.max", "50001");
  EXPECT_EQ(left(), 50000U);
}

TEST_F(ControlGroups, OfVersion1) {
  write("memory/memory.limit_in_bytes", "9223372036854771712");
  write("memory/memory.usage_in_bytes", "700000");
  write("memory/memory.stat", "cache 1\nhierarchical_memory_limit 9223372036854771712");
  EXPECT_EQ(left(), kNoNumber);
  write("memory/memory.limit_in_bytes", "1000000");
  EXPECT_EQ(left(), 300000U);
  write("memory/memory.stat", "total_cache 250000\ntotal_shmem 50000");
  EXPECT_EQ(left(), 500000U);
  // What the groups around it allow.
  write("memory/memory.stat", "hierarchical_memory_limit 750000");
  EXPECT_EQ(left(), 50000U);
  write("own", "12:cpu,cpuacct:/x\n9:hugetlb,memory:/y\n1:name=systemd:/x");
  write("memory/y/memory.limit_in_bytes", "20000");
  write("memory/y/memory.usage_in_bytes", "8000");
  write("memory/x/memory.limit_in_bytes", "1");
  write("memory/x/memory.usage_in_bytes", "1");
  EXPECT_EQ(left(), 12000U);
  // More in use than allowed.
  write("memory/y/memory.usage_in_bytes", "30000");
  EXPECT_EQ(left(), 0U);
}

}  // namespace
}  // namespace kiln
