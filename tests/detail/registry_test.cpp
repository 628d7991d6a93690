// Facts of maps' rows that the rest of Kiln reads: sessions, errors, mip chains, streams, plans, ranges, messages.
#include "detail/registry.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

namespace kiln {
namespace {

/// Names of the rows that have a property, in the registry's order.
template <typename Has>
std::string names_of(const Has& has) {
  std::string names;
  for (const MapRow& row : map_rows()) {
    if (has(row)) names += (names.empty() ? "" : " ") + std::string(row.info.kind.name);
  }
  return names;
}

TEST(MapRows, StateWhatAMapReads) {
  EXPECT_EQ(names_of([](const MapRow& row) { return row.supports_streaming; }),
            "normal ao bent_normal thickness mask height displacement distance provenance "
            "wireframe position slope color vertex_color shadow normal_object normal_face");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.reads_around; }),
            "ao bent_normal thickness shadow");
  // A session bakes all others only where normals, colours or UVs change.
  EXPECT_EQ(names_of([](const MapRow& row) { return !row.follows_positions; }),
            "normal mask uv slope vertex_color normal_object normal_face");
  // What reads around a point cannot do with the matched triangles alone: these cast rays at all chunks.
  EXPECT_EQ(names_of([](const MapRow& row) { return row.supports_streaming && row.reads_around; }),
            "ao bent_normal thickness shadow");
}

TEST(MapRows, StateWhatValuesAre) {
  EXPECT_EQ(names_of([](const MapRow& row) { return row.is_shading_normal; }), "normal");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.weights; }), "opacity");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.weighted; }), "color");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.depends_on_texel_size; }), "wireframe");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.compared_channels != 0; }), "convexity");
  EXPECT_EQ(map_row(MapKind{"convexity"}).compared_channels, 2U);
  EXPECT_EQ(names_of([](const MapRow& row) { return row.range != nullptr; }),
            "height curvature displacement distance position convexity");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.info.low == 0 && row.info.high == 0; }),
            "height curvature displacement distance position convexity");
  for (const MapRow& row : map_rows()) {
    if (row.range) continue;
    const bool is_signed = row.info.kind.name == "visibility";
    EXPECT_EQ(row.info.low, is_signed ? -1 : 0) << row.info.kind.name;
    EXPECT_EQ(row.info.high, row.info.kind.name == "slope" ? 180 : 1) << row.info.kind.name;
  }
  std::map<std::string, std::string> units;
  for (const MapRow& row : map_rows()) {
    if (!row.unit.empty()) units[std::string(row.unit)] += " " + std::string(row.info.kind.name);
  }
  EXPECT_EQ(units, (std::map<std::string, std::string>{
                       {"world units", " height displacement distance position"},
                       {"1 / world unit", " curvature convexity"},
                       {"degrees", " slope"},
                       {"of a unit length", " visibility deviation"},
                       {"of the layout", " uv"}}));
}

TEST(MapRows, StateWhatMissedTexelsHold) {
  EXPECT_EQ(names_of([](const MapRow& row) { return row.info.missed == MissedTexels::neighbours; }),
            "color vertex_color");
  EXPECT_EQ(names_of([](const MapRow& row) { return row.info.missed == MissedTexels::zero; }),
            "opacity");
}

TEST(MapRows, StateTheirOptions) {
  const std::map<std::string, std::string> options = {
      {"ao", "occlusion"},
      {"thickness", "occlusion.rays occlusion.distance"},
      {"position", "encoding.origin"},
      {"id", "id_by"},
      {"color", "color"},
      {"opacity", "opacity"},
      {"curvature", "curvature_radius"},
      {"convexity", "curvature_radius"},
      {"visibility", "match.visibility"},
      {"deviation", "match.visibility"}};
  for (const MapRow& row : map_rows()) {
    const std::string name(row.info.kind.name);
    if (name == "bent_normal" || name == "shadow") {
      EXPECT_TRUE(obeys(row.info, "occlusion.rays")) << name;
      EXPECT_TRUE(obeys(row.info, "occlusion.own_part")) << name;
      EXPECT_EQ(obeys(row.info, "light"), name == "shadow");
      EXPECT_EQ(obeys(row.info, "occlusion.falloff"), name == "bent_normal");
      EXPECT_FALSE(obeys(row.info, "occlusion.max_error")) << name;
      continue;
    }
    const auto wanted = options.find(name);
    EXPECT_EQ(row.info.options, wanted == options.end() ? "" : wanted->second) << name;
  }
  EXPECT_EQ(map_row(MapKind{"normal_object"}).info.space, NormalMapSpace::object);
  EXPECT_EQ(map_row(MapKind{"normal_face"}).info.space, NormalMapSpace::face);
  EXPECT_EQ(names_of([](const MapRow& row) { return row.info.space.has_value(); }),
            "normal_object normal_face");
}

/// No name, and no name of another program, stands for two maps.
TEST(MapRows, NamesAreOfOneMapEach) {
  std::set<std::string> names;
  std::size_t count = 0;
  for (const MapRow& row : map_rows()) {
    std::string all =
        std::string(row.info.kind.name) + " " + std::string(row.info.other_names) + " ";
    for (std::size_t begin = 0, end = 0; (end = all.find(' ', begin)) != all.npos;
         begin = end + 1) {
      if (end == begin) continue;
      names.insert(all.substr(begin, end - begin));
      ++count;
    }
    EXPECT_FALSE(row.info.description.empty()) << row.info.kind.name;
    EXPECT_TRUE(row.make != nullptr) << row.info.kind.name;
    EXPECT_GE(row.info.channels, 1U);
    EXPECT_LE(row.info.channels, 4U);
  }
  EXPECT_EQ(names.size(), count);
  for (const char* name : {"tangent_normal", "bump", "cavity", "albedo", "alpha", "bent",
                           "material_id", "world_space_normal", "ambient_occlusion", "concavity"}) {
    EXPECT_EQ(names.count(name), 1U) << name;
  }
}

}  // namespace
}  // namespace kiln
