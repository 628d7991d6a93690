// Folders of compiled kernels, which are code: nobody else may be able to put files there.
#include "cl/kernel_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <string>

#include "base/file.h"
#include "cl/context.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"

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
  EXPECT_EQ(os::find_unsafe_level(own), "");
  EXPECT_EQ(os::find_unsafe_level(own / "not" / "there"), "");
  make(own / "a" / "b", 0700);
  EXPECT_EQ(os::find_unsafe_level(own / "a" / "b"), "");
  make(own / "a", 0777);
  for (const char* path : {"a", "a/", "a/.", "a/b", "a/b/not/there", "a/b/../../a/b"}) {
    EXPECT_EQ(os::find_unsafe_level(own / path), own / "a") << path;
  }
  EXPECT_EQ(os::find_unsafe_level(own / "a" / ".."), own / "a") << "the way leads through it";
  make(own / "a", 0755);
  EXPECT_EQ(os::find_unsafe_level(own / "a" / "b"), "");
}

TEST(SharedLevel, WhereAllMakeNamesOnesOwnAreSafe) {
  const fs::path own = make(test::scratch_folder(), 0755), all = make(own / "all", 01777);
  make(all / "mine", 0700);
  EXPECT_EQ(os::find_unsafe_level(all / "mine"), "");
  EXPECT_EQ(os::find_unsafe_level(all / "mine" / "new"), "");
  for (const char* path : {".", "", "mine/.."}) {
    EXPECT_EQ(os::find_unsafe_level(all / path), all) << path << ": others may put files into it";
  }
  EXPECT_EQ(os::find_unsafe_level(all / "new"), all / "new") << "another may make it first";
  EXPECT_EQ(os::find_unsafe_level(all / "mine" / ".." / "new"), all / "new");
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
  EXPECT_EQ(os::find_unsafe_level(own / "good"), "");
  EXPECT_EQ(os::find_unsafe_level(own / "good" / "new"), "");
  for (const char* name : {"one", "two", "through"}) {
    EXPECT_EQ(os::find_unsafe_level(own / name), own / "open") << name;
  }
  EXPECT_EQ(os::find_unsafe_level(own / "round"), own / "round");
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
  EXPECT_EQ(os::find_unsafe_level(own / "theirs" / "deep"), own / "theirs");
  EXPECT_EQ(os::find_unsafe_level(all / "theirs"), all / "theirs");
  EXPECT_EQ(os::find_unsafe_level(all / "link"), all / "link");
  EXPECT_EQ(os::find_unsafe_level(own / "group"), "") << "root's own group";
  ASSERT_EQ(chown((own / "group").c_str(), 0, kOther), 0);
  EXPECT_EQ(os::find_unsafe_level(own / "group"), own / "group");
  make(own / "group", 0755);
  EXPECT_EQ(os::find_unsafe_level(own / "group"), "");
}

/// The variables that decide, while this lives.
class Variables {
 public:
  explicit Variables(const std::map<std::string, std::string>& values) {
    for (const char* name : {"POCL_CACHE_DIR", "XDG_CACHE_HOME", "HOME", "TMPDIR"}) {
      const char* before = std::getenv(name);
      before_[name] = before != nullptr ? std::optional<std::string>(before) : std::nullopt;
      const auto given = values.find(name);
      os::set_environment_variable(name, given != values.end() ? given->second.c_str() : nullptr);
    }
  }
  ~Variables() {
    for (const auto& [name, value] : before_) {
      os::set_environment_variable(name.c_str(), value ? value->c_str() : nullptr);
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
  for (const mode_t mode : {0755, 0777}) {
    make(folder, mode);
    const fs::path level = mode == 0777 ? folder : fs::path();
    {
      const Variables set({{"POCL_CACHE_DIR", folder}});
      const ocl::KernelFolder found = ocl::kernel_folder();
      EXPECT_EQ(found.kiln, folder / "kiln");
      EXPECT_EQ(pocl(), folder);
      expect_warned(found, level);
    }
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

/// Runs checks as a user without rights, in a process of its own: root may write anywhere. True if all hold.
bool holds_as_other_user(const std::function<bool()>& checks) {
  const pid_t child = fork();
  if (child == 0) {
    const bool other = geteuid() != 0 || (setgid(65534) == 0 && setuid(65534) == 0);
    bool good = false;
    try {
      good = other && checks();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
    }
    _exit(good ? 0 : 1);
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

/// An image's kernels serve any user, though nobody may write there.
TEST(KernelFolder, ThatIsReadOnlyIsCopied) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, whose folders others trust";
  const fs::path image = make(test::scratch_folder() / "image", 0755);
  const fs::path temporary = make(test::scratch_folder() / "tmp", 01777);
  fs::permissions(image.parent_path().parent_path(), fs::perms(0755));
  for (const fs::path& folder : {image.parent_path(), temporary.parent_path()})
    fs::permissions(folder, fs::perms(0755));
  make(image / "AB" / "program" / "kernel", 0755);
  make(image / "kiln", 0755);
  std::ofstream(image / "AB" / "program" / "program.bc") << "bitcode";
  std::ofstream(image / "AB" / "program" / "kernel" / "kernel.so") << "code";
  std::ofstream(image / "kiln" / "passed.bin") << "passed";
  std::ofstream(image / "secret") << "of root alone";
  fs::permissions(image / "secret", fs::perms(0600));
  const fs::path user = temporary / "kiln-65534";
  EXPECT_TRUE(holds_as_other_user([&] {
    const Variables set({{"TMPDIR", temporary}, {"POCL_CACHE_DIR", image}});
    bool good = true;
    for (int device = 0; device < 2; ++device) {
      const ocl::KernelFolder found = ocl::kernel_folder();
      good = good && found.kiln == user / "kiln" && found.warnings.empty() && pocl() == user;
    }
    return good && test::read_file(user / "AB/program/program.bc") == "bitcode" &&
           test::read_file(user / "AB/program/kernel/kernel.so") == "code" &&
           test::read_file(user / "kiln/passed.bin") == "passed" && !fs::exists(user / "secret") &&
           os::find_unsafe_level(user / "AB/program/kernel/kernel.so").empty();
  }));
  // What the user compiled since stays, and no half file is left.
  std::ofstream(user / "AB" / "program" / "program.bc") << "newer";
  std::size_t files = 0;
  EXPECT_TRUE(holds_as_other_user([&] {
    const Variables set({{"TMPDIR", temporary}, {"POCL_CACHE_DIR", image}});
    ocl::kernel_folder();
    return test::read_file(user / "AB/program/program.bc") == "newer";
  }));
  for (const auto& entry : fs::recursive_directory_iterator(user)) files += entry.is_regular_file();
  EXPECT_EQ(files, 3U);
  // Another user's folder is code of theirs.
  fs::remove_all(user);
  ASSERT_EQ(chown(image.c_str(), 54321, 54321), 0);
  EXPECT_TRUE(holds_as_other_user([&] {
    const Variables set({{"TMPDIR", temporary}, {"POCL_CACHE_DIR", image}});
    const ocl::KernelFolder found = ocl::kernel_folder();
    return found.kiln == user / "kiln" && found.warnings.size() == 1 &&
           found.warnings[0].message.text().find(image.string()) != std::string::npos &&
           !fs::exists(user / "AB");
  }));
  // And where nothing can be written, that is said, where PoCL would end the process.
  ASSERT_EQ(chown(image.c_str(), 0, 0), 0);
  make(temporary, 0555);
  fs::remove_all(user);
  EXPECT_TRUE(holds_as_other_user([&] {
    const Variables set({{"TMPDIR", temporary}, {"POCL_CACHE_DIR", image}});
    try {
      ocl::kernel_folder();
    } catch (const Error& error) {
      return error.id() == std::string("kernel-folder") &&
             std::string(error.what()).find("POCL_CACHE_DIR") != std::string::npos;
    }
    return false;
  }));
}

/// PoCL does not start if its folder is ".", and a program may change its current folder afterwards.
TEST(KernelFolder, RelativePathsStartAtTheFirstCurrentFolder) {
  const fs::path start = fs::current_path();
  const fs::path own = fs::canonical(make(test::scratch_folder(), 0700));
  make(own / "other", 0700);
  make(own / "open", 0777);
  fs::create_symlink("open", own / "link");
  struct Case {
    const char *given, *folder, *shared;
  };
  for (const auto& [given, folder, shared] :
       {Case{".", "", ""}, Case{"./new/.", "new", ""}, Case{"a/b", "a/b", ""},
        Case{"other/..", "other/..", ""}, Case{"link", "link", "open"}}) {
    fs::current_path(own);
    const Variables set({{"POCL_CACHE_DIR", given}});
    const fs::path absolute = *folder == '\0' ? own : own / folder;
    for (int call = 0; call < 2; ++call) {
      const ocl::KernelFolder found = ocl::kernel_folder();
      EXPECT_EQ(found.kiln, absolute / "kiln") << given;
      EXPECT_EQ(pocl(), absolute) << given;
      expect_warned(found, *shared == '\0' ? fs::path() : own / shared);
      fs::current_path(own / "other");
    }
  }
  fs::current_path(own);
  const Variables set({{"XDG_CACHE_HOME", "."}});
  for (int call = 0; call < 2; ++call) {
    EXPECT_EQ(ocl::kernel_folder().kiln, own / "kiln");
    fs::current_path(own / "other");
  }
  fs::current_path(start);
}

/// Number of compiled kernels in a folder.
std::size_t count_kernels(const fs::path& folder) {
  std::size_t kernels = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    kernels += entry.path().extension() == ".so" ? 1 : 0;
  }
  return kernels;
}

/// A square of n x n quads with waves.
void write_grid(const fs::path& path, int n, double height, bool has_uvs) {
  std::ofstream to(path);
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      to << "v " << 1.0 * i / n << ' ' << 1.0 * j / n << ' ' << height * ((i + j) % 3) << '\n';
      if (has_uvs) to << "vt " << 1.0 * i / n << ' ' << 1.0 * j / n << '\n';
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i + 1;
      to << 'f';
      for (const int corner : {a, a + 1, a + n + 2, a + n + 1}) {
        to << ' ' << corner;
        if (has_uvs) to << '/' << corner;
      }
      to << '\n';
    }
  }
}

/// `kiln devices --warm` leaves a folder from which any user bakes without compiling, though nobody may write there.
TEST(KernelFolder, ThatWasWarmedServesAnyUser) {
  KILN_REQUIRE_DEVICE();
  if (geteuid() != 0) GTEST_SKIP() << "needs root, whose folders others trust";
  if (!is_pocl(test::device()->info())) GTEST_SKIP() << "PoCL alone has this folder";
  const fs::path root = make(test::scratch_folder(), 0755), image = make(root / "image", 0755);
  const fs::path temporary = make(root / "tmp", 01777), out = make(root / "out", 0777);
  fs::permissions(root.parent_path(), fs::perms(0755));
  const std::string maps = "normal,ao,curvature,id";
  test::ProcessOptions warm;
  warm.environment = {{"POCL_CACHE_DIR", image}, {"POCL_KERNEL_CACHE", "1"}};
  const test::ProcessResult warmed = test::run_kiln({"devices", "--warm", "--maps", maps}, warm);
  ASSERT_EQ(warmed.exit_code, 0) << warmed.errors;
  const std::size_t kernels = count_kernels(image);
  EXPECT_GT(kernels, 4U);

  write_grid(root / "high.obj", 40, 0.02, false);
  write_grid(root / "low.obj", 2, 0, true);
  const test::ProcessResult baked = test::run_process({"setpriv",
                                                       "--reuid",
                                                       "65534",
                                                       "--regid",
                                                       "65534",
                                                       "--clear-groups",
                                                       "env",
                                                       "-u",
                                                       "HOME",
                                                       "-u",
                                                       "XDG_CACHE_HOME",
                                                       "TMPDIR=" + temporary.string(),
                                                       "POCL_CACHE_DIR=" + image.string(),
                                                       test::kiln_command(),
                                                       "bake",
                                                       (root / "high.obj").string(),
                                                       (root / "low.obj").string(),
                                                       "--size",
                                                       "300",
                                                       "--maps",
                                                       maps,
                                                       "--out",
                                                       out.string(),
                                                       "--quiet"});
  EXPECT_EQ(baked.exit_code, 0) << baked.errors;
  EXPECT_EQ(count_kernels(image), kernels) << "written to";
  EXPECT_EQ(count_kernels(temporary / "kiln-65534"), kernels) << "compiled again";
}

}  // namespace
}  // namespace kiln
