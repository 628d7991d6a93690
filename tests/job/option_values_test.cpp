// Values of options whose words set more than one member.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "job/job_options.h"
#include "kiln/height_field.h"
#include "kiln/job.h"
#include "kiln/option_error.h"
#include "kiln/options.h"
#include "kiln/unwrap.h"
#include "options/near_words.h"
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

/// What a parser refuses a word with; empty if it takes it.
std::string refusal(const std::function<void()>& parse) {
  try {
    parse();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
    return error.message().text();
  }
  return {};
}

/// A row that sets several members is found by each, with and without "bake." before it.
TEST(OptionValues, RowsAreFoundByEveryMember) {
  using Case = std::pair<std::string, std::string>;
  for (const auto& [member, flag] :
       {Case{"bake.width", "--size"}, Case{"bake.height", "--size"}, Case{"set_sizes", "--size"},
        Case{"encoding.miss", "--fallback"}, Case{"bake.occlusion.by_low", "--ao-occluders"},
        Case{"occlusion.by_others", "--ao-occluders"}, Case{"pictures.format", "--format"}}) {
    const OptionRow* const row = find_option(member);
    ASSERT_NE(row, nullptr) << member;
    EXPECT_EQ(row->flag, flag) << member;
  }
  Job job;
  set_option(job, "bake.height", "640x48");
  EXPECT_EQ(job.bake.width, 640U);
  EXPECT_EQ(job.bake.height, 48U);
  EXPECT_EQ(find_option("bake.heigh"), nullptr);
}

TEST(OptionValues, SizesHaveTwoSides) {
  using Sides = std::pair<std::uint32_t, std::uint32_t>;
  EXPECT_EQ(parse_size("2048"), Sides(2048, 2048));
  EXPECT_EQ(parse_size("1x16384"), Sides(1, 16384));
  EXPECT_EQ(parse_size("16384X1"), Sides(16384, 1));
  EXPECT_EQ(parse_size("640x48"), Sides(640, 48));
  for (const char* word : {"", "0", "16385", "0x8", "8x0", "16385x8", "8x16385", "ax8", "8xa", "8x",
                           "x8", "8x8x8", "-8", "8 ", "4294967297"}) {
    EXPECT_EQ(refusal([&] { parse_size(word); }),
              "`size` '" + std::string(word) +
                  "': expected one side or WxH, each 1 to 16384, such as 2048 or 2048x1024.");
  }
}

TEST(OptionValues, LengthsAreAbsoluteOrShares) {
  const auto length = [](const char* word) {
    const Length parsed = parse_length("far", word);
    return std::pair(parsed.value, parsed.relative);
  };
  EXPECT_EQ(length("0.25"), std::pair(0.25, false));
  EXPECT_EQ(length("25%"), std::pair(0.25, true));
  EXPECT_EQ(length("0"), std::pair(0.0, false));
  for (const char* word : {"", "%", "-1", "-1%", "inf", "nan", "inf%", "1m", "1%%"}) {
    EXPECT_EQ(refusal([&] { length(word); }),
              "far '" + std::string(word) +
                  "': expected a length such as 0.05, or a share of the high poly's diagonal such "
                  "as 2%.");
  }
  for (const char* word : {"0", "0%"}) {
    EXPECT_EQ(refusal([&] { parse_length_above_0("far", word); }), "far is 0: it must be above 0.");
  }
  EXPECT_EQ(format_length(Length::share(0.125)), "12.5%");
  EXPECT_EQ(format_length(Length::absolute(0.125)), "0.125");
}

TEST(OptionValues, ExtentsAreFiniteAndAboveZero) {
  using Extent = std::pair<double, double>;
  EXPECT_EQ(parse_extent("100"), Extent(100, 0));
  EXPECT_EQ(parse_extent("100,0.5"), Extent(100, 0.5));
  for (const char* word :
       {"", "0", "-3", "inf", "nan", "7,0", "7,-2", "7,inf", "0,7", "7,", ",7"}) {
    EXPECT_EQ(refusal([&] { parse_extent(word); }),
              "`extent` '" + std::string(word) +
                  "': expected X or X,Y in world units, above 0, such as 100 or 100,50.");
  }
}

TEST(OptionValues, PercentagesHaveLimits) {
  EXPECT_DOUBLE_EQ(parse_error_bound("0.2%"), 0.002);
  EXPECT_DOUBLE_EQ(parse_error_bound("50"), 0.5);
  EXPECT_DOUBLE_EQ(parse_error_bound("1e-6"), 1e-8);
  EXPECT_DOUBLE_EQ(parse_outline_bound("2%"), 0.02);
  for (const char* word : {"", "%", "0", "9e-7", "50.1", "51%", "nan", "-1", "x"}) {
    EXPECT_EQ(refusal([&] { parse_error_bound(word); }),
              "`max_error` '" + std::string(word) +
                  "': expected a percentage of the diagonal, above 0 and up to 50, such as 0.2%.");
    EXPECT_EQ(refusal([&] { parse_outline_bound(word); }),
              "`max_outline` '" + std::string(word) +
                  "': expected a percentage of the pixels that the meshes cover, above 0 and up to "
                  "50, such as 2%.");
  }
}

TEST(OptionValues, HolesAreSharesOfTheDiagonalOrAll) {
  EXPECT_EQ(parse_hole_size("holes", "all"), std::numeric_limits<double>::infinity());
  EXPECT_DOUBLE_EQ(parse_hole_size("holes", "10%"), 0.1);
  EXPECT_EQ(parse_hole_size("holes", "0%"), 0);
  EXPECT_EQ(parse_hole_size("holes", "100%"), 1);
  for (const char* word : {"", "%", "10", "-1%", "101%", "nan%", "All", "10%%"}) {
    EXPECT_EQ(refusal([&] { parse_hole_size("holes", word); }),
              "holes '" + std::string(word) +
                  "': expected a percentage of HIGH's diagonal from 0% to 100%, such as 10%, or "
                  "all.");
  }
}

TEST(OptionValues, DegreesArePositiveAndAtMostAHalfTurn) {
  EXPECT_EQ(parse_degrees("turn", "180"), 180);
  EXPECT_EQ(parse_degrees("turn", "1.5"), 1.5);
  for (const char* word : {"", "0", "-1", "180.5", "nan", "inf", "3x"}) {
    EXPECT_EQ(refusal([&] { parse_degrees("turn", word); }),
              "turn is '" + std::string(word) + "': give degrees above 0, up to 180, such as 1.5.");
  }
}

TEST(OptionValues, GuttersPixelsAndViewsHaveLimits) {
  EXPECT_EQ(parse_padding("inf"), -1);
  EXPECT_EQ(parse_padding("infinite"), -1);
  EXPECT_EQ(parse_padding("0"), 0);
  EXPECT_EQ(parse_padding("4096"), 4096);
  for (const char* word : {"", "-1", "4097", "3.5", "all"}) {
    EXPECT_EQ(refusal([&] { parse_padding(word); }),
              "`gutter` '" + std::string(word) + "': expected 0 to 4096 texels, or inf.");
  }
  EXPECT_EQ(parse_pixels("screen", "16"), 16U);
  EXPECT_EQ(parse_pixels("screen", "16384px"), 16384U);
  for (const char* word : {"", "px", "15", "16385", "16385px", "16 px", "-16"}) {
    EXPECT_EQ(refusal([&] { parse_pixels("screen", word); }),
              "screen is '" + std::string(word) + "': give pixels, 16 to 16384, such as 600px.");
  }
  EXPECT_EQ(parse_views("0"), 0U);
  EXPECT_EQ(parse_views("512"), 512U);
  for (const char* word : {"", "513", "-1", "7.5"}) {
    EXPECT_EQ(refusal([&] { parse_views(word); }),
              "`views` '" + std::string(word) +
                  "': expected 1 to 512, or auto, or 0 if `view` gives all views.");
  }
}

TEST(OptionValues, ViewsAreAzimuthAndElevation) {
  using View = std::pair<double, double>;
  EXPECT_EQ(parse_view("30,15"), View(30, 15));
  EXPECT_EQ(parse_view("-400.5,-90"), View(-400.5, -90));
  EXPECT_EQ(parse_view("0,90"), View(0, 90));
  for (const char* word : {"", "30", "30,", ",15", "a,15", "30,b", "inf,15", "nan,15", "30,90.5",
                           "30,-90.5", "30,nan", "30,15,2"}) {
    EXPECT_EQ(refusal([&] { parse_view(word); }),
              "`view` '" + std::string(word) +
                  "': expected azimuth and elevation (-90 to 90) in degrees, such as 30,15.");
  }
}

TEST(OptionValues, DirectionsAndPointsAreFinite) {
  const Vec3 direction = parse_direction("sun", "0,-0.5,2");
  EXPECT_EQ(direction.x, 0);
  EXPECT_EQ(direction.y, -0.5F);
  EXPECT_EQ(direction.z, 2);
  EXPECT_EQ(parse_point("at", "1,-2,0.25"), (std::array<double, 3>{1, -2, 0.25}));
  EXPECT_EQ(parse_point("at", "0,0,0"), (std::array<double, 3>{}));
  for (const char* word :
       {"", "1", "1,2", "1,2,", "1,2,3,4", "inf,2,3", "1,nan,3", "1,2,inf", "x,2,3"}) {
    EXPECT_EQ(refusal([&] { parse_direction("sun", word); }),
              "sun '" + std::string(word) +
                  "': expected a direction X,Y,Z away from the mesh, such as 0,0.5,1.");
    EXPECT_EQ(refusal([&] { parse_point("at", word); }),
              "at '" + std::string(word) + "': expected a point X,Y,Z, such as 500000,4500000,0.");
  }
  EXPECT_NE(refusal([] { parse_direction("sun", "0,0,0"); }), "");
}

TEST(OptionValues, FractionsAreFiniteAndNotNegative) {
  EXPECT_EQ(fraction("2/255"), std::optional(2.0 / 255));
  EXPECT_EQ(fraction("0"), std::optional(0.0));
  EXPECT_EQ(fraction("7"), std::optional(7.0));
  for (const char* word : {"", "/", "2/", "/255", "-1", "inf", "nan", "2/inf", "2/nan", "2/0",
                           "2/-3", "2/3/4", "2%"}) {
    EXPECT_EQ(fraction(word), std::nullopt) << word;
  }
  std::string text = "1/4";
  EXPECT_EQ(fraction_check()(text), "");
  EXPECT_EQ(text, "0.25");
  text = "3/2";
  EXPECT_EQ(fraction_check()(text),
            ": '3/2' is not a fraction: give 0 to 1, such as 0.01 or 2/255");
  EXPECT_EQ(text, "3/2");
}

TEST(OptionValues, LayoutsHaveTheirMethodAndPadding) {
  EXPECT_EQ(unwrap_options("pairs", 2048).method, UnwrapMethod::pairs);
  EXPECT_EQ(unwrap_options("squares", 2048).method, UnwrapMethod::squares);
  EXPECT_EQ(unwrap_options("charts", 2048).method, UnwrapMethod::charts);
  EXPECT_EQ(unwrap_options("", 2048).method, UnwrapMethod::charts);
  EXPECT_EQ(unwrap_options("charts", 2048).border_texels, 8U);
  EXPECT_EQ(unwrap_options("charts", 768).border_texels, 3U);
  EXPECT_EQ(unwrap_options("charts", 256).border_texels, 2U);
  EXPECT_EQ(unwrap_options("pairs", 2048).border_texels, 2U);
  EXPECT_EQ(unwrap_options("squares", 2048).border_texels, 2U);
  EXPECT_EQ(unwrap_options("charts", 3).size, 16U);
  EXPECT_EQ(unwrap_options("charts", 100000).size, 65536U);
  for (const char* method : {"pairs", "squares"}) {
    EXPECT_EQ(refusal([&] { check_density(true, method); }),
              "`density` only applies to large charts, but `unwrap` " + std::string(method) +
                  " makes none: leave it out, or unwrap by charts.");
    EXPECT_EQ(refusal([&] { check_density(false, method); }), "");
  }
  EXPECT_EQ(refusal([] { check_density(true, "charts"); }), "");
}

TEST(OptionValues, NumbersMayHaveOnePlus) {
  double value = 0;
  EXPECT_TRUE(read_number("+2.5", value));
  EXPECT_EQ(value, 2.5);
  EXPECT_TRUE(read_number("-2.5", value));
  EXPECT_EQ(value, -2.5);
  for (const char* word : {"", "+", "+-2", "++2", "2+", " 2"}) {
    EXPECT_FALSE(read_number(word, value)) << word;
  }
  std::uint32_t count = 0;
  EXPECT_TRUE(read_number("+7", count));
  EXPECT_EQ(count, 7U);
}

/// Blanks around a word of a list, and its case, do not matter; a word of blanks alone is none.
TEST(OptionValues, WordsAreFoundWhateverTheirCase) {
  const Check check = one_of({"smooth", "Flat", "auto"});
  for (const auto& [given, wanted] :
       {std::pair{" flat ", "Flat"}, std::pair{"SMOOTH", "smooth"}, std::pair{"auto", "auto"}}) {
    std::string text = given;
    EXPECT_EQ(check(text), "");
    EXPECT_EQ(text, wanted);
  }
  std::string text = "   ";
  EXPECT_EQ(check(text), ": '   ' is not one of its values: give smooth, Flat or auto");
  text = "";
  EXPECT_EQ(check(text), ": the value is empty: give smooth, Flat or auto");
  text = "smoth";
  EXPECT_EQ(check(text),
            ": 'smoth' is not one of its values; did you mean smooth? Give smooth, Flat or auto");
}

/// A word of another program stands for one of Kiln's only where Kiln's is among the words.
TEST(OptionValues, WordsOfOtherProgramsStandForKnownOnes) {
  EXPECT_EQ(nearest_word("decimate", {"bake", "simplify", "render"}), "simplify");
  EXPECT_EQ(nearest_word("decimate", {"bake", "render"}), "");
  EXPECT_EQ(nearest_word("none", {"low", "mark"}), "mark");
  EXPECT_EQ(nearest_word("none", {"low", "nose"}), "nose");
  for (const char* word :
       {"bake_normal", "render-normal", "normal_map", "normals", "Bake normal"}) {
    const MapInfo* const map = find_map_by_word(word);
    if (std::string(word).starts_with("Bake")) {
      EXPECT_EQ(map, nullptr);
      continue;
    }
    ASSERT_NE(map, nullptr) << word;
    EXPECT_EQ(map->kind.name, "normal");
  }
}

/// Pictures of a GLB are dithered as asked, in either lossless format, if a program sets the maps' switch alone.
TEST(OptionValues, DitherOfMapsIsThatOfPictures) {
  for (const ImageFormat format : {ImageFormat::png8, ImageFormat::webp}) {
    for (const bool dithers : {false, true}) {
      Job job;
      job.high = {"high.obj"};
      job.low.given = {"low.obj"};
      job.out = "out.glb";
      job.image.format = format;
      job.image.dither = dithers;
      const Job resolved = resolve_job(job);
      EXPECT_EQ(resolved.pictures.dither, dithers ? Dither::on : Dither::automatic);
      EXPECT_EQ(resolved.image.format, format);
    }
  }
}

}  // namespace
}  // namespace kiln
