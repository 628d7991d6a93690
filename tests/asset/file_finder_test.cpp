// Whether a file lies in a folder.
#include "asset/file_finder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

TEST(LiesWithin, TakesRelativePathsThatAreNotThereByName) {
  ASSERT_FALSE(fs::exists("no_such_folder"));
  const fs::path here = fs::current_path();
  for (const fs::path& folder : {fs::path(), fs::path("."), fs::path("./"), here, here / ""}) {
    EXPECT_TRUE(lies_within(folder, "no_such_folder/deep/a.png")) << folder;
    EXPECT_TRUE(lies_within(folder, "no_such_folder")) << folder;
    EXPECT_TRUE(lies_within(folder, "no_such_folder/../a.png")) << folder;
    EXPECT_TRUE(lies_within(folder, here / "no_such_folder/a.png")) << folder;
    EXPECT_FALSE(lies_within(folder, "no_such_folder/../../a.png")) << folder;
    EXPECT_FALSE(lies_within(folder, "../a.png")) << folder;
    EXPECT_FALSE(lies_within(folder, here.parent_path() / "no_such_folder/a.png")) << folder;
  }
  for (const fs::path& folder :
       {fs::path("no_such_folder"), fs::path("no_such_folder/"), here / "no_such_folder/"}) {
    EXPECT_TRUE(lies_within(folder, "no_such_folder/a.png")) << folder;
    EXPECT_TRUE(lies_within(folder, here / "no_such_folder/deep/a.png")) << folder;
    EXPECT_FALSE(lies_within(folder, "no_such_folder_b/a.png")) << folder;
    EXPECT_FALSE(lies_within(folder, "a.png")) << folder;
  }
}

TEST(LiesWithin, FollowsLinks) {
  const fs::path folder = test::scratch_folder();
  fs::create_directories(folder / "in");
  fs::create_directories(folder / "out");
  std::ofstream(folder / "out/a.png") << "a";
  fs::create_symlink(folder / "out", folder / "in/link");
  fs::create_symlink(folder / "in", folder / "alias");
  EXPECT_FALSE(lies_within(folder / "in", folder / "in/link/a.png"));
  EXPECT_FALSE(lies_within(folder / "in", folder / "in/link/new.png"));
  EXPECT_TRUE(lies_within(folder / "in", folder / "alias/new.png"));
  EXPECT_TRUE(lies_within(folder / "alias", folder / "in/new.png"));
}

}  // namespace
}  // namespace kiln
