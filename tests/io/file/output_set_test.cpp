#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <thread>

#include "base/file.h"
#include "io/file/atomic_file.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::set<std::string> names(const fs::path& folder) {
  std::set<std::string> all;
  for (const auto& entry : fs::directory_iterator(folder)) all.insert(entry.path().filename());
  return all;
}

ErrorCode code_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::internal;
}

class OutputSetTest : public testing::Test {
 protected:
  fs::path folder_ = test::scratch_folder();
};

TEST_F(OutputSetTest, FilesAppearTogetherAtCommit) {
  std::ofstream(folder_ / "a") << "old";
  OutputSet set;
  save_text(folder_ / "a", "new a");
  save_text(folder_ / "b", "new b");
  EXPECT_EQ(test::read_file(folder_ / "a"), "old");
  EXPECT_FALSE(fs::exists(folder_ / "b"));
  EXPECT_EQ(test::read_file(OutputSet::temporary_path(folder_ / "b")), "new b");
  EXPECT_TRUE(OutputSet::temporary_path(folder_ / "c").empty());
  set.commit();
  EXPECT_EQ(test::read_file(folder_ / "a"), "new a");
  EXPECT_EQ(test::read_file(folder_ / "b"), "new b");
  EXPECT_EQ(names(folder_), (std::set<std::string>{"a", "b"}));
  EXPECT_TRUE(OutputSet::temporary_path(folder_ / "b").empty());
}

TEST_F(OutputSetTest, WithoutCommitNothingChanges) {
  std::ofstream(folder_ / "a") << "old";
  {
    OutputSet set;
    save_text(folder_ / "a", "new a");
    save_text(folder_ / "b", "new b");
    EXPECT_THROW(OutputSet(), Error);
  }
  EXPECT_EQ(test::read_file(folder_ / "a"), "old");
  EXPECT_EQ(names(folder_), std::set<std::string>{"a"});
  save_text(folder_ / "c", "alone");  // no set is open: at once
  EXPECT_EQ(test::read_file(folder_ / "c"), "alone");
}

TEST_F(OutputSetTest, TheLaterFileOfOneNameWins) {
  OutputSet set;
  save_text(folder_ / "a", "first");
  save_text(folder_ / "a", "second");
  EXPECT_EQ(test::read_file(OutputSet::temporary_path(folder_ / "a")), "second");
  set.commit();
  EXPECT_EQ(test::read_file(folder_ / "a"), "second");
  EXPECT_EQ(names(folder_), std::set<std::string>{"a"});
}

TEST_F(OutputSetTest, MoreFilesThanAProcessMayHaveOpenAreHeld) {
  constexpr rlim_t kMost = 400;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit few = before;
  few.rlim_cur = kMost;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  constexpr std::size_t kFiles = 3 * kMost;
  const auto name = [](std::size_t i) { return "f" + std::to_string(i); };
  {
    OutputSet dropped;
    for (std::size_t i = 0; i < kFiles; ++i) save_text(folder_ / name(i), "dropped");
  }
  EXPECT_TRUE(names(folder_).empty());
  OutputSet set;
  for (std::size_t i = 0; i < kFiles; ++i) save_text(folder_ / name(i), name(i));
  for (std::size_t i = 0; i < kFiles; i += 7) {
    EXPECT_FALSE(fs::exists(folder_ / name(i)));
    EXPECT_EQ(test::read_file(OutputSet::temporary_path(folder_ / name(i))), name(i));
  }
  set.commit();
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(names(folder_).size(), kFiles);
  for (std::size_t i = 0; i < kFiles; ++i) EXPECT_EQ(test::read_file(folder_ / name(i)), name(i));
}

// A folder that takes a file's name in between makes its rename fail.
TEST_F(OutputSetTest, OneFailureBringsBackAllThatWasThere) {
  for (const int failing : {0, 1, 2, 3}) {
    const fs::path folder = folder_ / std::to_string(failing);
    fs::create_directory(folder);
    std::ofstream(folder / "0") << "old 0";
    std::ofstream(folder / "2") << "old 2";
    OutputSet set;
    for (int i = 0; i < 4; ++i) save_text(folder / std::to_string(i), "new");
    const fs::path taken = folder / std::to_string(failing);
    const std::string before = test::read_file(taken);
    fs::remove(taken);
    fs::create_directories(taken / "inside");
    EXPECT_EQ(code_of([&] { set.commit(); }), ErrorCode::output);
    std::set<std::string> expected{"0", "2"};
    expected.insert(std::to_string(failing));
    EXPECT_EQ(names(folder), expected) << failing;
    for (const int i : {0, 2}) {
      if (i == failing) continue;
      EXPECT_EQ(test::read_file(folder / std::to_string(i)), "old " + std::to_string(i));
    }
  }
}

TEST_F(OutputSetTest, AFileThatWasReadIsNotWrittenOverByAnyName) {
  const Image image{2, 2, 1, {0, 0.25F, 0.5F, 1}};
  save_image(image, folder_ / "map.png", {ImageFormat::png8});
  fs::create_hard_link(folder_ / "map.png", folder_ / "hard.png");
  fs::create_symlink("map.png", folder_ / "soft.png");
  const std::string bytes = test::read_file(folder_ / "map.png");
  OutputSet set;
  load_image(folder_ / "soft.png");
  for (const char* name : {"map.png", "hard.png", "soft.png"}) {
    EXPECT_EQ(code_of([&] { save_image(image, folder_ / name, {ImageFormat::png8}); }),
              ErrorCode::usage)
        << name;
  }
  save_image(image, folder_ / "other.png", {ImageFormat::png8});
  set.commit();
  EXPECT_EQ(test::read_file(folder_ / "map.png"), bytes);
}

// The voxels stand in a file that the header names.
TEST_F(OutputSetTest, AFileNamedInsideAFileCounts) {
  std::ofstream(folder_ / "ramp.raw") << "01234567";
  std::ofstream(folder_ / "ramp.mhd")
      << "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
         "ElementDataFile = ramp.raw\n";
  OutputSet set;
  load_volume(folder_ / "ramp.mhd");
  for (const char* name : {"ramp.mhd", "ramp.raw"}) {
    EXPECT_EQ(code_of([&] { save_text(folder_ / name, "report"); }), ErrorCode::usage) << name;
  }
  set.commit();
  EXPECT_EQ(test::read_file(folder_ / "ramp.raw"), "01234567");
}

// It belongs to the mesh, also where no map needs it.
TEST_F(OutputSetTest, AMaterialFileThatAMeshNamesCounts) {
  std::ofstream(folder_ / "m.mtl") << "newmtl m\n";
  std::ofstream(folder_ / "mesh.obj") << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  fs::create_symlink("m.mtl", folder_ / "report.json");
  OutputSet set;
  load_mesh(folder_ / "mesh.obj");
  EXPECT_EQ(code_of([&] { save_text(folder_ / "report.json", "{}"); }), ErrorCode::usage);
  EXPECT_EQ(test::read_file(folder_ / "m.mtl"), "newmtl m\n");
}

TEST_F(OutputSetTest, WhatIsReadAfterAFileOfItsNameWasSavedCounts) {
  std::ofstream(folder_ / "mesh.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::string bytes = test::read_file(folder_ / "mesh.obj");
  OutputSet set;
  save_text(folder_ / "mesh.obj", "new");
  save_text(folder_ / "other", "new");
  load_mesh(folder_ / "mesh.obj");
  EXPECT_EQ(code_of([&] { set.commit(); }), ErrorCode::usage);
  EXPECT_EQ(test::read_file(folder_ / "mesh.obj"), bytes);
  EXPECT_EQ(names(folder_), std::set<std::string>{"mesh.obj"});
}

TEST_F(OutputSetTest, TwoFilesThatLinksMakeOneAreRefused) {
  fs::create_symlink("one", folder_ / "a");
  fs::create_symlink("one", folder_ / "b");
  OutputSet set;
  save_text(folder_ / "a", "a");
  save_text(folder_ / "." / "a", "a again");
  EXPECT_EQ(code_of([&] { save_text(folder_ / "b", "b"); }), ErrorCode::usage);
  EXPECT_EQ(code_of([&] { save_text(folder_ / "one", "b"); }), ErrorCode::usage);
  set.commit();
  EXPECT_EQ(test::read_file(folder_ / "one"), "a again");
}

TEST_F(OutputSetTest, WithoutASetAFileMayBeReadAndReplaced) {
  const Image image{1, 1, 1, {0.5F}};
  save_image(image, folder_ / "map.png", {ImageFormat::png8});
  load_image(folder_ / "map.png");
  save_image(image, folder_ / "map.png", {ImageFormat::png8});
  { OutputSet set; }
  save_image(image, folder_ / "map.png", {ImageFormat::png8});
}

TEST_F(OutputSetTest, AReplacedFileKeepsItsPermissions) {
  const fs::path path = folder_ / "a";
  std::ofstream(path) << "old";
  ASSERT_EQ(chmod(path.c_str(), 0640), 0);
  save_text(path, "new");
  struct stat found {};
  ASSERT_EQ(stat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 07777, 0640U);
}

// Locked by each of its names, the folder would wait for itself.
TEST_F(OutputSetTest, AFolderOfTwoNamesIsOne) {
  fs::create_directory(folder_ / "real");
  fs::create_directory_symlink("real", folder_ / "link");
  OutputSet set;
  save_text(folder_ / "real" / "a", "a");
  save_text(folder_ / "link" / "b", "b");
  set.commit();
  EXPECT_EQ(test::read_file(folder_ / "real" / "a"), "a");
  EXPECT_EQ(names(folder_ / "real"), (std::set<std::string>{"a", "b"}));
}

TEST_F(OutputSetTest, ALockIsNotAwaitedForEver) {
  const int held = os::lock_folder(folder_, 0);
  ASSERT_GE(held, 0);
  EXPECT_EQ(os::lock_folder(folder_, 0.01), -1);
  EXPECT_EQ(errno, EWOULDBLOCK);
  os::close(held);
  const int free = os::lock_folder(folder_, 0);
  EXPECT_GE(free, 0);
  os::close(free);
}

TEST_F(OutputSetTest, ALinkToNothingMakesWhatItNames) {
  fs::create_directory(folder_ / "there");
  fs::create_symlink("there/real", folder_ / "link");
  save_text(folder_ / "link", "text");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(test::read_file(folder_ / "there" / "real"), "text");
  fs::create_symlink("round", folder_ / "round");
  EXPECT_EQ(code_of([&] { save_text(folder_ / "round", "text"); }), ErrorCode::output);
}

// As a process leaves it that was killed after one of three files.
TEST_F(OutputSetTest, TheNextRunFinishesWhatAKilledOneBegan) {
  std::ofstream(folder_ / "a") << "new";  // renamed already
  std::ofstream(folder_ / "b") << "old";
  std::ofstream(folder_ / ".kiln-1-1.tmp") << "new";
  std::ofstream(folder_ / ".kiln-1-2.tmp") << "new";
  std::ofstream(folder_ / ".kiln-1-3.old") << "old";
  std::ofstream(folder_ / "outside") << "kept";
  std::string text;
  for (const char* word :
       {".kiln-1-0.tmp", "a", ".kiln-1-3.old", ".kiln-1-1.tmp", "b", "", ".kiln-1-2.tmp", "c", "",
        "outside", "d", "", ".kiln-1-9.tmp", "../e", ""}) {
    text += std::string(word) + '\0';
  }
  std::ofstream(folder_ / ".kiln-1-4.journal") << text;
  prepare_output_folder(folder_);
  for (const char* name : {"a", "b", "c"})
    EXPECT_EQ(test::read_file(folder_ / name), "new") << name;
  EXPECT_EQ(names(folder_), (std::set<std::string>{"a", "b", "c", "outside"}));
}

// Else the next set would put the killed run's file over this newer one.
TEST_F(OutputSetTest, AFileAloneFinishesItFirst) {
  std::ofstream(folder_ / ".kiln-1-1.tmp") << "killed";
  const std::string journal = std::string(".kiln-1-1.tmp") + '\0' + "a" + '\0' + '\0';
  std::ofstream(folder_ / ".kiln-1-4.journal") << journal;
  save_text(folder_ / "a", "newer");
  prepare_output_folder(folder_);
  EXPECT_EQ(test::read_file(folder_ / "a"), "newer");
  EXPECT_EQ(names(folder_), std::set<std::string>{"a"});
}

// A folder that several users write to: what another user left there decides nothing.
TEST_F(OutputSetTest, WhatAnotherUserLeftIsNotActedOn) {
  const auto leave = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return lchown((folder_ / name).c_str(), 54321, 54321) == 0;
  };
  std::ofstream(folder_ / "a") << "mine";
  const std::string journal = std::string(".kiln-1-1.tmp") + '\0' + "a" + '\0' + '\0';
  if (!leave(".kiln-1-4.journal", journal)) GTEST_SKIP() << "needs root";
  ASSERT_TRUE(leave(".kiln-1-1.tmp", "theirs"));
  ASSERT_TRUE(leave(".kiln-1-3.old", "old"));
  const std::set<std::string> before = names(folder_);
  prepare_output_folder(folder_);
  EXPECT_EQ(test::read_file(folder_ / "a"), "mine");
  EXPECT_EQ(names(folder_), before);
}

// A child replaces eight files again and again, each time by its next number, and is killed at any moment.
TEST_F(OutputSetTest, AfterAKillAllFilesAreOfOneRun) {
  constexpr int kFiles = 8;
  int mixed = 0, kills = 0;
  for (int attempt = 0; attempt < 12; ++attempt) {
    const pid_t child = fork();
    if (child == 0) {
      for (int run = 0;; ++run) {
        OutputSet set;
        for (int i = 0; i < kFiles; ++i) {
          save_text(folder_ / std::to_string(i), std::to_string(attempt * 1000000 + run));
        }
        set.commit();
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5 + attempt * 8));
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ++kills;
    std::set<std::string> before;
    for (int i = 0; i < kFiles; ++i) before.insert(test::read_file(folder_ / std::to_string(i)));
    mixed += before.size() > 1 ? 1 : 0;
    {
      OutputSet set;  // finishes, and sweeps
      save_text(folder_ / "x", "");
      save_text(folder_ / "y", "");
      set.commit();
    }
    std::set<std::string> after;
    for (int i = 0; i < kFiles; ++i) after.insert(test::read_file(folder_ / std::to_string(i)));
    ASSERT_EQ(after.size(), 1U) << "attempt " << attempt;
    for (const std::string& name : names(folder_)) {
      EXPECT_FALSE(name.ends_with(".journal") || name.ends_with(".old")) << name;
    }
  }
  RecordProperty("kills", kills);
  RecordProperty("mixed_before", mixed);
}

// Two processes write the same set: every set that is seen under the lock is of one of them.
TEST_F(OutputSetTest, TwoWritersDoNotMix) {
  std::array<pid_t, 2> children{};
  for (std::size_t k = 0; k < children.size(); ++k) {
    children[k] = fork();
    if (children[k] != 0) continue;
    for (int run = 0; run < 10; ++run) {
      OutputSet set;
      for (const char* name : {"a", "b", "c"})
        save_text(folder_ / name, std::string(1, 'x' + static_cast<char>(k)));
      set.commit();
    }
    _exit(0);
  }
  for (const pid_t child : children) {
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(test::read_file(folder_ / "a"), test::read_file(folder_ / "b"));
  EXPECT_EQ(test::read_file(folder_ / "b"), test::read_file(folder_ / "c"));
  EXPECT_EQ(names(folder_), (std::set<std::string>{"a", "b", "c"}));
}

TEST_F(OutputSetTest, TheNextRunRemovesWhatKilledOnesLeft) {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  const std::string mark = os::process_namespace_id(), other = mark[0] == '0' ? "1" : "0";
  const std::string dead = std::to_string(child), alive = std::to_string(getppid());
  const std::string elsewhere = other + mark.substr(1), old = ".kiln-" + elsewhere + "-7-8.tmp";
  const std::set<std::string> left = {".kiln-" + mark + "-" + dead + "-0.tmp",
                                      ".kiln-" + mark + "-" + dead + "-12.tmp", old,
                                      ".kiln-9999999-3.tmp"};
  const std::set<std::string> kept = {
      ".kiln-" + mark + "-" + alive + "-0.tmp",      // its process runs
      ".kiln-" + elsewhere + "-" + dead + "-0.tmp",  // perhaps too, on another machine
      ".kiln-" + dead + "-1.tmp",                    // an earlier version's, of nobody knows which
      ".kiln-" + mark + "-" + dead + "-0.txt",       // none of ours
      ".kiln-" + mark + "-" + dead + "x-0.tmp",
      ".kiln-" + mark + "-" + dead + "-.tmp",
      ".kiln-notes.tmp",
      ".kiln-notes.old",
      "kiln-" + mark + "-" + dead + "-0.tmp"};
  for (const auto* all : {&left, &kept}) {
    for (const std::string& name : *all) std::ofstream(folder_ / name) << name;
  }
  const auto days_ago = [&](const std::string& name, int days) {
    fs::last_write_time(folder_ / name,
                        fs::file_time_type::clock::now() - std::chrono::hours(24 * days));
  };
  days_ago(old, 8);
  days_ago(".kiln-9999999-3.tmp", 8);
  for (const std::string& name : kept) days_ago(name, name.find(dead + "-") != name.npos ? 6 : 60);
  const std::string link = ".kiln-" + mark + "-" + dead + "-5.tmp";
  fs::create_symlink("x", folder_ / link);
  save_text(folder_ / "x", "");
  std::set<std::string> expected = kept;
  expected.insert({"x", link});
  EXPECT_EQ(names(folder_), expected);
}

// A process that is killed while it holds its files back leaves nothing.
TEST_F(OutputSetTest, AKillBeforeCommitLeavesNothing) {
  const pid_t child = fork();
  if (child == 0) {
    OutputSet set;
    for (int i = 0; i < 5; ++i) save_text(folder_ / std::to_string(i), "text");
    std::raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  for (const std::string& name : names(folder_)) {
    EXPECT_TRUE(name.starts_with(".kiln-")) << name;  // only where the file system has no O_TMPFILE
  }
}

}  // namespace
}  // namespace kiln
