// Paths that are no UTF-8 come back from JSON as they were.
#include "options/json.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace kiln::cli {
namespace {

using Read = nlohmann::ordered_json;

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
    ASSERT_EQ(unescape_bytes(Read::parse(dumped)["path"].get<std::string>()), name) << dumped;
  }
}

TEST(JsonText, KeysAndListsToo) {
  const Json json = {{"k\xFF", {"a\xFE", 1, nullptr, {{"b", "\xFD"}}}}, {"n", 0.5}};
  const Read back = Read::parse(to_text(json));
  EXPECT_EQ(back.dump(), R"({"k\\xff":["a\\xfe",1,null,{"b":"\\xfd"}],"n":0.5})");
}

TEST(JsonText, ValuesAreAsTheLibrarysOwn) {
  const std::vector<std::string> words = {"b", "a"};
  const std::set<std::string> set = {"b", "a"};
  const std::array<float, 2> numbers = {0.1F, -2};
  const auto both = [&]<typename Value>(Value) {
    Value json = {{"bool", true},
                  {"least", std::numeric_limits<std::int64_t>::min()},
                  {"most", std::numeric_limits<std::uint64_t>::max()},
                  {"real", {0.1, 1e-7, 1e22, 100.0, 1.0F / 3, -0.0, std::nan("")}},
                  {"null", nullptr},
                  {"words", words},
                  {"set", set},
                  {"numbers", numbers},
                  {"pair", {"a", 1}},
                  {"object", {{"z", 1}, {"a", {{"b", "c"}}}}},
                  {"list", {{"z", 1}, {1, "a"}}},
                  {"one", {Value(words)}},
                  {"nothing", Value::array()},
                  {"no keys", Value::object()}};
    json["pair"].push_back(words.size());
    json["new"]["key"] = "v";
    json.update({{"null", 2}, {"last", 'x'}});
    json["object"]["z"] = std::string("tab\t \"quoted\" \xE2\x82\xAC");
    return json.dump() + json.dump(2);
  };
  EXPECT_EQ(both(Json()), both(Read()));
}

TEST(JsonText, IsReadAsItWasWritten) {
  const std::string text = R"({"b":[1,-2,2.5,null,true,"x",[],{}],"a":{"c":18446744073709551615}})";
  EXPECT_EQ(Json::parse(text).dump(), text);
  EXPECT_EQ(Json::parse(text)["b"][2].number(), 2.5);
  EXPECT_EQ(Json::parse(text)["b"][1].number(), -2);
  EXPECT_FALSE(Json::parse("{\"a\":").is_object());
}

}  // namespace
}  // namespace kiln::cli
