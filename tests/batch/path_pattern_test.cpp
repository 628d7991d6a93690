// Patterns of paths beside the standard library's regular expressions, and what they capture.
#include "batch/path_pattern.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;

bool matches(const char* pattern, const std::string& path, Captures* captures = nullptr) {
  Captures found;
  const bool match = PathPattern(pattern).matches(path, {}, found);
  if (captures != nullptr) *captures = found;
  return match;
}

/// The same rules as a regular expression.
std::string expression_of(const std::string& pattern) {
  std::string expression;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const char c = pattern[i];
    if (pattern.compare(i, 3, "**/") == 0 && (i == 0 || pattern[i - 1] == '/')) {
      expression += "(?:[^/]+/)*";
      i += 2;
    } else if (c == '*') {
      expression += "[^/]*";
    } else if (c == '?') {
      expression += "[^/]";
    } else if (c == '{') {
      expression += "(?:";
    } else if (c == '}') {
      expression += ")";
    } else if (c == ',') {
      expression += "|";
    } else if (c == '.') {
      expression += "\\.";
    } else {
      expression += c;
    }
  }
  return expression;
}

TEST(PathPattern, MatchesAsARegularExpressionDoes) {
  std::mt19937 random(7);
  const std::vector<std::string> parts = {"a", "b", ".o", "/", "*", "?", "{a,bb}", "**/", "ab"};
  const std::vector<std::string> texts = {"a", "b", "bb", "/", ".o"};
  std::size_t matched = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string pattern, path;
    for (std::size_t k = random() % 6 + 1; k > 0; --k) {
      const std::string& part = parts[random() % parts.size()];
      if (part == "**/" && !pattern.empty() && !pattern.ends_with('/')) continue;
      if (part == "*" && pattern.ends_with('*')) continue;  // ** alone is *
      pattern += part;
    }
    if (pattern.empty() || pattern.starts_with('/') || pattern.find("//") != std::string::npos)
      continue;
    for (std::size_t k = random() % 6 + 1; k > 0; --k) path += texts[random() % texts.size()];
    // Paths of files have neither empty names nor, here, hidden ones.
    if (path.starts_with('/') || path.ends_with('/') || path.find("//") != std::string::npos ||
        path.starts_with('.') || path.find("/.") != std::string::npos) {
      continue;
    }
    const bool expected = std::regex_match(path, std::regex(expression_of(pattern)));
    ASSERT_EQ(matches(pattern.c_str(), path), expected) << pattern << " " << path;
    matched += expected ? 1 : 0;
  }
  EXPECT_GT(matched, 500U);
}

TEST(PathPattern, CapturesNamesAndFolders) {
  Captures captures;
  ASSERT_TRUE(matches("assets/{dir}/{name}_low.*", "assets/props/old/crate_low.obj", &captures));
  EXPECT_EQ(captures, (Captures{{"dir", "props/old"}, {"name", "crate"}}));
  ASSERT_TRUE(matches("assets/{dir}/{name}_low.*", "assets/crate_low.obj", &captures));
  EXPECT_EQ(captures, (Captures{{"dir", ""}, {"name", "crate"}}));
  // The earlier capture is the longer one.
  ASSERT_TRUE(matches("{a}_{b}", "x_y_z", &captures));
  EXPECT_EQ(captures, (Captures{{"a", "x_y"}, {"b", "z"}}));
  // One name is one text.
  EXPECT_TRUE(matches("{name}/{name}.obj", "crate/crate.obj"));
  EXPECT_FALSE(matches("{name}/{name}.obj", "crate/box.obj"));
  EXPECT_FALSE(matches("{name}_low.obj", "_low.obj"));
  EXPECT_FALSE(matches("{name}_low.obj", "a/b_low.obj"));
  EXPECT_TRUE(matches("a\\{name}.obj", "a/b.obj"));
  EXPECT_TRUE(matches("[*][{]x[}].obj", "*{x}.obj"));
  EXPECT_FALSE(matches("*.obj", ".hidden.obj"));
}

/// Captures are those of all alternatives, each once, in the order in which they first stand.
TEST(PathPattern, CapturesOfEveryAlternative) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(PathPattern("a/b.obj").captures(), Names());
  EXPECT_EQ(PathPattern("{dir}/{name}.obj").captures(), (Names{"dir", "name"}));
  EXPECT_EQ(PathPattern("{name}_{a,b}_{of}.obj").captures(), (Names{"name", "of"}));
  Captures captures;
  for (const char* const path : {"x_a_y.obj", "x_b_y.obj"}) {
    ASSERT_TRUE(matches("{name}_{a,b}_{of}.obj", path, &captures)) << path;
    EXPECT_EQ(captures, (Captures{{"name", "x"}, {"of", "y"}})) << path;
  }
}

TEST(PathPattern, FillsInCapturesAsTheyAre) {
  const PathPattern out("out/{dir}/{name}");
  EXPECT_EQ(out.path({{"dir", "a/b"}, {"name", "c"}}), "out/a/b/c");
  EXPECT_EQ(out.path({{"dir", ""}, {"name", "c"}}), "out/c");
  // What was captured is no pattern itself.
  EXPECT_EQ(out.path({{"dir", "a"}, {"name", "x*{y}?"}}), "out/a/x*{y}?");
  EXPECT_THROW(out.path({{"dir", "a"}}), Error);
  EXPECT_THROW(PathPattern("*.obj").path({}), Error);
}

TEST(PathPattern, RefusesWhatItCannotRead) {
  for (const char* const pattern : {"{", "a{b", "{a{b}}", "{a b}", "{}"}) {
    EXPECT_THROW(PathPattern{pattern}, Error) << pattern;
  }
  std::string many;
  for (int i = 0; i < 20; ++i) many += "{a,b}";
  EXPECT_THROW(PathPattern{many}, Error);
  // Backtracking has an end.
  std::string stars;
  for (int i = 0; i < 40; ++i) stars += "*a";
  EXPECT_THROW(matches((stars + "b").c_str(), std::string(200, 'a')), Error);
}

TEST(FileLister, FindsFilesAndSaysWhatItCannotRead) {
  const fs::path folder = scratch_folder();
  fs::create_directories(folder / "assets/props/old");
  fs::create_directories(folder / ".git");
  for (const char* const file :
       {"assets/a_low.obj", "assets/props/b_low.obj", "assets/props/old/c_low.ply",
        "assets/props/old/.d_low.ply", ".git/e_low.obj", "assets/x.txt"}) {
    std::ofstream(folder / file) << "x";
  }
  FileLister lister(folder);
  const auto paths = [&](const char* pattern) {
    std::vector<std::string> found;
    for (const FileLister::FoundFile& file : lister.find(PathPattern(pattern)))
      found.push_back(file.path);
    return found;
  };
  using Paths = std::vector<std::string>;
  EXPECT_EQ(paths("assets/{dir}/{name}_low.*"),
            (Paths{"assets/a_low.obj", "assets/props/b_low.obj", "assets/props/old/c_low.ply"}));
  EXPECT_EQ(paths("assets/*/{name}_low.*"), Paths{"assets/props/b_low.obj"});
  EXPECT_EQ(paths("**/*.{txt,ply}"), (Paths{"assets/props/old/c_low.ply", "assets/x.txt"}));
  EXPECT_EQ(paths("assets/a_low.obj"), Paths{"assets/a_low.obj"});
  EXPECT_EQ(paths("nowhere/*.obj"), Paths());
  const std::string whole = (folder / "assets").string() + "/*.txt";
  EXPECT_EQ(paths(whole.c_str()), Paths{folder / "assets/x.txt"});
  // A link to a folder above leads in circles.
  fs::create_directory_symlink(folder, folder / "assets/loop");
  FileLister again(folder);
  EXPECT_THROW(again.find(PathPattern("**/*.txt")), Error);
}

}  // namespace
}  // namespace kiln::test
