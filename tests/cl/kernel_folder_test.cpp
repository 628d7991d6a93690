// Folders of compiled kernels, which are code: nobody else may be able to put files there.
#include "cl/kernel_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "base/file.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

fs::path make(const fs::path& folder, mode_t mode) {
  fs::create_directories(folder);
  EXPECT_EQ(chmod(folder.c_str(), mode), 0) << folder;
  return folder;
}

TEST(SharedLevel, IsTheFirstThatOthersMayWriteTo) {
  const fs::path own = make(test::scratch_folder(), 0755);
  EXPECT_EQ(os::shared_level(own), "");
  EXPECT_EQ(os::shared_level(own / "not" / "there"), "");
  make(own / "a" / "b", 0700);
  EXPECT_EQ(os::shared_level(own / "a" / "b"), "");
  make(own / "a", 0777);
  for (const char* path : {"a", "a/", "a/.", "a/b", "a/b/not/there", "a/b/../../a/b"}) {
    EXPECT_EQ(os::shared_level(own / path), own / "a") << path;
  }
  EXPECT_EQ(os::shared_level(own / "a" / ".."), own / "a") << "the way leads through it";
  make(own / "a", 0755);
  EXPECT_EQ(os::shared_level(own / "a" / "b"), "");
}

TEST(SharedLevel, WhereAllMakeNamesOnesOwnAreSafe) {
  const fs::path own = make(test::scratch_folder(), 0755), all = make(own / "all", 01777);
  make(all / "mine", 0700);
  EXPECT_EQ(os::shared_level(all / "mine"), "");
  EXPECT_EQ(os::shared_level(all / "mine" / "new"), "");
  for (const char* path : {".", "", "mine/.."}) {
    EXPECT_EQ(os::shared_level(all / path), all) << path << ": others may put files into it";
  }
  EXPECT_EQ(os::shared_level(all / "new"), all / "new") << "another may make it first";
  EXPECT_EQ(os::shared_level(all / "mine" / ".." / "new"), all / "new");
}

TEST(SharedLevel, LinksAreFollowedOneByOne) {
  const fs::path own = make(test::scratch_folder(), 0755);
  make(own / "open", 0777);
  make(own / "open" / "deep", 0700);
  make(own / "safe", 0700);
  fs::create_symlink("open/deep", own / "one");
  fs::create_symlink(own / "one", own / "two");
  fs::create_symlink(own / "safe", own / "open" / "back");
  fs::create_symlink("open/back", own / "through");
  fs::create_symlink("safe", own / "good");
  fs::create_symlink("round", own / "round");
  EXPECT_EQ(os::shared_level(own / "good"), "");
  EXPECT_EQ(os::shared_level(own / "good" / "new"), "");
  for (const char* name : {"one", "two", "through"}) {
    EXPECT_EQ(os::shared_level(own / name), own / "open") << name;
  }
  EXPECT_EQ(os::shared_level(own / "round"), own / "round");
}

TEST(SharedLevel, OwnersAndGroupsCount) {
  const fs::path own = make(test::scratch_folder(), 0755), all = make(own / "all", 01777);
  constexpr uid_t kOther = 54321;
  make(own / "theirs" / "deep", 0755);
  make(all / "theirs", 0755);
  make(own / "group", 0775);
  fs::create_symlink(own, all / "link");
  if (chown((own / "theirs").c_str(), kOther, kOther) != 0) GTEST_SKIP() << "needs root";
  ASSERT_EQ(chown((all / "theirs").c_str(), kOther, kOther), 0);
  ASSERT_EQ(lchown((all / "link").c_str(), kOther, kOther), 0);
  EXPECT_EQ(os::shared_level(own / "theirs" / "deep"), own / "theirs");
  EXPECT_EQ(os::shared_level(all / "theirs"), all / "theirs");
  EXPECT_EQ(os::shared_level(all / "link"), all / "link");
  EXPECT_EQ(os::shared_level(own / "group"), "") << "root's own group";
  ASSERT_EQ(chown((own / "group").c_str(), 0, kOther), 0);
  EXPECT_EQ(os::shared_level(own / "group"), own / "group");
  make(own / "group", 0755);
  EXPECT_EQ(os::shared_level(own / "group"), "");
}

/// The variables that decide, while this lives.
class Variables {
 public:
  explicit Variables(const std::map<std::string, std::string>& values) {
    for (const char* name : {"POCL_CACHE_DIR", "XDG_CACHE_HOME", "HOME", "TMPDIR"}) {
      const char* before = std::getenv(name);
      before_[name] = before != nullptr ? std::optional<std::string>(before) : std::nullopt;
      const auto given = values.find(name);
      os::set_variable(name, given != values.end() ? given->second.c_str() : nullptr);
    }
  }
  ~Variables() {
    for (const auto& [name, value] : before_) {
      os::set_variable(name.c_str(), value ? value->c_str() : nullptr);
    }
  }
  Variables(const Variables&) = delete;
  Variables& operator=(const Variables&) = delete;

 private:
  std::map<std::string, std::optional<std::string>> before_;
};

std::string pocl() {
  const char* folder = std::getenv("POCL_CACHE_DIR");
  return folder != nullptr ? folder : "";
}

/// One warning, which names a level; or none.
void expect_warned(const ocl::KernelFolder& found, const fs::path& level) {
  ASSERT_EQ(found.warnings.size(), level.empty() ? 0U : 1U);
  if (level.empty()) return;
  EXPECT_EQ(found.warnings[0].code, "kernel-folder");
  EXPECT_NE(found.warnings[0].message.text().find("'" + level.string() + "'"), std::string::npos)
      << found.warnings[0].message.text();
}

TEST(KernelFolder, WithoutHomeIsThisUsersAlone) {
  const fs::path temporary = make(test::scratch_folder(), 01777);
  const fs::path user = temporary / ("kiln-" + std::to_string(geteuid()));
  for (const char* home : {"", "/dev/null"}) {
    const Variables set({{"TMPDIR", temporary}, {"HOME", home}, {"POCL_CACHE_DIR", ""}});
    const ocl::KernelFolder found = ocl::kernel_folder();
    EXPECT_EQ(found.kiln, user / "kiln");
    EXPECT_EQ(pocl(), user) << "else PoCL takes /tmp/pocl/kcache, whoever made it";
    expect_warned(found, "");
    EXPECT_EQ(fs::status(user).permissions(), fs::perms::owner_all);
  }
  // Somebody else was there first.
  make(user, 0777);
  const Variables set({{"TMPDIR", temporary}});
  try {
    ocl::kernel_folder();
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::device);
    EXPECT_STREQ(error.id(), "kernel-folder");
    EXPECT_NE(std::string(error.what()).find("'" + user.string() + "'"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(pocl(), "");
}

TEST(KernelFolder, IsTheHomesWhereThatIsSafe) {
  const fs::path home = make(test::scratch_folder(), 0755), temporary = test::scratch_folder();
  const std::map<std::string, std::string> variables = {{"HOME", home}, {"TMPDIR", temporary}};
  const fs::path user = temporary / ("kiln-" + std::to_string(geteuid()));
  {
    const Variables set(variables);
    EXPECT_EQ(ocl::kernel_folder().kiln, home / ".cache" / "kiln");
    EXPECT_EQ(pocl(), "");
    EXPECT_FALSE(fs::exists(user));
  }
  for (const char* level : {".cache/pocl/kcache", ".cache/kiln", ".cache/pocl", ".cache", "."}) {
    const fs::path folder = level == std::string(".") ? home : home / level;
    make(folder, 0777);
    const Variables set(variables);
    for (int time = 0; time < 2; ++time) {  // of a device opened later, too
      const ocl::KernelFolder found = ocl::kernel_folder();
      EXPECT_EQ(found.kiln, user / "kiln");
      EXPECT_EQ(pocl(), user);
      expect_warned(found, folder);
    }
    make(folder, 0755);
  }
  const Variables set(variables);
  expect_warned(ocl::kernel_folder(), "");
  EXPECT_EQ(pocl(), "");
}

TEST(KernelFolder, ThatTheUserNamesIsUsedWithAWarning) {
  const fs::path folder = make(test::scratch_folder(), 0755);
  for (const mode_t mode : {0755, 0777, 0555}) {
    make(folder, mode);
    const fs::path level = mode == 0777 ? folder : fs::path();
    {
      const Variables set({{"POCL_CACHE_DIR", folder}});
      const ocl::KernelFolder found = ocl::kernel_folder();
      EXPECT_EQ(found.kiln, folder / "kiln");
      EXPECT_EQ(pocl(), folder);
      expect_warned(found, level);
    }
    if (mode == 0555) continue;
    const Variables set({{"XDG_CACHE_HOME", folder}, {"HOME", "/"}});
    const ocl::KernelFolder found = ocl::kernel_folder();
    EXPECT_EQ(found.kiln, folder / "kiln");
    EXPECT_EQ(pocl(), "");
    expect_warned(found, level);
  }
  // Where all make names, Kiln makes it: no other user can be first, unseen.
  const fs::path made = make(test::scratch_folder(), 01777) / "cache";
  const Variables set({{"POCL_CACHE_DIR", made}});
  expect_warned(ocl::kernel_folder(), "");
  EXPECT_EQ(fs::status(made).permissions(), fs::perms::owner_all);
}

}  // namespace
}  // namespace kiln
