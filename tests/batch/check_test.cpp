// Golden maps, limits, hashes, JUnit and shards.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "batch/batch_scene.h"
#include "batch/checks.h"
#include "cli/call.h"
#include "kiln/image.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

ProcessResult run(const fs::path& folder, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"run", (folder / "job.toml").string()});
  return call_kiln(more);
}

/// Adds a step of 8 bits to so many texels of a picture of 16 bits, from the first on.
void disturb(const fs::path& path, std::size_t texels, float step) {
  Image image = load_image(path);
  for (std::size_t i = 0; i < texels; ++i) {
    float& value = image.pixels[i * image.channels];
    value = value > 0.5F ? value - step : value + step;
  }
  save_image(image, path, {ImageFormat::png16});
}

const std::string kMask =
    "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high.obj\"\nsize = 16\nout "
    "= \"out\"\n";

TEST(Checks, GoldenMapsHoldWithinLimits) {
  const fs::path folder = make_studio({"a", "b"});
  const auto job = [&](const std::string& limits) {
    write(folder / "job.toml",
          kMask + "maps = [\"height\"]\n[check]\ngolden = \"golden\"\n" + limits);
  };
  job("");
  ProcessResult result = run(folder);
  expect_exit(result, 1, {"kiln: a: ", "there is no '", "--accept"});
  result = run(folder, {"--accept", "*"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.output.find("accepted: "), std::string::npos);
  const fs::path golden = folder / "golden/out/a_low_height.png";
  ASSERT_TRUE(fs::exists(golden));
  EXPECT_EQ(run(folder).exit_code, 0);
  // Of 256 texels 4 differ by 0.25.
  disturb(golden, 4, 0.25F);
  expect_exit(run(folder), 1, {"kiln: a: ", "a_low_height.png", "1.562% of its texels"});
  job("limits = { max = 0.2 }\n");
  EXPECT_EQ(run(folder).exit_code, 1);
  job("limits = { max = 0.26 }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  // A limit of the map goes before that of all.
  job("limits = { max = 0.26, height.max = 0.1 }\n");
  EXPECT_EQ(run(folder).exit_code, 1);
  job("limits = { height.max = 0.26, max = 0.1 }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  job("limits = { max = 0.1, outliers = \"1.6%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  job("limits = { max = 0.1, outliers = \"1.5%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 1);
  // So does its share of outliers, and whichever is written first.
  job("limits = { max = 0.1, outliers = 0, height.outliers = \"1.6%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  job("limits = { height.outliers = 0, max = 0.1, outliers = \"1.6%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 1);
  // The mean is 4 * 0.25 / 256 = 0.0039.
  job("limits = { mean = 0.0040 }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  job("limits = { mean = 0.0038 }\n");
  EXPECT_EQ(run(folder).exit_code, 1);
  // Outliers without a maximum are of maps whose mean has no limit.
  job("limits = { height.mean = 0.0040, outliers = \"0.1%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  job("limits = { outliers = \"1.5%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 1);
  job("limits = { outliers = \"1.6%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
  // What came from the cache, or was left alone, is held, too.
  job("");
  expect_exit(run(folder), 1, {"kiln: a: "});
  EXPECT_EQ(run(folder, {"--only", "b"}).exit_code, 0);
  EXPECT_EQ(run(folder, {"--accept", "b"}).exit_code, 1);
  EXPECT_EQ(run(folder, {"--accept", "a"}).exit_code, 0);
  EXPECT_EQ(run(folder).exit_code, 0);
  // A map that is not written any more.
  write(folder / "golden/out/a_low_normal.png", "x");
  expect_exit(run(folder), 1, {"a_low_normal.png", "no map with its name"});
}

TEST(Checks, TheMaskSaysWhichTexelsOfGoldenMapsCount) {
  const fs::path folder = make_studio({"a"});
  // Three quarters of the texels are not covered.
  Mesh low = BumpySphere::light();
  for (Vec2& uv : low.uvs) uv = {uv.x / 2, uv.y / 2};
  save_obj(low, folder / "assets/a_low.obj");
  write(folder / "job.toml",
        kMask + "gutter = 0\nmaps = [\"height\", \"mask\"]\n[check]\ngolden = \"golden\"\n");
  ASSERT_EQ(run(folder, {"--accept", "*"}).exit_code, 0);
  const fs::path golden = folder / "golden/out/a_low_height.png";
  const Image heights = load_image(golden), mask = load_image(folder / "out/a_low_mask.png");
  std::size_t inside = heights.pixels.size(), outside = inside;
  for (std::size_t i = 0; i < heights.pixels.size(); ++i)
    (mask.pixels[i * mask.channels] > 0 ? inside : outside) = i;
  ASSERT_LT(inside, heights.pixels.size());
  ASSERT_LT(outside, heights.pixels.size());
  for (const auto& [texel, code] : {std::pair{outside, 0}, std::pair{inside, 1}}) {
    Image changed = heights;
    changed.pixels[texel] = changed.pixels[texel] > 0.5F ? 0 : 1;
    save_image(changed, golden, {ImageFormat::png16});
    EXPECT_EQ(run(folder).exit_code, code);
  }
  // The mean is of the mask's texels, too: each differs by a quarter, and nothing outside does.
  Image changed = heights;
  for (std::size_t i = 0; i < changed.pixels.size(); ++i) {
    if (mask.pixels[i * mask.channels] == 0) continue;
    changed.pixels[i] += changed.pixels[i] > 0.5F ? -0.25F : 0.25F;
  }
  save_image(changed, golden, {ImageFormat::png16});
  const std::string job = read_file(folder / "job.toml");
  for (const auto& [limit, code] : {std::pair{"0.249", 1}, std::pair{"0.251", 0}}) {
    write(folder / "job.toml", job + "limits = { height.mean = " + limit + " }\n");
    EXPECT_EQ(run(folder).exit_code, code) << limit;
  }
}

TEST(Checks, MissedSamplesAreHeldEachTime) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kMask +
                                 "maps = \"normal\"\nmax_distance = \"0.05%\"\n[check]\nlimits = { "
                                 "missed = \"0.001%\" }\n");
  // Baked, unchanged, and restored, each with the same warnings.
  std::set<std::string> warnings;
  for (int i = 0; i < 3; ++i) {
    if (i == 2) fs::remove_all(folder / "out");
    const ProcessResult result = run(folder, {"--json", "-"});
    expect_exit(result, 1, {"of the samples were missed"});
    warnings.insert(json::parse(result.output)["warnings"].dump());
  }
  EXPECT_EQ(warnings.size(), 1U);
  EXPECT_NE(*warnings.begin(), "[]");
  write(
      folder / "job.toml",
      kMask +
          "maps = \"normal\"\nmax_distance = \"0.05%\"\n[check]\nlimits = { missed = \"100%\" }\n");
  EXPECT_EQ(run(folder).exit_code, 0);
}

/// Of several texture sets the missed samples of all count, whichever set they are in.
TEST(Checks, MissedSamplesOfAllTextureSetsCount) {
  for (const bool is_first : {false, true}) {
    const fs::path folder = scratch_folder();
    const auto square = [](float x, float width, float z, const char* material) {
      Mesh mesh = plane(2, 2, width, 1);
      for (Vec3& p : mesh.positions) p = {p.x + x, p.y, z};
      mesh.material_names = {material};
      mesh.materials.assign(mesh.triangles.size(), 0);
      return mesh;
    };
    // HIGH lies over one of LOW's two squares, and over half of the other.
    fs::create_directories(folder / "assets");
    save_obj(join_meshes(std::vector<Mesh>{square(0, 1, 0, "a"), square(3, 1, 0, "b")}),
             folder / "assets/x_low.obj");
    save_obj(join_meshes(std::vector<Mesh>{square(is_first ? 3 : 0, 1, 0.01F, "h"),
                                           square(is_first ? 0.25F : 3.25F, 0.5F, 0.01F, "h")}),
             folder / "assets/x_high.obj");
    for (const auto& [limit, code] : {std::pair{"24%", 1}, std::pair{"26%", 0}}) {
      write(folder / "job.toml",
            kMask + "maps = \"normal\"\nsets = \"material\"\nmax_distance = 0.1\n" +
                "[check]\nlimits = { missed = \"" + limit + "\" }\n");
      const ProcessResult result = run(folder);
      EXPECT_EQ(result.exit_code, code) << result.errors;
      if (code == 1) {
        EXPECT_NE(result.errors.find("25% of the samples"), std::string::npos) << result.errors;
      }
    }
  }
}

TEST(Checks, HashesAreOfPixels) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "job.toml", kMask + "maps = \"height\"\n");
  const std::string list = (folder / "hashes.txt").string();
  ASSERT_EQ(run(folder, {"--hashes", list}).exit_code, 0);
  EXPECT_EQ(run(folder, {"--check-hashes", list}).exit_code, 0);
  EXPECT_EQ(run(folder, {"--check-hashes", list, "--only", "a"}).exit_code, 0);
  const std::string text = read_file(list);
  EXPECT_NE(text.find("  out/a_low_height.png\n"), std::string::npos) << text;
  // The same pixels in another file.
  const fs::path map = folder / "out/a_low_height.png";
  const std::string hash = pixel_hash(map);
  const std::string bytes = read_file(map);
  save_image(load_image(map), folder / "again.png", {ImageFormat::png16});
  EXPECT_EQ(pixel_hash(folder / "again.png"), hash);
  disturb(folder / "again.png", 1, 1.0F / 65535);
  EXPECT_NE(pixel_hash(folder / "again.png"), hash);
  const std::vector<float> pixels(4);
  std::set<std::string> hashes;
  for (const Image& image : {Image{4, 1, 1, pixels}, Image{1, 4, 1, pixels}, Image{2, 2, 1, pixels},
                             Image{2, 1, 2, pixels}}) {
    hashes.insert(pixel_hash(image));
  }
  EXPECT_EQ(hashes.size(), 4U);
  ProcessResult result = run(folder, {"--check-hashes", list, "--size", "8"});
  expect_exit(result, 1, {"a_low_height.png", "has different pixels"});
  write(list, text + std::string(32, '0') + "  out/c_low_height.png\n");
  expect_exit(run(folder, {"--check-hashes", list}), 1, {"c_low_height.png", "was not written"});
  write(list, text.substr(0, text.find('\n') + 1));
  expect_exit(run(folder, {"--check-hashes", list}), 1, {"is not in the list"});
  write(list, "no hash\n");
  expect_exit(run(folder, {"--check-hashes", list}), 3, {"hashes.txt':1"});
}

// The bytes of 60 bakes are those of tests/data/small_bakes.txt, on each machine. KILN_GOLDEN_WRITE=1 writes the table.
TEST(Checks, TheTableOfSmallBakesHolds) {
  const fs::path folder = make_studio({"a", "b", "c", "d"});
  fs::copy_file(test_data("small_bakes.toml"), folder / "job.toml");
  const std::string table = test_data("small_bakes.txt").string();
  const bool writes = std::getenv("KILN_GOLDEN_WRITE") != nullptr;
  const ProcessResult result =
      run(folder, {writes ? "--hashes" : "--check-hashes", table, "--json", "-", "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  std::size_t assets = 0;
  std::istringstream lines(result.output);
  for (std::string line; std::getline(lines, line);)
    assets += json::parse(line)["state"] == "baked";
  EXPECT_EQ(assets, 60U);
}

TEST(Checks, JUnitHasACaseAnAsset) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "assets/b_high.obj", "v 0 0 <nonsense>&\n");
  write(folder / "job.toml", kMask);
  EXPECT_EQ(run(folder, {"--junit", (folder / "junit.xml").string()}).exit_code, 1);
  const std::string xml = read_file(folder / "junit.xml");
  EXPECT_NE(xml.find("tests=\"2\" failures=\"1\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("name=\"a\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("<failure type=\"input\""), std::string::npos) << xml;
  EXPECT_EQ(xml.find("<nonsense>"), std::string::npos) << xml;
}

/// A map of one value.
void save_flat(const fs::path& path, float value, std::uint32_t channels = 1,
               std::uint32_t side = 4) {
  Image image{side, side, channels, {}};
  image.pixels.assign(std::size_t{side} * side * channels, value);
  fs::create_directories(path.parent_path());
  save_image(image, path, {ImageFormat::png16});
}

TEST(DiffFolders, ComparesFileByFile) {
  const fs::path folder = scratch_folder(), golden = folder / "golden", out = folder / "out";
  const auto diff = [&](std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"diff", golden.string(), out.string()});
    return call_kiln(more);
  };
  const auto states = [&](std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--json", (folder / "diff.json").string()});
    diff(more);
    std::map<std::string, std::string> states;
    const json report = json::parse(read_file(folder / "diff.json"));
    for (const json& file : report["files"]) states[file["file"]] = file["state"];
    return states;
  };
  for (const fs::path& side : {golden, out}) {
    save_flat(side / "a/low_height.png", 0.5F);
    save_flat(side / "b_normal.png", 0.5F, 3);
    write(side / "b.obj", "v 0 0 0\n");
    write(side / ".b.kiln.json", side.string());  // hidden, and other
  }
  ProcessResult result = diff();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("3 files: 3 equal"), std::string::npos) << result.output;
  // The same texels in other bytes are equal.
  save_image(load_image(golden / "a/low_height.png"), out / "a/low_height.png",
             {.format = ImageFormat::png16, .texts = {{"Author", "another"}}});
  EXPECT_EQ(diff().exit_code, 0);
  // 1/16 of difference; limits are inclusive.
  save_flat(out / "a/low_height.png", 0.5625F);
  EXPECT_EQ(states()["a/low_height.png"], "beyond");
  EXPECT_EQ(diff({"--max-error", "0.062"}).exit_code, 1);
  EXPECT_EQ(states({"--max-error", "0.063"})["a/low_height.png"], "within");
  // A limit of angles is none of heights, nor one of channels of normals.
  EXPECT_EQ(diff({"--max-angle", "180"}).exit_code, 1);
  Image normals = load_image(out / "b_normal.png");
  for (std::size_t i = 0; i < normals.pixels.size(); ++i) normals.pixels[i] = i % 3 == 2 ? 1 : 0.5F;
  save_image(normals, golden / "b_normal.png", {ImageFormat::png16});
  const double tilt = 10.0 * 3.14159265358979 / 180;
  for (std::size_t i = 0; i < normals.pixels.size(); i += 3) {
    normals.pixels[i] = static_cast<float>(0.5 + 0.5 * std::sin(tilt));
    normals.pixels[i + 2] = static_cast<float>(0.5 + 0.5 * std::cos(tilt));
  }
  save_image(normals, out / "b_normal.png", {ImageFormat::png16});
  EXPECT_EQ(states({"--max-error", "1"})["b_normal.png"], "beyond");
  EXPECT_EQ(states({"--max-error", "1", "--max-angle", "9.9"})["b_normal.png"], "beyond");
  EXPECT_EQ(states({"--max-error", "1", "--max-angle", "10.1"})["b_normal.png"], "within");
  EXPECT_EQ(diff({"--max-error", "1", "--max-angle", "10.1"}).exit_code, 0);
  EXPECT_EQ(diff({"--max-error", "1", "--max-mean-angle", "9.9"}).exit_code, 1);
  // Where the mask beside the golden map is 0, nothing counts.
  Image mask{4, 4, 1, std::vector<float>(16, 1)};
  mask.pixels[5] = 0;
  for (const fs::path& side : {golden, out})
    save_image(mask, side / "a/low_mask.png", {ImageFormat::png8});
  save_flat(out / "a/low_height.png", 0.5F);
  Image heights = load_image(out / "a/low_height.png");
  heights.pixels[5] = 1;
  save_image(heights, out / "a/low_height.png", {ImageFormat::png16});
  EXPECT_EQ(states()["a/low_height.png"], "equal");
  heights.pixels[6] = 1;
  save_image(heights, out / "a/low_height.png", {ImageFormat::png16});
  EXPECT_EQ(states()["a/low_height.png"], "beyond");
  // Other bytes, another size, gone, new.
  write(out / "b.obj", "v 0 0 1\n");
  save_flat(out / "b_normal.png", 0.5F, 3, 8);
  fs::remove(out / "a/low_mask.png");
  save_flat(out / "c_normal.png", 0.5F);
  auto all = states({"--max-error", "1", "--max-angle", "180"});
  EXPECT_EQ(all["b.obj"], "beyond");
  EXPECT_EQ(all["b_normal.png"], "beyond");
  EXPECT_EQ(all["a/low_mask.png"], "missing");
  EXPECT_EQ(all["c_normal.png"], "new");
  EXPECT_EQ(all["a/low_height.png"], "within");
  EXPECT_EQ(diff({"--max-error", "1", "--max-angle", "180", "--junit", (folder / "x.xml").string()})
                .exit_code,
            1);
  const std::string xml = read_file(folder / "x.xml");
  EXPECT_NE(xml.find("tests=\"5\" failures=\"4\""), std::string::npos) << xml;
  expect_exit(diff({"--mask", "mask.png"}), 2, {"--mask"});
  expect_exit(diff({"--out", "out.png"}), 2, {"--out"});
  expect_exit(call_kiln({"diff", golden.string(), (out / "b.obj").string()}), 2, {"is a folder"});
  expect_exit(call_kiln({"diff", golden.string(), (out / "none").string()}), 3, {"none"});
  fs::create_directories(folder / "empty");
  expect_exit(call_kiln({"diff", (folder / "empty").string(), out.string()}), 3,
              {"contains no files"});
}

TEST(Checks, ShardsShareSecondsAndAssets) {
  std::vector<BatchAsset> assets;
  double all = 0, most = 0;
  for (int i = 0; i < 100; ++i) {
    BatchAsset& asset = assets.emplace_back();
    asset.name = "asset" + std::to_string(i);
    asset.expected_seconds = 1.0 + (i * 37) % 11;
    all += assets.back().expected_seconds;
    most = std::max(most, assets.back().expected_seconds);
  }
  for (const std::size_t count :
       {std::size_t{1}, std::size_t{3}, std::size_t{8}, std::size_t{200}}) {
    const std::vector<std::size_t> shards = assign_shards(assets, count);
    std::vector<double> seconds(count);
    for (std::size_t i = 0; i < assets.size(); ++i)
      seconds.at(shards[i]) += assets[i].expected_seconds;
    // Graham's bound of the longest first: the mean, and one more.
    for (const double part : seconds) EXPECT_LE(part, all / static_cast<double>(count) + most);
    // Whatever the order of the list.
    std::vector<BatchAsset> turned(assets.rbegin(), assets.rend());
    const std::vector<std::size_t> again = assign_shards(turned, count);
    for (std::size_t i = 0; i < assets.size(); ++i)
      EXPECT_EQ(shards[i], again[assets.size() - 1 - i]);
  }
  const fs::path folder = make_studio({"a", "b", "c"});
  write(folder / "job.toml", kMask);
  std::set<std::string> made;
  for (const char* const shard : {"1/2", "2/2"}) {
    const ProcessResult result = run(folder, {"--shard", shard, "--json", "-"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    std::istringstream in(result.output);
    for (std::string line; std::getline(in, line);)
      EXPECT_TRUE(made.insert(json::parse(line)["asset"]).second);
  }
  EXPECT_EQ(made.size(), 3U);
  for (const char* const shard : {"0/2", "3/2", "1", "a/b", "1.5/2"})
    expect_exit(run(folder, {"--shard", shard}), 2, {"--shard"});
}

}  // namespace
}  // namespace kiln::test
