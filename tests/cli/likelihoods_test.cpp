// --view-weight FILE, and small files in general.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "job/files.h"
#include "job/lists.h"
#include "kiln/error.h"
#include "support/environment.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
    EXPECT_EQ(std::string(error.what()).find("--size"), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "was read";
  return {};
}

std::string refused_text(const std::string& text) {
  return refusal([&] { parse_likelihoods(text, "views.txt"); });
}

TEST(Likelihoods, LinesByAnyEnd) {
  for (const std::string end : {"\n", "\r", "\r\n"}) {
    const auto list = parse_likelihoods("\xEF\xBB\xBF# from the front" + end + end + " 0 0\t1 2" +
                                            end + "+1 -2e-1 0 .5 # side" + end,
                                        "views.txt");
    ASSERT_EQ(list.size(), 2u);
    EXPECT_EQ(list[0].direction, (Vec3{0, 0, 1}));
    EXPECT_EQ(list[0].weight, 2);
    EXPECT_EQ(list[1].direction, (Vec3{1, -0.2F, 0}));
    EXPECT_EQ(list[1].weight, 0.5);
  }
}

TEST(Likelihoods, BadLinesAreNamed) {
  for (const char* line :
       {"0 0 1", "0 0 1 2 3", "0 0 0 1", "0 0 1 -1", "a 0 1 1", "0 0 1 x", "nan 0 1 1", "0 0 1 inf",
        "1e300 0 0 1", "1e-60 0 0 1", "0 0 1 1e999", "0 0 1 2x"}) {
    const std::string text = refused_text("1 0 0 1\n\n" + std::string(line) + "\n");
    EXPECT_NE(text.find("'views.txt', line 3"), std::string::npos) << text;
  }
  EXPECT_NE(refused_text("# nothing\n").find("has no line"), std::string::npos);
  EXPECT_NE(refused_text(std::string(1000, '\0')).find("line 1"), std::string::npos);
}

TEST(Likelihoods, TooManyAreRefused) {
  std::string text;
  for (int i = 0; i < 65536; ++i) text += "0 0 1 1\n";
  EXPECT_EQ(parse_likelihoods(text, "views.txt").size(), 65536u);
  EXPECT_NE(refused_text(text + "0 0 1 1\n").find("line 65537"), std::string::npos);
}

// Each at once, and none takes memory by what it is not.
TEST(SmallFile, RegularFilesOnly) {
  const fs::path folder = test::scratch_folder();
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const fs::path& path : {pipe, fs::path("/dev/zero"), folder, folder / "missing"}) {
    const std::string text = refusal([&] { load_likelihoods(path.string()); });
    EXPECT_NE(text.find(path.string()), std::string::npos) << text;
    EXPECT_NE(text.find("horizon"), std::string::npos) << text;
    EXPECT_FALSE(is_readable_file(path));
    EXPECT_EQ(head_of_file(path, 6), "");
  }
}

TEST(SmallFile, TextAlone) {
  const fs::path file = test::scratch_folder() / "views.txt";
  const std::string text("1 0 0 1\n\0 0 1 0 1\n", 18);
  std::ofstream(file, std::ios::binary) << text;
  const std::string message = refusal([&] { read_small_file(file, 100, "the file"); });
  EXPECT_NE(message.find("contains null bytes"), std::string::npos) << message;
}

/// Files of /proc state 0 bytes: the limit holds for what they hold.
TEST(SmallFile, LongOnesThatStateNoSizeAreRefused) {
  const fs::path path = "/proc/version";
  if (!is_readable_file(path)) GTEST_SKIP() << "no /proc";
  const std::string text = read_small_file(path, 1 << 20, "It");
  ASSERT_GT(text.size(), 1U);
  EXPECT_EQ(read_small_file(path, text.size(), "It"), text);
  EXPECT_NE(refusal([&] { read_small_file(path, text.size() - 1, "It"); }).find("longer"),
            std::string::npos);
}

TEST(SmallFile, LongOnesAreRefusedUnread) {
  const fs::path path = test::scratch_folder() / "long.txt";
  std::ofstream(path) << "# Kiln made it\n";
  EXPECT_EQ(head_of_file(path, 6), "# Kiln");
  EXPECT_EQ(read_small_file(path, 15, "It"), "# Kiln made it\n");
  EXPECT_NE(refusal([&] { read_small_file(path, 14, "It"); }).find("longer"), std::string::npos);
  fs::resize_file(path, std::uintmax_t{1} << 40);  // a hole
  EXPECT_NE(refusal([&] { load_likelihoods(path.string()); }).find("16 MiB"), std::string::npos);
}

}  // namespace
}  // namespace kiln::cli
