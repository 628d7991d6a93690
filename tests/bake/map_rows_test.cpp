// Maps that leave a bake row by row: the rows are those of a bake of whole images.
#include "bake/map_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bake/row_finisher.h"
#include "cl/context.h"
#include "image/gutter.h"
#include "kiln/bake.h"
#include "kiln/device.h"
#include "kiln/image.h"
#include "kiln/map.h"
#include "kiln/source.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// Joins the rows of a map.
class JoinedRows : public MapRows {
 public:
  explicit JoinedRows(const BakedMap& map) : map(map) { this->map.image.height = 0; }

  void put(Image& rows, std::span<const std::uint8_t> row_coverage) override {
    ASSERT_EQ(rows.width, map.image.width);
    ASSERT_EQ(rows.pixels.size(), std::size_t{rows.width} * rows.height * rows.channels);
    ASSERT_EQ(row_coverage.size(), std::size_t{rows.width} * rows.height);
    map.image.height += rows.height;
    map.image.pixels.insert(map.image.pixels.end(), rows.pixels.begin(), rows.pixels.end());
    coverage.insert(coverage.end(), row_coverage.begin(), row_coverage.end());
    std::fill(rows.pixels.begin(), rows.pixels.end(), 7.0F);  // Receivers may change rows
    ++pieces;
  }

  BakedMap map;
  std::vector<std::uint8_t> coverage;
  int pieces = 0;
};

/// A sphere with a hole, so that some samples miss.
Mesh open_sphere() {
  Mesh mesh = test::BumpySphere::dense(20000, true);
  mesh.triangles.resize(mesh.triangles.size() * 9 / 10);
  mesh.normal_triangles.resize(std::min(mesh.normal_triangles.size(), mesh.triangles.size()));
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    mesh.colors.push_back(
        {static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v / 7), 99, 255});
  }
  return mesh;
}

BakeOptions options_of(std::vector<MapKind> maps) {
  BakeOptions options;
  options.width = 192;
  options.height = 160;
  options.samples = 8;  // Two million samples: two bands
  options.maps = std::move(maps);
  options.occlusion.rays = 4;
  options.match.max_distance = Length::absolute(0.2);
  return options;
}

/// Compares both ways to bake. \returns number of pieces of each map that came row by row
std::map<std::string, int> expect_same(const BakeOptions& options, const std::string& what) {
  SCOPED_TRACE(what);
  static const Source source(*test::device(), open_sphere());
  const Mesh low = test::BumpySphere::light(24, 12);
  const BakeResult whole = bake(source, low, options);
  std::deque<JoinedRows> joined;
  const BakeResult rows = bake_rows(source, low, options, [&](const BakedMap& map) -> MapRows& {
    return joined.emplace_back(map);
  });
  EXPECT_GT(whole.report.missed, 0U);
  EXPECT_EQ(rows.coverage, whole.coverage);
  EXPECT_EQ(rows.report.gutter_texels, whole.report.gutter_texels);
  EXPECT_EQ(rows.report.missed, whole.report.missed);
  std::map<std::string, int> pieces;
  EXPECT_EQ(rows.maps.size(), whole.maps.size());
  for (std::size_t i = 0; i < whole.maps.size(); ++i) {
    const std::string name(whole.maps[i].kind.name);
    EXPECT_EQ(rows.maps[i].kind, whole.maps[i].kind);
    const auto by_rows = std::find_if(joined.begin(), joined.end(), [&](const JoinedRows& each) {
      return each.map.kind == whole.maps[i].kind;
    });
    if (by_rows == joined.end()) {
      EXPECT_EQ(rows.maps[i].image.pixels, whole.maps[i].image.pixels) << name;
      continue;
    }
    EXPECT_TRUE(rows.maps[i].image.pixels.empty()) << name;
    EXPECT_EQ(rows.maps[i].image.height, whole.maps[i].image.height) << name;
    EXPECT_EQ(by_rows->map.image.pixels, whole.maps[i].image.pixels) << name;
    // Padding is that of this map; where it fills misses, another map's is wider
    EXPECT_EQ(by_rows->coverage.size(), whole.coverage.size()) << name;
    std::size_t other_states = 0;
    for (std::size_t t = 0; t < std::min(by_rows->coverage.size(), whole.coverage.size()); ++t)
      other_states += (by_rows->coverage[t] == 1) != (whole.coverage[t] == 1) ? 1 : 0;
    EXPECT_EQ(other_states, 0U) << name;
    EXPECT_EQ(by_rows->map.origin, whole.maps[i].origin) << name;
    EXPECT_EQ(by_rows->map.unit, whole.maps[i].unit) << name;
    EXPECT_EQ(by_rows->map.ranges.size(), whole.maps[i].ranges.size()) << name;
    for (std::size_t c = 0; c < by_rows->map.ranges.size(); ++c) {
      EXPECT_EQ(by_rows->map.ranges[c].low, whole.maps[i].ranges[c].low) << name;
      EXPECT_EQ(by_rows->map.ranges[c].high, whole.maps[i].ranges[c].high) << name;
    }
    pieces[name] = by_rows->pieces;
  }
  return pieces;
}

TEST(MapRows, AreThoseOfWholeImages) {
  KILN_REQUIRE_DEVICE();
  for (const std::int32_t padding : {0, 1, 16, 100, 4096}) {
    for (const MissPolicy miss : {MissPolicy::keep, MissPolicy::mark}) {
      BakeOptions options = options_of({MapKind::normal, MapKind{"position"}, MapKind{"height"}});
      options.encoding.gutter = padding;
      options.encoding.miss = miss;
      const std::map<std::string, int> pieces =
          expect_same(options, std::to_string(padding) + (miss == MissPolicy::mark ? " mark" : ""));
      if (miss == MissPolicy::mark) {
        EXPECT_TRUE(pieces.empty()) << "marked misses are filled first, from whole images";
        continue;
      }
      // A piece for each band whose rows are final before the last band is computed.
      for (const char* name : {"normal", "position", "height"}) {
        ASSERT_TRUE(pieces.contains(name)) << name;
        EXPECT_EQ(pieces.at(name), padding < 80 ? 2 : 1) << name << ' ' << padding;
      }
    }
  }
}

TEST(MapRows, RawNormalsAndOtherSpacesAreTheSame) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = options_of({MapKind::normal, MapKind{"normal_object"}});
  options.encoding.raw = true;
  EXPECT_EQ(expect_same(options, "raw").size(), 2U);
}

/// Maps that need whole images keep them, beside others that do not.
TEST(MapRows, MapsOfBothKindsAreTheSame) {
  KILN_REQUIRE_DEVICE();
  const std::vector<std::vector<MapKind>> lists = {
      {MapKind::normal, MapKind{"id"}, MapKind::mask, MapKind{"ao"}},
      {MapKind{"id"}, MapKind::normal},
      {MapKind{"vertex_color"}, MapKind::normal},
      {MapKind::mask, MapKind::normal, MapKind{"vertex_color"}}};
  for (const std::vector<MapKind>& list : lists) {
    const std::map<std::string, int> pieces =
        expect_same(options_of(list), std::string(list[0].name));
    EXPECT_TRUE(pieces.contains("normal"));
    EXPECT_FALSE(pieces.contains("id"));
    EXPECT_FALSE(pieces.contains("mask"));
    EXPECT_FALSE(pieces.contains("vertex_color"));
  }
}

/// Stages after the bands need whole images.
TEST(MapRows, OptionsThatNeedWholeImagesKeepThem) {
  KILN_REQUIRE_DEVICE();
  const std::map<std::string, std::function<void(BakeOptions&)>> changes = {
      {"mips", [](BakeOptions& options) { options.encoding.mips = true; }},
      {"unlimited padding", [](BakeOptions& options) { options.encoding.gutter = -1; }},
      {"two components", [](BakeOptions& options) { options.encoding.two_component = true; }},
      {"filled misses", [](BakeOptions& options) { options.encoding.miss = MissPolicy::fill; }},
      {"measured errors", [](BakeOptions& options) { options.report.errors = true; }},
      {"fallback",
       [](BakeOptions& options) {
         options.match.max_distance = Length::absolute(0.01);
         options.match.fallback = {MatchMethod::closest};
       }},
  };
  for (const auto& [name, change] : changes) {
    BakeOptions options = options_of({MapKind::normal});
    options.samples = 1;
    change(options);
    EXPECT_TRUE(expect_same(options, name).empty()) << name;
  }
}

/// Padding is as wide above and below the border of every piece of rows: each row of texels is the only one baked once.
TEST(MapRows, PaddingReachesOverThePiecesBorders) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kWidth = 5, kRows = 23;
  for (const std::uint32_t padding : {1U, 2U, 4U}) {
    BakeOptions options;
    options.width = kWidth;
    options.height = kRows;
    options.encoding.gutter = static_cast<std::int32_t>(padding);
    options.encoding.raw = true;
    const MapInfo info{MapKind{"position"}, 3, MapType::vector, "", 0, 1};
    for (const std::uint32_t step : {1U, 3U, 5U, 7U}) {
      for (std::uint32_t baked_row = 0; baked_row < kRows; ++baked_row) {
        RowFinisher finisher(context_of(*test::device()), options);
        finisher.add(info);
        BakedMap map;
        map.image = {kWidth, kRows, 3, {}};
        JoinedRows joined(map);
        finisher.set_target(0, joined);
        std::vector<std::uint8_t> coverage(std::size_t{kWidth} * kRows, kCoverageEmpty);
        for (std::uint32_t first = 0; first < kRows; first += step) {
          const std::uint32_t end = std::min(kRows, first + step);
          finisher.extend(end);
          const std::span<float> values = finisher.rows(0, first, end - first);
          if (baked_row >= first && baked_row < end) {
            for (std::uint32_t x = 0; x < kWidth; ++x) {
              for (std::uint32_t c = 0; c < 3; ++c) {
                values[((baked_row - first) * kWidth + x) * 3 + c] =
                    static_cast<float>(10 * x + c + 1);
              }
              coverage[baked_row * kWidth + x] = kCoverageBaked;
            }
          }
          finisher.finish(coverage);
        }
        ASSERT_EQ(joined.map.image.height, kRows);
        std::uint64_t padded = 0;
        for (std::uint32_t y = 0; y < kRows; ++y) {
          const std::uint32_t away = y > baked_row ? y - baked_row : baked_row - y;
          padded += away > 0 && away <= padding ? kWidth : 0;
          for (std::uint32_t x = 0; x < kWidth; ++x) {
            for (std::uint32_t c = 0; c < 3; ++c) {
              ASSERT_EQ(joined.map.image.at(x, y)[c],
                        away <= padding ? static_cast<float>(10 * x + c + 1) : 0.0F)
                  << "row " << y << " of " << baked_row << ", pieces of " << step << ", padding "
                  << padding;
            }
          }
        }
        EXPECT_EQ(finisher.padded(), padded);
      }
    }
  }
}

}  // namespace
}  // namespace kiln
