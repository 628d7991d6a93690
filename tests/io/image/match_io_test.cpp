#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "kiln/image.h"
#include "kiln/match.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

Match make_match(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
  Match match;
  match.width = width * samples;
  match.height = height * samples;
  match.samples = samples;
  match.source_triangles = 123456;
  std::mt19937 random(width);
  const auto unit = [&] { return static_cast<float>(random() % 1000) / 1000.0F; };
  for (std::size_t i = 0; i < std::size_t{match.width} * match.height; ++i) {
    const auto status = static_cast<std::uint8_t>(random() % KILN_STATUS_COUNT);
    const bool hit = status != KILN_STATUS_NONE && status != KILN_STATUS_MISS;
    match.status.push_back(status);
    match.triangle.push_back(hit ? static_cast<std::uint32_t>(random() % 123456) : 0xFFFFFFFFU);
    match.u.push_back(hit ? unit() / 2 : 0);
    match.v.push_back(hit ? unit() / 2 : 0);
    match.distance.push_back(hit ? unit() - 0.5F : 0);
  }
  return match;
}

void expect_equal(const Match& a, const Match& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.source_triangles, b.source_triangles);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.v, b.v);
  EXPECT_EQ(a.distance, b.distance);
  EXPECT_EQ(a.status, b.status);
}

std::string input_error(const fs::path& path) {
  try {
    load_match(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(MatchIo, ComesBackAsItWas) {
  const fs::path path = test::scratch_folder() / "match.exr";
  for (const auto& [width, height] : {std::pair{1U, 1U}, std::pair{1U, 40U}, std::pair{65U, 33U}}) {
    for (const std::uint32_t samples : {1U, 3U, 16U}) {
      const Match match = make_match(width, height, samples);
      save_match(match, path);
      expect_equal(match, load_match(path));
      const std::string bytes = test::read_file(path);
      save_match(match, path);
      EXPECT_EQ(test::read_file(path), bytes);
    }
  }
}

TEST(MatchIo, MatchesThatCannotBeAreNotSaved) {
  const fs::path path = test::scratch_folder() / "match.exr";
  const std::function<void(Match&)> changes[] = {
      [](Match& m) { m.width = 0; },       [](Match& m) { m.samples = 0; },
      [](Match& m) { m.samples = 17; },    [](Match& m) { m.samples = 5; },
      [](Match& m) { m.u.pop_back(); },    [](Match& m) { m.status.push_back(0); },
      [](Match& m) { m.triangle.clear(); }};
  for (const auto& change : changes) {
    Match match = make_match(8, 8, 1);
    change(match);
    try {
      save_match(match, path);
      ADD_FAILURE() << "was saved";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
    }
  }
  EXPECT_FALSE(fs::exists(path));
}

/// Writes a saved match once more, with another value in a sample of a channel.
void change_sample(const fs::path& from, const fs::path& to, const std::string& channel, int x,
                   int y, std::uint32_t bits) {
  Imf::InputFile input(from.string().c_str());
  const Imath::Box2i window = input.header().dataWindow();
  const auto width = static_cast<std::size_t>(window.max.x + 1);
  const std::size_t count = width * static_cast<std::size_t>(window.max.y + 1);
  std::map<std::string, std::vector<std::uint32_t>> values;
  Imf::FrameBuffer buffer;
  const Imf::ChannelList& channels = input.header().channels();
  for (auto it = channels.begin(); it != channels.end(); ++it) {
    std::vector<std::uint32_t>& of = values[it.name()];
    of.resize(count);
    buffer.insert(it.name(),
                  Imf::Slice(it.channel().type, reinterpret_cast<char*>(of.data()), 4, 4 * width));
  }
  input.setFrameBuffer(buffer);
  input.readPixels(0, window.max.y);
  values.at(channel)[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = bits;
  Imf::OutputFile output(to.string().c_str(), input.header());
  output.setFrameBuffer(buffer);
  output.writePixels(window.max.y + 1);
}

TEST(MatchIo, ImpossibleSamplesAreRefused) {
  const fs::path path = test::scratch_folder() / "match.exr";
  const fs::path changed = path.parent_path() / "changed.exr";
  Match match = make_match(10, 10, 1);
  match.status[77] = 1;
  match.triangle[77] = 5;
  match.u[77] = match.v[77] = match.distance[77] = 0;
  save_match(match, path);
  change_sample(path, changed, "triangle", 7, 7, 6);
  EXPECT_EQ(load_match(changed).triangle[77], 6U) << "what is possible is read";
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  const std::tuple<const char*, std::uint32_t, std::function<void(Match&)>> changes[] = {
      {"triangle", 123456U, [](Match& m) { m.triangle[77] = 123456; }},
      {"u", bits(1.1F), [](Match& m) { m.u[77] = 1.1F; }},
      {"v", bits(-0.1F), [](Match& m) { m.v[77] = -0.1F; }},
      {"v", bits(std::numeric_limits<float>::quiet_NaN()),
       [](Match& m) { m.v[77] = std::numeric_limits<float>::quiet_NaN(); }},
      {"distance", bits(std::numeric_limits<float>::infinity()),
       [](Match& m) { m.distance[77] = std::numeric_limits<float>::infinity(); }},
      {"status", KILN_STATUS_COUNT, [](Match& m) { m.status[77] = KILN_STATUS_COUNT; }}};
  for (const auto& [channel, value, change] : changes) {
    SCOPED_TRACE(channel);
    change_sample(path, changed, channel, 7, 7, value);
    EXPECT_NE(input_error(changed).find("sample 7, 7"), std::string::npos);
    Match wrong = match;
    change(wrong);
    try {
      save_match(wrong, changed);
      ADD_FAILURE() << "was saved";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("sample 7, 7"), std::string::npos) << error.what();
    }
  }
}

TEST(MatchIo, OtherFilesAreRefused) {
  const fs::path folder = test::scratch_folder();
  save_image(Image{4, 4, 3, std::vector<float>(48, 0.5F)}, folder / "map.exr");
  EXPECT_NE(input_error(folder / "map.exr").find("channel"), std::string::npos);
  save_image(Image{4, 4, 3, std::vector<float>(48, 0.5F)}, folder / "map.png",
             {.format = ImageFormat::png8});
  input_error(folder / "map.png");
  input_error(folder / "missing.exr");
  input_error(folder);
}

/// A saved match with another header: what is wrong in it is said.
TEST(MatchIo, HeadersThatDoNotFitAreRefused) {
  const fs::path path = test::scratch_folder() / "match.exr";
  const fs::path changed = path.parent_path() / "changed.exr";
  Match match = make_match(3, 2, 2);
  match.source_hash = 18000000000000000001ULL;
  match.low_hash = 7;
  save_match(match, path);
  EXPECT_EQ(load_match(path).source_hash, 18000000000000000001ULL);
  EXPECT_EQ(load_match(path).low_hash, 7U);
  struct Plan {
    std::string without = {}, half = {}, triangles = {};
    int samples = 0, shift_x = 0, shift_y = 0;
    bool no_samples = false;
  };
  const auto rewrite = [&](const Plan& plan) {
    Imf::InputFile input(path.string().c_str());
    Imf::Header header = input.header();
    const Imath::Box2i window = header.dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x + 1);
    std::map<std::string, std::vector<std::uint32_t>> values;
    Imf::FrameBuffer from, to;
    for (auto it = input.header().channels().begin(); it != input.header().channels().end(); ++it) {
      std::vector<std::uint32_t>& of = values[it.name()];
      of.resize(width * static_cast<std::size_t>(window.max.y + 1));
      const auto slice = [&](Imf::PixelType type, long shift) {
        return Imf::Slice(type, reinterpret_cast<char*>(of.data()) - shift, 4, 4 * width);
      };
      from.insert(it.name(), slice(it.channel().type, 0));
      if (plan.without == it.name()) continue;
      const long shift = 4 * (plan.shift_x + plan.shift_y * static_cast<long>(width));
      to.insert(it.name(), slice(it.channel().type, shift));
    }
    input.setFrameBuffer(from);
    input.readPixels(0, window.max.y);
    if (!plan.without.empty()) {
      Imf::ChannelList channels;
      for (auto it = input.header().channels().begin(); it != input.header().channels().end();
           ++it) {
        if (plan.without != it.name()) channels.insert(it.name(), it.channel());
      }
      header.channels() = channels;
    }
    if (!plan.half.empty()) header.channels()[plan.half.c_str()].type = Imf::HALF;
    if (plan.samples != 0) header.insert("samples", Imf::IntAttribute(plan.samples));
    if (plan.no_samples) header.erase("samples");
    if (!plan.triangles.empty())
      header.insert("sourceTriangles", Imf::StringAttribute(plan.triangles));
    header.dataWindow().min.x += plan.shift_x;
    header.dataWindow().max.x += plan.shift_x;
    header.dataWindow().min.y += plan.shift_y;
    header.dataWindow().max.y += plan.shift_y;
    Imf::OutputFile output(changed.string().c_str(), header);
    if (!plan.half.empty()) return;  // its pixels do not matter
    output.setFrameBuffer(to);
    output.writePixels(window.max.y + 1);
  };
  rewrite({});
  expect_equal(match, load_match(changed));
  const auto said = [&](const Plan& plan, const std::string& reason) {
    rewrite(plan);
    EXPECT_NE(input_error(changed).find("as a saved match: " + reason + "."), std::string::npos)
        << input_error(changed);
  };
  said({.without = "v"}, "it has no channel 'v' of type float");
  said({.without = "status"}, "it has no channel 'status' of type unsigned int");
  said({.samples = 17}, "samples is 17, not 1 to 16");
  said({.samples = -1}, "samples is -1, not 1 to 16");
  said({.samples = 3}, "its width or height is not a multiple of its samples");
  said({.samples = 4}, "its width or height is not a multiple of its samples");
  said({.no_samples = true}, "it lacks the attributes samples and sourceTriangles");
  for (const char* text : {"4294967296", "x", "12x", "-1"}) {
    said({.triangles = text}, "sourceTriangles is not a valid number of triangles");
  }
  said({.shift_x = 1}, "its data window does not start at 0, 0");
  said({.shift_y = 2}, "its data window does not start at 0, 0");
}

/// Directions of clusters are layers, in a file of two clusters over three by two texels.
TEST(Clusters, AreLayersOfTheirDirections) {
  const fs::path path = test::scratch_folder() / "clusters.exr";
  VisibilityClusters clusters;
  clusters.width = 3;
  clusters.height = 2;
  clusters.count = 2;
  for (std::uint8_t i = 0; i < 6; ++i) {
    clusters.number.push_back(i % 3);
    for (std::uint8_t k = 0; k < 2; ++k) {
      const auto first = static_cast<float>(10 * i + 100 * k);
      clusters.directions.push_back({first + 1, first + 2, first + 3});
    }
  }
  save_clusters(clusters, path);
  Imf::InputFile file(path.string().c_str());
  for (int k = 0; k < 2; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name = "direction" + std::to_string(k) + "." + "XYZ"[axis];
      std::vector<float> read(6);
      Imf::FrameBuffer buffer;
      buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, read.data(), Imath::V2i(0, 0), 3, 2));
      file.setFrameBuffer(buffer);
      file.readPixels(0, 1);
      for (int i = 0; i < 6; ++i)
        EXPECT_EQ(read[static_cast<std::size_t>(i)], 10 * i + 100 * k + axis + 1) << name;
    }
  }
  fs::remove(path);
  for (const auto& change : std::vector<std::function<void(VisibilityClusters&)>>{
           [](VisibilityClusters& c) { c.count = 0; }, [](VisibilityClusters& c) { c.width = 0; },
           [](VisibilityClusters& c) { c.height = 0; },
           [](VisibilityClusters& c) { c.number.pop_back(); },
           [](VisibilityClusters& c) { c.directions.pop_back(); }}) {
    VisibilityClusters bad = clusters;
    change(bad);
    try {
      save_clusters(bad, path);
      ADD_FAILURE() << "was saved";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      EXPECT_NE(std::string(error.what())
                    .find("their arrays must have width x height (x count) elements."),
                std::string::npos);
    }
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST(MatchIo, DamagedFilesNeverCrash) {
  const fs::path path = test::scratch_folder() / "match.exr";
  save_match(make_match(20, 20, 2), path);
  const std::string whole = test::read_file(path);
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 1200; ++i) {
    std::string bytes = whole;
    if (i % 3 == 0) {
      bytes.resize(random() % bytes.size());
    } else {
      const std::size_t range = i % 3 == 1 ? 600 : bytes.size();
      bytes[random() % std::min(range, bytes.size())] = static_cast<char>(random());
    }
    std::ofstream(path, std::ios::binary) << bytes;
    try {
      const Match match = load_match(path);
      EXPECT_EQ(match.status.size(), std::size_t{match.width} * match.height);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 400);  // every truncated one at least
}

}  // namespace
}  // namespace kiln
