// Words that ask for maps, their bounds, packs and ranges, and what is refused in them.
#include "job/map_words.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "job/files.h"
#include "job/job_options.h"
#include "job/lists.h"
#include "job/match_inputs.h"
#include "job/transfers.h"
#include "kiln/image.h"
#include "kiln/option_error.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

std::string refusal(const std::function<void()>& parse, ErrorCode code = ErrorCode::usage) {
  try {
    parse();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    return error.message().text();
  }
  return {};
}

Job job_of(std::vector<MapKind> maps) {
  Job job;
  job.bake.maps = std::move(maps);
  job.given = {"--maps"};
  return job;
}

TEST(MapWords, PacksHaveChannelsOfMapsAndNumbers) {
  Job job = job_of({MapKind::normal, MapKind{"ao"}, MapKind{"position"}});
  job.packs = {"orm_2=ao,0.25,position.b,normal.g", "Up=position.b"};
  const std::vector<Pack> packs = parse_packs(job);
  ASSERT_EQ(packs.size(), 2U);
  EXPECT_EQ(packs[0].name, "orm_2");
  ASSERT_EQ(packs[0].channels.size(), 4U);
  const std::vector<std::string> maps = {"ao", "", "position", "normal"};
  const std::vector<std::uint32_t> channels = {0, 0, 2, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(packs[0].channels[i].map, maps[i]) << i;
    EXPECT_EQ(packs[0].channels[i].channel, channels[i]) << i;
  }
  EXPECT_EQ(packs[0].channels[1].value, 0.25F);
  EXPECT_EQ(packs[1].name, "Up");

  // What is packed: each channel from its own map and channel.
  const auto image_of = [](const std::string& name) -> const Image& {
    static const Image kAo{2, 1, 1, {0.125F, 0.875F}};
    static const Image kPosition{2, 1, 3, {1, 2, 3, 4, 5, 6}};
    static const Image kNormal{2, 1, 3, {7, 8, 9, 10, 11, 12}};
    return name == "ao" ? kAo : name == "position" ? kPosition : kNormal;
  };
  const Image packed = pack_channels(packs[0], image_of);
  EXPECT_EQ(packed.width, 2U);
  EXPECT_EQ(packed.height, 1U);
  EXPECT_EQ(packed.pixels, (std::vector<float>{0.125F, 0.25F, 3, 8, 0.875F, 0.25F, 6, 11}));
}

TEST(MapWords, PacksAreRefusedWithTheirReason) {
  struct Case {
    std::vector<std::string> packs;
    std::string reason;
  };
  const std::string write = "write NAME=MAP,MAP,MAP, such as orm=ao,roughness,metallic.";
  const auto taken = [](const std::string& name) {
    return "'" + name + "' is already the name of another file of this bake: choose another name.";
  };
  const auto channel = [](const std::string& part) {
    return "'" + part + "' does not end in a channel: append .r, .g, .b or .a to the map's name.";
  };
  const std::string range = "a number must be from 0 to 1.";
  for (const auto& [packs, reason] : std::vector<Case>{
           {{"orm"}, write},
           {{"=ao"}, write},
           {{"or m=ao"}, write},
           {{"o-r=ao"}, write},
           {{"layers=ao"}, taken("layers")},
           {{"ao=ao"}, taken("ao")},
           {{"a=ao", "b=ao", "a=normal"}, taken("a")},
           {{"a=ao,ao,ao,ao,ao"}, "an image has at most 4 channels: remove some."},
           {{"a=0,1"}, "at least one channel must be a map, not a number."},
           {{"a=ao,1.5"}, range},
           {{"a=ao,-0.5"}, range},
           {{"a=ao,nan"}, range},
           {{"a=normal.x"}, channel("normal.x")},
           {{"a=normal.rg"}, channel("normal.rg")},
           {{"a=normal."}, channel("normal.")},
           {{"a=normal.a"}, "the map normal has 3 channels: choose another one."},
           {{"a=ao.g"}, "the map ao has 1 channels: choose another one."},
           {{"a=ao,1x"}, "the map '1x' is not baked: add it with `maps` or `transfer`."},
           {{"a=ao,"}, "the map '' is not baked: add it with `maps` or `transfer`."}}) {
    Job job = job_of({MapKind{"ao"}, MapKind::normal});
    job.packs = packs;
    EXPECT_EQ(refusal([&] { parse_packs(job); }), "`pack` '" + packs.back() + "': " + reason);
  }
}

TEST(MapWords, BoundsAreOfBakedMaps) {
  Job job = job_of({MapKind::normal, MapKind{"ao"}, MapKind{"height"}});
  job.low.make.max_error = "ao=2/255,normal=1.5,height=0.25";
  const std::vector<MapBound> bounds = map_bounds(job);
  ASSERT_EQ(bounds.size(), 2U);
  EXPECT_EQ(bounds[0].kind.name, "ao");
  EXPECT_DOUBLE_EQ(bounds[0].max_error, 2.0 / 255);
  EXPECT_EQ(bounds[1].kind.name, "height");
  EXPECT_EQ(bounds[1].max_error, 0.25);
  EXPECT_EQ(normal_error_bound(job.low.make.max_error), "1.5");
  EXPECT_EQ(normal_error_bound("ao=1"), "");
  EXPECT_EQ(refusal([] { normal_error_bound("ao=1,normal="); }),
            "`max_error` is 'ao=1,normal=': give degrees after normal=, such as normal=1.5.");
  struct Case {
    std::string bound, reason;
  };
  const std::string above = " must be a number or a fraction above 0, such as 2/255.";
  for (const auto& [bound, reason] : std::vector<Case>{
           {"normal=1,2", "'2' has no map: give MAP=ERROR, such as ao=2/255."},
           {"normal=1,ao=1,ao=2", "ao is given two errors: leave one of them out."},
           {"normal=1,normal=2", "normal is given two errors: leave one of them out."},
           {"normal=1,slope=2", "the map 'slope' is not baked: add it to `maps`, or leave it out."},
           {"normal=1,ao=0", "the error of ao" + above},
           {"normal=1,height=-2", "the error of height" + above},
           {"normal=1,height=inf", "the error of height" + above},
           {"ao=1",
            "add normal=DEGREES, since the error of normals decides the match and the faces."}}) {
    job.low.make.max_error = bound;
    EXPECT_EQ(refusal([&] { map_bounds(job); }), "`max_error` is '" + bound + "': " + reason);
  }
}

TEST(MapWords, RangesAreTwoNumbersOfAMap) {
  Job job = job_of({MapKind::normal, MapKind{"height"}, MapKind{"distance"}});
  job.ranges = {"distance=0.5,2", "height=-0.25,0.125"};
  const std::vector<MapRange> ranges = options_of(job).encoding.ranges;
  ASSERT_EQ(ranges.size(), 2U);
  EXPECT_EQ(ranges[0].kind.name, "distance");
  EXPECT_EQ(ranges[0].range.low, 0.5F);
  EXPECT_EQ(ranges[0].range.high, 2);
  EXPECT_EQ(ranges[1].kind.name, "height");
  EXPECT_EQ(ranges[1].range.low, -0.25F);
  EXPECT_EQ(ranges[1].range.high, 0.125F);
  for (const char* text : {"height", "height=1", "height=a,1", "height=1,b", "height=1,2,3",
                           "height=1x,2", "height=,2", "height=1,"}) {
    job.ranges = {"distance=0,1", text};
    EXPECT_EQ(refusal([&] { options_of(job); }),
              "`range` '" + std::string(text) +
                  "': write MAP=LO,HI, two numbers, such as height=-0.2,0.2.");
  }
}

TEST(MapWords, VariantsTakeOptionsOfTheirMapAlone) {
  const Job job = job_of({MapKind::normal});
  const MapVariant near = parse_variant(job, "near=ao:ao-distance=2%:ao-rays=32");
  EXPECT_EQ(near.name, "near");
  EXPECT_EQ(near.kind.name, "ao");
  ASSERT_TRUE(near.occlusion);
  EXPECT_EQ(near.occlusion->rays, 32U);
  EXPECT_FALSE(near.light);
  EXPECT_FALSE(near.id_by);
  EXPECT_FALSE(near.curvature_radius);
  const MapVariant wide = parse_variant(job, "wide=curvature:curvature-radius=0.5");
  ASSERT_TRUE(wide.curvature_radius);
  EXPECT_FALSE(wide.occlusion);
  const auto alone = [](const std::string& word, const std::string& part, const std::string& map) {
    return "`maps` '" + word + "': '" + part + "' cannot be set for the map " + map +
           " alone: use an option that --help lists for this map, such as ao-distance=2% for ao.";
  };
  for (const auto& [part, map] :
       {std::pair{"size=64", "ao"}, std::pair{"nothing=1", "ao"}, std::pair{"ao-rays=4", "height"},
        std::pair{"curvature-radius=1", "ao"}}) {
    const std::string word = "v=" + std::string(map) + ":" + part;
    EXPECT_EQ(refusal([&] { parse_variant(job, word); }), alone(word, part, map));
  }
  EXPECT_NE(refusal([&] {
              parse_variant(job, "v=ao:ao-rays");
            }).find(" needs a value: write ao-rays=VALUE."),
            std::string::npos);
  EXPECT_TRUE(is_variant("v=ao"));
  EXPECT_TRUE(is_variant("v=ao:ao-rays=4"));
  EXPECT_FALSE(is_variant("ao"));
  EXPECT_FALSE(is_variant("v=file.cl"));
}

TEST(MapWords, TransfersAreFilesNamesAndSpaces) {
  const std::filesystem::path folder = test::scratch_folder();
  const auto file = [&](const std::string& name) {
    const std::string path = (folder / name).string();
    std::ofstream(path) << "x";
    return path;
  };
  const std::string plain = file("wood.grain.png"), number = file("7 up.png");
  struct Case {
    std::string text, file, name;
    std::optional<TextureKind> kind;
  };
  for (const auto& [text, path, name, kind] :
       std::vector<Case>{{plain, plain, "wood_grain", {}},
                         {number, number, "t_7_up", {}},
                         {plain + ":Bark_2", plain, "Bark_2", {}},
                         {plain + ":bark:linear", plain, "bark", TextureKind::linear},
                         {plain + ":srgb", plain, "wood_grain", TextureKind::srgb},
                         {"mtl:roughness:normal", "mtl", "roughness", TextureKind::normal}}) {
    const TransferArgument transfer = parse_transfer(text);
    EXPECT_EQ(transfer.file, path);
    EXPECT_EQ(transfer.name, name);
    EXPECT_EQ(transfer.kind, kind) << text;
  }
  EXPECT_EQ(refusal([&] { parse_transfer("mtl:gloss"); }),
            "`transfer` 'mtl:gloss': give mtl:color, mtl:opacity, mtl:normals, mtl:roughness, "
            "mtl:metallic, mtl:emission or mtl:occlusion.");
  EXPECT_EQ(refusal([&] { parse_transfer("mtl:color:new:rgb-x"); }),
            "`transfer` 'mtl:color:new:rgb-x': 'rgb-x' is no colour space, and textures of "
            "materials cannot be renamed. Give mtl:SLOT or mtl:SLOT:SPACE, where SPACE is srgb, "
            "linear or normal.");
  const std::string wrong = plain + ":bark:lin-ear";
  EXPECT_EQ(refusal([&] { parse_transfer(wrong); }),
            "`transfer` '" + wrong +
                "': 'lin-ear' is no colour space. Give FILE, FILE:NAME or FILE:NAME:SPACE, where "
                "SPACE is srgb, linear or normal.");
}

TEST(MapWords, PartListsHaveALowAndItsHighs) {
  const std::vector<PartPair> pairs =
      parse_part_list("# parts\n\n a b = c , ,d\t\r\n  # more\nlid=lid_high\n", "list");
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[0].low, "a b");
  EXPECT_EQ(pairs[0].high, (std::vector<std::string>{"c", "d"}));
  EXPECT_EQ(pairs[1].low, "lid");
  EXPECT_EQ(pairs[1].high, (std::vector<std::string>{"lid_high"}));
  for (const char* line : {"= c", "a", "a =", "a = , ,"}) {
    EXPECT_EQ(refusal([&] { parse_part_list("x = y\n\n" + std::string(line) + "\n", "list"); },
                      ErrorCode::input),
              "list, line 3, is '" + std::string(line) +
                  "': write LOW = HIGH, or LOW = HIGH, HIGH, with names of groups or objects.");
  }
  EXPECT_EQ(refusal([] { parse_part_list("# none\n \n", "list"); }, ErrorCode::input),
            "list has no line LOW = HIGH: add one.");
}

/// A cage's picture: unit directions and distances of both shells, row by row.
TEST(MapWords, CagesOfPicturesAreRefusedWithTheirPlace) {
  Mesh low = test::cube();
  const std::size_t count = low.positions.size();
  Mesh cage = low;
  cage.positions.clear();
  for (std::size_t i = 0; i < 2 * count; ++i) {
    const Vec3& p = low.positions[i % count];
    const float scale = i < count ? 1.5F : 0.75F;
    cage.positions.push_back({scale * p.x, scale * p.y, scale * p.z});
  }
  const std::filesystem::path path = test::scratch_folder() / "a cage.exr";
  save_cage(cage, low, path);
  const Mesh read = load_cage(path, low, {}, nullptr);
  EXPECT_EQ(read.name, "a cage");
  EXPECT_EQ(read.triangles.size(), 2 * low.triangles.size());
  ASSERT_EQ(read.positions.size(), 2 * count);
  for (std::size_t i = 0; i < 2 * count; ++i) {
    EXPECT_NEAR(read.positions[i].x, cage.positions[i].x, 1e-6) << i;
    EXPECT_NEAR(read.positions[i].y, cage.positions[i].y, 1e-6) << i;
    EXPECT_NEAR(read.positions[i].z, cage.positions[i].z, 1e-6) << i;
  }
  const Image good = load_image(path);
  const auto reason = [&](const Image& image) {
    const std::string text = refusal([&] { cage_from_image(image, path, low); }, ErrorCode::input);
    const std::string start = "'" + path.string() + "' is no cage of LOW: ",
                      end = ". Save one with `cage` auto `save_cage` FILE.exr.";
    if (!text.starts_with(start) || !text.ends_with(end)) return "whole: " + text;
    return text.substr(start.size(), text.size() - start.size() - end.size());
  };
  const std::string need = " pixels, but LOW's " + std::to_string(count) + " vertices need " +
                           std::to_string(good.width) + " x " + std::to_string(good.height);
  Image grey = good;
  grey.channels = 3;
  EXPECT_EQ(reason(grey), "it has 3 channels instead of 4");
  Image tall = good;
  tall.height += 1;
  EXPECT_EQ(reason(tall), "it has " + std::to_string(good.width) + " x " +
                              std::to_string(good.height + 1) + need);
  Image wide = good;
  wide.width -= 1;
  EXPECT_EQ(reason(wide), "it has " + std::to_string(good.width - 1) + " x " +
                              std::to_string(good.height) + need);
  const std::size_t pixels = good.pixels.size() / 8;
  for (const std::uint32_t shell : {0U, 1U}) {
    const std::string place =
        "the " + std::string(shell == 0 ? "outer" : "inner") + " pixel of vertex 2 ";
    Image bad = good;
    bad.pixels[4 * (shell * pixels + 2) + 1] = std::nanf("");
    EXPECT_EQ(reason(bad), place + "is NaN or infinite");
    bad = good;
    bad.pixels[4 * (shell * pixels + 2) + 3] = -1;
    EXPECT_EQ(reason(bad), place + "has alpha -1, which marks pixels without a vertex");
  }
}

}  // namespace
}  // namespace kiln
