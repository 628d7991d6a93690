// TOML files: what a key is, beside strings of all four kinds that hold what keys have.
#include "batch/toml.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "kiln/error.h"

namespace kiln {
namespace {

/// A key of one more part than dots.
std::string key_with(std::size_t dots) {
  std::string text = "p";
  for (std::size_t i = 0; i < dots; ++i) text += ".p";
  return text;
}

std::string error_of(const std::string& text) {
  try {
    parse_toml(text, "job.toml");
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(Toml, KeysHaveFewPartsAndStringsAnyDots) {
  EXPECT_EQ(error_of(key_with(15) + " = 1\n"), "");
  const std::string message = error_of("a = 1\n" + key_with(16) + " = 1\n");
  EXPECT_NE(message.find("job.toml:2:1"), std::string::npos) << message;
  EXPECT_NE(message.find("more than 16 parts"), std::string::npos) << message;
  // Strings and comments that hold dots, the other quotes, escaped quotes and ends of lines.
  const std::string dots = key_with(40);
  for (const std::string& value : {
           '"' + dots + '"',
           '\'' + dots + '\'',
           "\"it's " + dots + '"',
           "'say \" " + dots + '\'',
           R"("\" )" + dots + R"( \\")",
           R"('C:\)" + dots + R"(\')",
           "\"\"\"\n" + dots + " \" '\n\"\"\"",
           "'''\n" + dots + " ' \"\n'''",
           "\"\" # " + dots,
           "'' # it's " + dots,
       }) {
    const std::string text = "first = " + value + "\nsecond = 2\n";
    EXPECT_EQ(error_of(text), "") << text;
    const TomlValue table = parse_toml(text, "job.toml");
    ASSERT_NE(table.find("second"), nullptr) << text;
    EXPECT_EQ(table.find("second")->text, "2") << text;
    // Keys after them are still counted, at their own lines.
    std::size_t line = 1;
    for (const char c : text) line += c == '\n' ? 1 : 0;
    const std::string error = error_of(text + key_with(20) + " = 1\n");
    EXPECT_NE(error.find("job.toml:" + std::to_string(line) + ":1"), std::string::npos)
        << text << error;
  }
}

TEST(Toml, KeysKeepTheOrderOfTheFile) {
  const TomlValue table = parse_toml("b = 1\na = 2\n\n[z]\nd = [1, 'two']\nc = 0.5\n", "job.toml");
  EXPECT_EQ(table.keys, (std::vector<std::string>{"b", "a", "z"}));
  EXPECT_EQ(table.find("a")->line, 2U);
  const TomlValue& z = *table.find("z");
  EXPECT_EQ(z.keys, (std::vector<std::string>{"d", "c"}));
  ASSERT_EQ(z.find("d")->elements.size(), 2U);
  EXPECT_EQ(z.find("d")->elements[0].text, "1");
  EXPECT_EQ(z.find("d")->elements[1].text, "two");
  EXPECT_EQ(z.find("d")->line, 5U);
  EXPECT_EQ(z.find("c")->text, "0.5");
  EXPECT_EQ(z.find("none"), nullptr);
}

}  // namespace
}  // namespace kiln
