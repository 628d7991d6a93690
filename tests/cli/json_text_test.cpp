// Paths that are no UTF-8 come back from JSON as they were.
#include "report/json_text.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace kiln::cli {
namespace {

using Json = nlohmann::ordered_json;

TEST(JsonText, TextStaysAsItIs) {
  for (const std::string text :
       {"", "low.obj", "C:\\meshes\\low.obj", "a\\b\\x", "\\x4", "\\xg0", "caf\xC3\xA9.obj",
        "\xE2\x82\xAC", "\xF0\x9F\x98\x80", "tab\tand\nline"}) {
    EXPECT_EQ(escape_bytes(text), text);
    EXPECT_EQ(unescape_bytes(text), text);
  }
}

TEST(JsonText, OtherBytesAreEscaped) {
  EXPECT_EQ(escape_bytes("caf\xE9.obj"), "caf\\xe9.obj");
  EXPECT_EQ(escape_bytes("\x80\xFF"), "\\x80\\xff");
  EXPECT_EQ(escape_bytes("\xC3"), "\\xc3");                             // cut off
  EXPECT_EQ(escape_bytes("\xC0\xAF"), "\\xc0\\xaf");                    // a form too long
  EXPECT_EQ(escape_bytes("\xED\xA0\x80"), "\\xed\\xa0\\x80");           // half of a surrogate
  EXPECT_EQ(escape_bytes("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond U+10FFFF
  EXPECT_EQ(escape_bytes("is\\xe9"), "is\\x5cxe9");                     // reads as an escape
}

TEST(JsonText, EveryNameComesBack) {
  std::mt19937 random(3);
  const std::string letters = "\\xXaF0 \xC3\xA9\xE2\x82\xAC\xFF\x80/";
  for (int i = 0; i < 20000; ++i) {
    std::string name;
    for (unsigned k = random() % 12; k != 0; --k) name += letters[random() % letters.size()];
    const std::string text = escape_bytes(name);
    ASSERT_EQ(unescape_bytes(text), name) << text;
    // Valid, or nlohmann would throw; and by itself, without an answer from the escape's author.
    const std::string dumped = to_text(Json{{"path", name}});
    ASSERT_EQ(unescape_bytes(Json::parse(dumped)["path"].get<std::string>()), name) << dumped;
  }
}

TEST(JsonText, KeysAndListsToo) {
  const Json json = {{"k\xFF", {"a\xFE", 1, nullptr, {{"b", "\xFD"}}}}, {"n", 0.5}};
  const Json back = Json::parse(to_text(json));
  EXPECT_EQ(back.dump(), R"({"k\\xff":["a\\xfe",1,null,{"b":"\\xfd"}],"n":0.5})");
}

}  // namespace
}  // namespace kiln::cli
