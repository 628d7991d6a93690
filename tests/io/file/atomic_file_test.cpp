#include "io/file/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/files.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

std::string output_error(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::output);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

// Both ways of hiding the file until it is whole must behave alike.
class AtomicFileTest : public testing::TestWithParam<bool> {
 protected:
  bool unnamed() const { return GetParam(); }
  fs::path folder_ = test::scratch_folder();
};

INSTANTIATE_TEST_SUITE_P(Both, AtomicFileTest, testing::Values(true, false),
                         [](const auto& test_case) {
                           return test_case.param ? "Unnamed" : "Named";
                         });

TEST_P(AtomicFileTest, AppearsAtCommitWithAllItsBytes) {
  const fs::path path = folder_ / "map.bin";
  const std::string text(1000000, 'x');
  {
    AtomicFile file(path, unnamed());
    file.write(text);
    file.write(std::string_view{});
    file.write("end");
    EXPECT_FALSE(fs::exists(path));
    file.commit();
  }
  EXPECT_EQ(test::read_file(path), text + "end");
  EXPECT_EQ(entries(folder_), 1u);
}

TEST_P(AtomicFileTest, WithoutCommitLeavesNothingAndKeepsTheOldFile) {
  const fs::path path = folder_ / "map.bin";
  std::ofstream(path) << "old";
  {
    AtomicFile file(path, unnamed());
    file.write("new");
  }
  EXPECT_EQ(test::read_file(path), "old");
  EXPECT_EQ(entries(folder_), 1u);
}

TEST_P(AtomicFileTest, ReplacesAnExistingFile) {
  const fs::path path = folder_ / "map.bin";
  std::ofstream(path) << "something older and longer";
  AtomicFile file(path, unnamed());
  file.write("new");
  file.commit();
  EXPECT_EQ(test::read_file(path), "new");
}

TEST_P(AtomicFileTest, CanBeWrittenByNameAfterClosingTheStream) {
  const fs::path path = folder_ / "map.bin";
  AtomicFile file(path, unnamed());
  file.close_stream();
  EXPECT_EQ(file.stream(), nullptr);
  ASSERT_TRUE(fs::exists(file.temporary()));
  EXPECT_EQ(file.temporary().parent_path(), folder_);
  std::ofstream(file.temporary()) << "by name";
  EXPECT_THROW(file.write("too late"), Error);
  file.commit();
  EXPECT_EQ(test::read_file(path), "by name");
  EXPECT_EQ(entries(folder_), 1u);
}

TEST_P(AtomicFileTest, GetsThePermissionsOfTheUmask) {
  for (const mode_t mask : {mode_t{022}, mode_t{077}, mode_t{0}}) {
    const mode_t before = umask(mask);
    const fs::path path = folder_ / ("mode" + std::to_string(mask));
    AtomicFile file(path, unnamed());
    file.write("x");
    file.commit();
    umask(before);
    struct stat found {};
    ASSERT_EQ(stat(path.c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0666 & ~mask);
  }
}

TEST_P(AtomicFileTest, FollowsALinkToAFile) {
  const fs::path real = folder_ / "real";
  const fs::path link = folder_ / "link";
  std::ofstream(real) << "old";
  fs::create_symlink("real", link);
  AtomicFile file(link, unnamed());
  file.write("new");
  file.commit();
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(test::read_file(real), "new");
}

TEST_P(AtomicFileTest, RelativePathsSurviveAChangeOfFolder) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  AtomicFile file("map.bin", unnamed());
  fs::current_path(before);
  file.write("x");
  file.commit();
  EXPECT_EQ(test::read_file(folder_ / "map.bin"), "x");
}

// A limit on file sizes fails writes the way a full disk does: part is written, then an error.
TEST_P(AtomicFileTest, AFileThatCannotGrowFailsAndLeavesNothing) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit limit = before;
  limit.rlim_cur = 100000;
  for (const bool at_commit : {false, true}) {
    const std::string text(at_commit ? 150000 : 1000000,
                           'x');  // the first fits the stream's buffer
    AtomicFile file(folder_ / "map.bin", unnamed());
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    bool written = false;
    const std::string message = output_error([&] {
      file.write(text);
      written = true;
      file.commit();
    });
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_EQ(written, at_commit);
    EXPECT_NE(message.find("map.bin"), std::string::npos) << message;
    EXPECT_NE(message.find("File too large"), std::string::npos) << message;
  }
  EXPECT_EQ(entries(folder_), 0u);
}

TEST_P(AtomicFileTest, AKilledProcessLeavesNoPartOfTheFile) {
  const pid_t child = fork();
  if (child == 0) {
    AtomicFile file(folder_ / "map.bin", unnamed());
    file.write(std::string(1000000, 'x'));
    std::raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_FALSE(fs::exists(folder_ / "map.bin"));
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_FALSE(unnamed()) << entry;  // a hidden name is all that may be left
    EXPECT_EQ(entry.path().filename().string().substr(0, 6), ".kiln-");
  }
}

TEST_P(AtomicFileTest, FoldersMadeForNothingGo) {
  const fs::path used = folder_ / "used", unused = folder_ / "unused", given = folder_ / "given";
  fs::create_directory(given);
  for (const fs::path& folder : {used, unused, given}) prepare_output_folder(folder);
  save_text(used / "file", "x");
  remove_empty_output_folders();
  EXPECT_TRUE(fs::exists(used / "file"));
  EXPECT_FALSE(fs::exists(unused));
  EXPECT_TRUE(fs::exists(given));
}

TEST_P(AtomicFileTest, ASignalHandlerCanRemoveWhatIsBeingWritten) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGTERM, [](int) {
      remove_temporary_files();
      _exit(7);
    });
    AtomicFile first(folder_ / "a", unnamed());
    AtomicFile second(folder_ / "b", unnamed());
    AtomicFile done(folder_ / "c", unnamed());
    first.close_stream();
    second.write("x");
    done.commit();
    std::raise(SIGTERM);
    _exit(8);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
  EXPECT_EQ(entries(folder_), 1u);
  EXPECT_TRUE(fs::exists(folder_ / "c"));
}

// True if or not something was begun in them.
TEST_P(AtomicFileTest, ASignalHandlerCanRemoveFoldersMadeForNothing) {
  const fs::path made = folder_ / "made", kept = folder_ / "kept", there = folder_ / "there";
  fs::create_directory(there);
  const pid_t child = fork();
  if (child == 0) {
    for (const fs::path& folder : {made, kept, there}) prepare_output_folder(folder);
    std::ofstream(kept / "map") << "whole";
    AtomicFile file(made / "map", unnamed());
    file.write("part");
    remove_temporary_files();
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_FALSE(fs::exists(made));
  EXPECT_TRUE(fs::exists(kept / "map"));
  EXPECT_TRUE(fs::exists(there));
}

TEST_P(AtomicFileTest, MoreFilesAtOnceThanTheRegistryHolds) {
  std::vector<std::unique_ptr<AtomicFile>> files;
  for (int i = 0; i < 100; ++i) {
    files.push_back(std::make_unique<AtomicFile>(folder_ / std::to_string(i), unnamed()));
    files.back()->close_stream();
  }
  EXPECT_EQ(entries(folder_), 100u);
  files[3]->commit();
  files.clear();
  EXPECT_EQ(entries(folder_), 1u);
}

TEST(AtomicFile, ErrorsNameTheFileTheProblemAndTheRemedy) {
  const fs::path folder = test::scratch_folder();
  const auto message = [](const fs::path& path) {
    return output_error([&] { AtomicFile file(path); });
  };
  std::string text = message(folder / "missing" / "map.png");
  EXPECT_NE(text.find("missing/map.png"), std::string::npos) << text;
  EXPECT_NE(text.find("does not exist"), std::string::npos) << text;
  EXPECT_NE(text.find("Create the folder"), std::string::npos) << text;

  EXPECT_NE(message(folder).find("there is a folder of this name"), std::string::npos);
  EXPECT_NE(message(folder / "new" / "").find("folder"), std::string::npos);
  EXPECT_NE(message("").find("name is empty"), std::string::npos);
  EXPECT_NE(message(folder / std::string(300, 'n')).find("shorter name"), std::string::npos);

  std::ofstream(folder / "file") << "x";
  text = message(folder / "file" / "map.png");
  EXPECT_NE(text.find("Not a directory"), std::string::npos) << text;
  EXPECT_EQ(entries(folder), 1u);
}

/// Root may write everywhere: within, it is a user without rights, and owns nothing.
class WithoutRights {
 public:
  WithoutRights() {
    if (root_) EXPECT_EQ(seteuid(65534), 0);
  }
  ~WithoutRights() {
    if (root_) EXPECT_EQ(seteuid(0), 0);
  }
  WithoutRights(const WithoutRights&) = delete;
  WithoutRights& operator=(const WithoutRights&) = delete;

 private:
  const bool root_ = geteuid() == 0;
};

TEST(AtomicFile, AWriteProtectedFolderOrFileIsRefused) {
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "file") << "x";
  const fs::perms read{0444};
  const fs::perms enter{0555};
  fs::permissions(folder.parent_path(), enter, fs::perm_options::add);
  fs::permissions(folder / "file", read);
  fs::permissions(folder, enter);
  {
    const WithoutRights user;
    ASSERT_EQ(test::read_file(folder / "file"),
              "x");  // so that it is the right to write that lacks
    for (const char* name : {"new", "file"}) {
      const std::string text = output_error([&] { AtomicFile file(folder / name); });
      EXPECT_NE(text.find("permissions"), std::string::npos) << text;
    }
  }
  EXPECT_EQ(entries(folder), 1U);
  fs::permissions(folder, fs::perms::owner_all);
}

TEST(AtomicFile, ADeviceIsWrittenToDirectly) {
  {
    AtomicFile file("/dev/null");
    file.write("x");
    file.commit();
  }
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  if (!fs::exists("/dev/full")) return;
  AtomicFile file("/dev/full");
  file.write("x");
  const std::string text = output_error([&] { file.commit(); });
  EXPECT_NE(text.find("No space left"), std::string::npos) << text;
  EXPECT_NE(text.find("Free some space"), std::string::npos) << text;
  EXPECT_TRUE(fs::exists("/dev/full"));
}

}  // namespace
}  // namespace kiln
