// Figures as text: tables and objects by columns.
#include "lab/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace kiln::cli {
namespace {

TEST(Table, WritesCellsOfEveryKindAsCsv) {
  Table table("name|whole|real|truth|none");
  table.add({"", std::uint64_t{18446744073709551615U}, 1.0 / 3, true, Json()});
  table.add({"b", -7, 1e-12, false, ""});
  table.add({"c", 0, 2.0, false, std::nan("")});
  EXPECT_EQ(table.csv(),
            "name,whole,real,truth,none\n"
            ",18446744073709551615,0.333333333,1,\n"
            "b,-7,1e-12,0,\n"
            "c,0,2,0,\n");
}

TEST(Table, KeepsNamesOfFilesWithinTheirCell) {
  Table table("name");
  table.add({"a,\"b\"\nc"});
  EXPECT_EQ(table.csv(), "name\n\"a,\"\"b\"\"\nc\"\n");
  EXPECT_EQ(markdown_cell("<img src=x>![a](b)|\x1b[2J\n&amp;"),
            "\\<img src=x\\>\\!\\[a\\](b)\\|\\\\x1b\\[2J \\&amp;");
  EXPECT_EQ(fixed_text(3e38, 2), "3e+38");
  EXPECT_EQ(fixed_text(2.5, 0), "2");
}

TEST(Table, AlignsMarkdown) {
  Table table("way|>seconds|^");
  table.add({"rays", "0.5", "●"});
  table.add({"views", "", ""});
  EXPECT_EQ(table.markdown(),
            "| way | seconds | |\n"
            "| --- | --: | :-: |\n"
            "| rays | 0.5 | ● |\n"
            "| views |  |  |\n");
}

TEST(Table, RefusesARowOfAnotherLength) {
  Table table("a|b");
  EXPECT_THROW(table.add({1}), std::logic_error);
  EXPECT_THROW(table.add({1, 2, 3}), std::logic_error);
  EXPECT_THROW(fields("a b", {1}), std::logic_error);
}

TEST(Table, MakesObjectsOfKeysAndValues) {
  EXPECT_EQ(fields("a b c", {1, "x", Json::array({2})}).dump(), R"({"a":1,"b":"x","c":[2]})");
  EXPECT_EQ(fields("pair", {Json::array({"a", "b"})}).dump(), R"({"pair":["a","b"]})");
}

}  // namespace
}  // namespace kiln::cli
