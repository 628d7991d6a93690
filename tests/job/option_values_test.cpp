// Values of options whose words set more than one member.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <tuple>

#include "kiln/height_field.h"
#include "kiln/option_error.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// A number replaces the file's own, and no others: values that stand out are still found. `none` finds none, `auto` is
/// the default.
TEST(OptionValues, NoDataIsANumberOrAWord) {
  using Case = std::tuple<std::string, std::optional<double>, bool>;
  for (const auto& [word, no_data, guesses] :
       {Case{"auto", {}, true}, Case{"none", {}, false}, Case{"-9999", -9999, true},
        Case{"0", 0, true}, Case{"1e30", 1e30, true}}) {
    for (const bool had : {false, true}) {
      HeightFieldOptions heights;
      if (had) {
        heights.no_data = 7;
        heights.guess_no_data = false;
      }
      parse_no_data_value("no_data", word, heights);
      EXPECT_EQ(heights.no_data, no_data) << word;
      EXPECT_EQ(heights.guess_no_data, guesses) << word;
    }
  }
  HeightFieldOptions heights;
  EXPECT_THROW(parse_no_data_value("no_data", "nothing", heights), Error);
}

}  // namespace
}  // namespace kiln
