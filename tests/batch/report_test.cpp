// Reports: their schema, several as one, one beside a former one, and the page in a browser.
#include "batch/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "batch/batch_scene.h"
#include "batch/checks.h"
#include "batch/schema_check.h"
#include "cli/call.h"
#include "command/run_page.h"
#include "kiln/image.h"
#include "picture/asset_pictures.h"
#include "report/console.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

ProcessResult run(const fs::path& folder, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"run", (folder / "job.toml").string()});
  return call_kiln(more);
}

/// The report that a page holds.
json report_of_page(const fs::path& page) {
  const Json report = read_report(page, "page");
  return json::parse(report.dump());
}

TEST(Base64, HasTheVectorsOfItsStandard) {
  // RFC 4648, section 10.
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xFF\xFE\xFD"), "//79");
}

TEST(Progress, TellsTheTimeLeft) {
  EXPECT_EQ(cli::time_left(0, 10), "");
  EXPECT_EQ(cli::time_left(0.5, 1), "");  // too early to say
  EXPECT_EQ(cli::time_left(0.25, 10), "about 30 s left, ");
  EXPECT_EQ(cli::time_left(0.9, 9), "about 1 s left, ");
  EXPECT_EQ(cli::time_left(0.1, 60), "about 9 min left, ");
  EXPECT_EQ(cli::time_left(0.5, 7200), "about 2.0 h left, ");
  EXPECT_EQ(cli::time_left(1, 10), "");
}

/// A report of assets with one figure each.
Json small_report(const std::vector<Json>& assets, const char* shard = nullptr) {
  Json report = {{"version", "1"},
                 {"job", "job.toml"},
                 {"profile", Json()},
                 {"shard", Json()},
                 {"seconds", 2.5},
                 {"states", count_states(assets)},
                 {"warnings", Json::array()},
                 {"assets", assets}};
  if (shard != nullptr) report["shard"] = shard;
  return report;
}

Json asset(const char* name, double degrees, const char* state = "baked", double missed = 0,
           const char* hash = "h", std::vector<std::string> warnings = {}) {
  Json list = Json::array();
  for (const std::string& code : warnings)
    list.push_back({{"code", code}, {"message", code}, {"count", 1}});
  Json one = {{"asset", name},        {"state", state},   {"seconds", 1.0},
              {"missed", missed},     {"warnings", list}, {"rendered", {{"mean_degrees", degrees}}},
              {"maps", Json::array()}};
  one["maps"].push_back({{"name", "normal"},
                         {"width", 8},
                         {"height", 8},
                         {"channels", 3},
                         {"hash", hash},
                         {"picture", std::string("data:") + hash}});
  return one;
}

TEST(Baseline, SaysWhatChangedAndHowMuchWorseItIs) {
  const Json former = small_report(
      {asset("degrees", 1), asset("failed", 1), asset("mended", 1, "failed"), asset("missed", 1),
       asset("pixels", 1), asset("same", 1), asset("better", 2), asset("warns", 1),
       asset("calms", 1, "baked", 0, "h", {"old-code"}), asset("gone", 1)});
  Json now = small_report(
      {asset("degrees", 3), asset("failed", 1, "failed"), asset("mended", 1),
       asset("missed", 1, "baked", 0.01), asset("pixels", 1, "unchanged", 0, "other"),
       asset("same", 1.004, "unchanged"), asset("better", 1),
       asset("warns", 1, "baked", 0, "h", {"new-code"}), asset("calms", 1), asset("new", 1)});
  add_baseline(now, former);
  std::vector<std::pair<double, std::string>> order;
  std::map<std::string, json> found;
  const json compared = json::parse(now.dump());
  for (const json& one : compared["assets"]) {
    found[one["asset"]] = one["baseline"];
    order.emplace_back(-one["baseline"]["worse"].get<double>(), one["asset"]);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::string> names;
  for (const auto& [worse, name] : order) names.push_back(name);
  EXPECT_EQ(names, (std::vector<std::string>{"failed", "degrees", "missed", "warns", "pixels",
                                             "new", "same", "calms", "better", "mended"}));
  EXPECT_NEAR(found["calms"]["worse"], -0.1, 1e-9);
  EXPECT_EQ(found["calms"]["what"][0], "a warning is gone: old-code");
  EXPECT_EQ(found["same"]["state"], "same");
  EXPECT_TRUE(found["same"]["what"].empty());
  EXPECT_EQ(found["new"]["state"], "new");
  EXPECT_NEAR(found["degrees"]["worse"], 2, 1e-9);
  EXPECT_EQ(found["degrees"]["what"][0], "rendered normals deviate by 3.00 degrees, formerly 1.00");
  EXPECT_NEAR(found["missed"]["worse"], 1, 1e-9);
  EXPECT_EQ(found["missed"]["what"][0], "1% of the samples are missed, formerly 0%");
  EXPECT_EQ(found["pixels"]["what"][0], "normal has other pixels");
  EXPECT_EQ(found["pixels"]["maps"]["normal"]["picture"], "data:h");
  EXPECT_EQ(found["warns"]["what"][0], "it warns now: new-code");
  EXPECT_LT(found["better"]["worse"].get<double>(), 0);
  EXPECT_EQ(json::parse(now.at("gone").dump()), json::array({"gone"}));
  // What was not baked at all is a failure, too.
  for (const char* const state : {"cancelled", "not run"}) {
    Json stopped = small_report({asset("same", 1, state)});
    add_baseline(stopped, former);
    EXPECT_EQ(json::parse(stopped.dump())["assets"][0]["baseline"]["worse"], 1000) << state;
  }
}

TEST(Merge, JoinsAllPartsOnce) {
  const Json one = small_report({asset("c", 1), asset("a", 1, "failed")}, "1/2"),
             two = small_report({asset("b", 1)}, "2/2");
  const json merged = json::parse(merge_reports({two, one}, {"two", "one"}).dump());
  ASSERT_EQ(merged["assets"].size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(merged["assets"][i]["asset"], std::string(1, static_cast<char>('a' + i)));
  EXPECT_EQ(merged["states"]["baked"], 2);
  EXPECT_EQ(merged["states"]["failed"], 1);
  EXPECT_TRUE(merged["shard"].is_null());
  const auto message = [](const std::vector<Json>& reports) {
    std::vector<std::string> names(reports.size(), "file");
    try {
      merge_reports(reports, names);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("merged");
  };
  EXPECT_NE(message({one}).find("part 2/2 is missing"), std::string::npos) << message({one});
  EXPECT_NE(message({one, one}).find("is in 'file' and in 'file'"), std::string::npos);
  EXPECT_NE(message({one, small_report({asset("b", 1)}, "2/3")}).find("others are of 2"),
            std::string::npos);
  Json other = two;
  other["version"] = "2";
  EXPECT_NE(message({one, other}).find("different version"), std::string::npos);
  other = two;
  other["profile"] = "ci";
  EXPECT_NE(message({one, other}).find("different profile"), std::string::npos);
}

// Each part of a farm warns of the job file, which is one for all.
TEST(Merge, SaysWarningsOfAllPartsOnce) {
  const auto warning = [](const char* code) {
    return Json{{"code", code}, {"message", code}, {"count", 1}};
  };
  Json one = small_report({asset("a", 1)}, "1/2"), two = small_report({asset("b", 1)}, "2/2");
  one["warnings"] = Json::array({warning("unpaired-high"), warning("unused-sidecar")});
  two["warnings"] = Json::array({warning("unpaired-high"), warning("other")});
  const json merged = json::parse(merge_reports({one, two}, {"one", "two"}).dump());
  std::vector<std::string> codes;
  for (const json& each : merged["warnings"]) codes.push_back(each["code"]);
  EXPECT_EQ(codes, (std::vector<std::string>{"unpaired-high", "unused-sidecar", "other"}));
}

TEST(Reports, OfPartsAreThoseOfTheWhole) {
  const fs::path folder = make_studio({"a", "b", "c"});
  write(folder / "job.toml", kStudioJob);
  const auto path = [&](const char* name) { return (folder / name).string(); };
  ASSERT_EQ(run(folder, {"--json", path("whole.json")}).exit_code, 0);
  // One as JSON, one as a page.
  ASSERT_EQ(
      run(folder, {"--shard", "1/2", "--json", path("one.json"), "--report", path("one.html")})
          .exit_code,
      0);
  ASSERT_EQ(run(folder, {"--shard", "2/2", "--report", path("two.html")}).exit_code, 0);
  const ProcessResult result =
      run(folder, {"--merge", path("one.json"), "--merge", path("two.html"), "--json",
                   path("all.json"), "--junit", path("all.xml"), "--report", path("all.html")});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json whole = json::parse(read_file(folder / "whole.json")),
             all = json::parse(read_file(folder / "all.json"));
  ASSERT_EQ(all["assets"].size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all["assets"][i]["asset"], whole["assets"][i]["asset"]);
    EXPECT_EQ(all["assets"][i]["files"], whole["assets"][i]["files"]);
  }
  const std::string schema = call_kiln({"run", "--print-report-schema"}).output;
  for (const json& report : {whole, all, report_of_page(folder / "all.html")})
    EXPECT_EQ(misfit(json::parse(schema), report), "");
  EXPECT_NE(read_file(folder / "all.xml").find("tests=\"3\""), std::string::npos);
  EXPECT_EQ(read_file(folder / "one.json").find("data:image"), std::string::npos);
  // Of the pages' assets alone there are pictures.
  std::size_t pictures = 0;
  const json page = report_of_page(folder / "all.html");
  for (const json& asset : page["assets"]) pictures += asset.contains("pictures") ? 1 : 0;
  EXPECT_EQ(pictures, report_of_page(folder / "two.html")["assets"].size());
  expect_exit(run(folder, {"--merge", path("one.json"), "--json", path("x.json")}), 2,
              {"part 2/2"});
  expect_exit(run(folder, {"--merge", path("one.json")}), 2, {"--merge", "--json"});
  write(folder / "no.json", "{}");
  expect_exit(run(folder, {"--merge", path("no.json"), "--json", path("x.json")}), 3,
              {"no.json", "not a report"});
  expect_exit(run(folder, {"--baseline", path("whole.json")}), 2, {"--baseline", "--report"});
  expect_exit(run(folder, {"--baseline", path("none.json"), "--json", path("x.json")}), 3,
              {"none.json"});
  expect_exit(run(folder, {"--json", path("x.json"), "--report", path("x.json")}), 2, {"x.json"});
}

TEST(Reports, PicturesAreKeptAndDrawnAnewWhereFilesChanged) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const std::string page = (folder / "page.html").string();
  const auto picture = [&](const char* which) {
    EXPECT_EQ(run(folder, {"--report", page}).exit_code, 0);
    return report_of_page(page)["assets"][0]["pictures"][which].get<std::string>();
  };
  const std::string first = picture("with_maps"), high = picture("high");
  EXPECT_EQ(picture("with_maps"), first);
  // Another high poly, and an output that somebody changed.
  save_obj(BumpySphere::dense(60), folder / "assets/a_high.obj");
  EXPECT_NE(picture("high"), high);
  const json before = report_of_page(page)["assets"][0];
  EXPECT_GT(before["rendered"]["without_maps_degrees"], before["rendered"]["mean_degrees"]);
}

TEST(MapPictures, HaveTheValuesOfTheirChannels) {
  const fs::path folder = scratch_folder();
  Image image{4, 2, 4, {}};
  for (std::size_t i = 0; i < 8; ++i) {
    const auto value = static_cast<float>(i) / 8;
    image.pixels.insert(image.pixels.end(), {value, 1 - value, 0.5F, value * value});
  }
  save_image(image, folder / "low_paint.exr", {ImageFormat::exr_float});
  Image heights{3, 1, 1, {-2, 0, 6}};
  save_image(heights, folder / "low_height.exr", {ImageFormat::exr_float});
  Job job;
  job.high = {"high.obj"};
  job.low = JobLow("low.obj");
  job.out = folder.string();
  const std::vector<std::string> files = {(folder / "low_paint.exr").string(),
                                          (folder / "low_height.exr").string(),
                                          (folder / "low.obj").string()};
  std::vector<cli::MapPicture> maps = cli::picture_maps(job, files, 512);
  ASSERT_EQ(maps.size(), 2U);
  EXPECT_EQ(maps[0].name, "paint");
  EXPECT_EQ(maps[1].name, "height");
  EXPECT_EQ(maps[0].file, files[0]);
  EXPECT_EQ(maps[1].file, files[1]);
  EXPECT_EQ(maps[0].channels, 4U);
  EXPECT_EQ(maps[0].picture.channels, 3U);
  ASSERT_EQ(maps[0].alpha.channels, 1U);
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_EQ(maps[0].picture.pixels[3 * i + c], image.pixels[4 * i + c]);
    EXPECT_EQ(maps[0].alpha.pixels[i], image.pixels[4 * i + 3]);
  }
  EXPECT_NEAR(*maps[0].mean[0], 3.5 / 8, 1e-6);
  EXPECT_EQ(*maps[0].most[1], 1);
  EXPECT_EQ(maps[0].hash, pixel_hash(files[0]));
  // Values beyond [0, 1] are shown between the least and the greatest.
  EXPECT_EQ(maps[1].value_shown_black, -2);
  EXPECT_EQ(maps[1].value_shown_white, 6);
  EXPECT_EQ(maps[1].picture.pixels, (std::vector<float>{0, 0.25F, 1}));
  // Blocks of 2 x 2 texels, as their mean.
  maps = cli::picture_maps(job, files, 2);
  ASSERT_EQ(maps[0].picture.width, 2U);
  ASSERT_EQ(maps[0].picture.height, 1U);
  EXPECT_NEAR(maps[0].picture.pixels[0], (0 + 1 + 4 + 5) / 4.0 / 8, 1e-6);
  EXPECT_EQ(maps[0].width, 4U);
}

/// Pictures and maps of a page are the largest whose bytes are within the budget, 48 and 96 MB, or the smallest sizes.
/// Assets without files have no pictures, and files that are no maps no map.
TEST(Page, PicturesShareABudgetOfBytes) {
  const auto sizes_of = [](std::size_t assets, std::size_t maps_each) {
    std::vector<AssetResult> results(assets);
    for (AssetResult& result : results) {
      result.files = {"a.obj", "a.kiln.json"};
      for (std::size_t i = 0; i < maps_each; ++i) result.files.push_back("a.png");
    }
    results.resize(2 * assets + 5);  // Failed assets
    return cli::choose_page_sizes(results);
  };
  const auto expect_largest = [](double count, std::uint32_t side, std::uint32_t most,
                                 std::uint32_t least, double budget) {
    const auto bytes = [&](double of_side) { return count * of_side * of_side * 1.5; };
    EXPECT_TRUE(bytes(side) <= budget || side == least) << count << ": " << side;
    EXPECT_TRUE(side == most || bytes(2.0 * side) > budget) << count << ": " << side;
    EXPECT_GE(side, least);
  };
  for (const std::size_t assets : {0U, 1U, 122U, 123U, 300U, 489U, 5000U}) {
    for (const std::size_t maps : {0U, 1U, 3U, 20U}) {
      const cli::PageSizes sizes = sizes_of(assets, maps);
      expect_largest(4.0 * static_cast<double>(assets), sizes.picture, 256, 64, 48e6);
      expect_largest(static_cast<double>(assets * maps), sizes.map, 512, 32, 96e6);
    }
  }
  EXPECT_EQ(sizes_of(122, 1).picture, 256U);
  EXPECT_EQ(sizes_of(123, 1).picture, 128U);
}

TEST(Page, IsOpenedClickedSortedAndFiltered) {
  const std::string chromium = found_program("chromium");
  if (chromium.empty()) GTEST_SKIP() << "no chromium in PATH: apt-get install chromium";
  const fs::path folder = make_studio({"a", "b", "c"});
  // A name that would end the report's element, and others that would be marks.
  const std::string odd = "</script><img id=injected src=x onerror='window.injected=1'>\\\"&amp;";
  const auto job = [&](const char* more) {
    write(folder / "job.toml",
          std::string("[defaults]\nsize = 64\nmaps = [\"normal\", \"height\"]\n[[bake]]\nlow = "
                      "\"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high.obj\"\nout = "
                      "\"out/{name}\"\nskip = \"assets/c_*\"\n") +
              more +
              "[[bake]]\nlow = \"assets/c_low.obj\"\nhigh = \"assets/c_high.obj\"\nout = "
              "\"out/c\"\nname = \"" +
              odd + "\"\n");
  };
  job("");
  ASSERT_EQ(run(folder, {"--report", (folder / "former.html").string()}).exit_code, 0);
  save_obj(BumpySphere::dense(80), folder / "assets/a_high.obj");
  write(folder / "assets/b_high.obj", "v 0 0 <script>window.injected=1</script>\n");
  const ProcessResult result = run(folder, {"--report", (folder / "page.html").string(),
                                            "--baseline", (folder / "former.html").string()});
  EXPECT_EQ(result.exit_code, 1) << result.errors;
  const ProcessResult seen =
      run_process({"python3", KILN_PAGE_DRIVER, chromium, (folder / "page.html").string(),
                   folder.string(), "onerror"});
  ASSERT_EQ(seen.exit_code, 0) << seen.errors;
  const json page = json::parse(seen.output);
  const std::string plain = "</script><img id=injected src=x onerror='window.injected=1'>\"&amp;";
  // Worst first: b failed, a has another high poly, c is as it was.
  EXPECT_EQ(page["rows"], json::array({"b", "a", plain})) << page.dump(1);
  EXPECT_EQ(page["names"], page["rows"]);
  EXPECT_EQ(page["injected"], false);
  EXPECT_EQ(page["requests"], json::array()) << "the page needs no network";
  EXPECT_EQ(page["files"].size(), 1U) << page["files"];
  EXPECT_EQ(page["problems"], json::array());
  // Four pictures and two maps.
  EXPECT_EQ(page["pictures"], json::array({0, 6, 6}));
  EXPECT_NE(page["changes"][0].get<std::string>().find("it failed, but succeeded before"),
            std::string::npos);
  EXPECT_NE(page["changes"][1].get<std::string>().find("normal has other pixels"),
            std::string::npos);
  EXPECT_EQ(page["changes"][2], "");
  EXPECT_EQ(page["sorted"][0], json::array({plain, "a", "b"}));
  EXPECT_EQ(page["sorted"][1], json::array({"b", "a", plain}));
  std::map<std::string, double> seconds;
  for (const json& one : page["seconds"]) seconds[one[0]] = one[1];
  for (std::size_t i = 1; i < 3; ++i)
    EXPECT_GE(seconds[page["sorted"][2][i - 1]], seconds[page["sorted"][2][i]]);
  EXPECT_EQ(page["filtered"], json::array({plain}));
  EXPECT_EQ(page["closed"], true);
  // Channels are those of the file: 64 x 64 texels, each rounded to 8 bits.
  EXPECT_EQ(page["large"], plain + ": normal");
  EXPECT_EQ(page["link"], "./out/c/c_low_normal.png");
  const Image map = load_image(folder / "out/c/c_low_normal.png");
  std::array<double, 3> mean{};
  for (std::size_t i = 0; i < map.pixels.size(); ++i)
    mean[i % 3] += 255.0 * double{map.pixels[i]} * 3 / static_cast<double>(map.pixels.size());
  const json& channels = page["channels"];
  for (std::size_t c = 0; c < 3; ++c) {
    const json& grey = channels[std::string(1, "RGB"[c])];
    EXPECT_EQ(grey[0], 64);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(grey[2 + k], mean[c], 0.5);
    EXPECT_NEAR(channels["all"][2 + c], mean[c], 0.5);
  }
}

}  // namespace
}  // namespace kiln::test
