// Cages that are copies of the low poly, cut or sorted otherwise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/cage.h"

namespace kiln {
namespace {

/// A block of 3 x 3 columns whose top is bent, so that quads have diagonals of different lengths.
struct Block {
  std::string name;
  double x;         ///< Where it stands
  double away = 0;  ///< How far its vertices lie off those of a low poly, along each axis
  int columns = 3;
};

/// Vertices in the order of the blocks; quads begin at the first corner or at the second.
std::string obj(const std::vector<Block>& blocks, int first_corner = 0, bool named = true) {
  std::string text;
  int base = 1;
  for (const Block& block : blocks) {
    if (named) text += "o " + block.name + "\n";
    const int n = block.columns;
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        text += "v " + std::to_string(block.x + i + block.away) + " " +
                std::to_string(j + 0.25 * (i % 2) + block.away) + " " +
                std::to_string(0.5 * ((i * i + j) % 3) + block.away) + "\n";
      }
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const int at = base + j * (n + 1) + i;
        const int corners[] = {at, at + 1, at + n + 2, at + n + 1};
        text += "f";
        for (int k = 0; k < 4; ++k) text += " " + std::to_string(corners[(k + first_corner) % 4]);
        text += "\n";
      }
    }
    base += (n + 1) * (n + 1);
  }
  return text;
}

Mesh read(const std::string& text, const char* name) {
  return load_mesh(std::as_bytes(std::span(text)), name);
}

Frame frame_of(const Mesh& mesh) { return Frame::of(mesh); }

/// Every corner's vertex of the cage lies where the low poly's does, moved by `away` along each axis.
void expect_moved(const Mesh& low, const Mesh& cage, float away) {
  const Frame frame = frame_of(low);
  const CageCorners read = read_cage(low, cage, frame);
  ASSERT_EQ(read.kind, CageKind::offsets) << (read.hull ? read.hull->mismatch : "");
  Mesh moved = low;
  for (Vec3& p : moved.positions) p = {p.x + away, p.y + away, p.z + away};
  const std::vector<Vec3> wanted = frame.to_frame(moved);
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(read.outer_corners[3 * t + k], wanted[low.triangles[t][k]]) << t << ", " << k;
    }
  }
}

std::string mismatch(const Mesh& low, const Mesh& cage) {
  const CageCorners read = read_cage(low, cage, frame_of(low));
  EXPECT_EQ(read.kind, CageKind::hull);
  return read.hull ? read.hull->mismatch : "";
}

TEST(CageCopy, IsCutAsTheLowPoly) {
  const Mesh low = read(obj({{"a", 0}, {"b", 8}}), "low.obj");
  // The other diagonals of all quads, and of those that are shorter.
  expect_moved(low, read(obj({{"a", 0, 0.5}, {"b", 8, 0.5}}, 1), "cage.obj"), 0.5F);
  Mesh some = read(obj({{"a", 0, 0.5}, {"b", 8, 0.5}}), "cage.obj");
  for (std::size_t t = 0; t < some.triangles.size(); t += 6) {
    const auto [a, b, c] = some.triangles[t];
    const std::uint32_t d = some.triangles[t + 1][2];
    some.triangles[t] = {a, b, d};
    some.triangles[t + 1] = {b, c, d};
  }
  expect_moved(low, some, 0.5F);
  // Triangles alone, without the polygons that they were.
  some.polygons.clear();
  expect_moved(low, some, 0.5F);
}

TEST(CageCopy, PairsObjectsByTheirNames) {
  const Mesh low = read(obj({{"b_low", 0}, {"a_low", 8}}), "low.obj");
  for (const std::string ending : {"_low", "_cage", "", "_low_cage", "_LOW"}) {
    // Names decide also where another part is nearer: both blocks have the same faces.
    const Mesh cage = read(obj({{"a" + ending, 8, 0.5}, {"b" + ending, 0, 0.5}}), "cage.obj");
    expect_moved(low, cage, 0.5F);
    const Mesh cut = read(obj({{"a" + ending, 8, 0.5}, {"b" + ending, 0, 0.5}}, 1), "cage.obj");
    expect_moved(low, cut, 0.5F);
  }
}

TEST(CageCopy, PairsObjectsOfOtherNamesByTheirPlaces) {
  const Mesh low = read(obj({{"a", 0}, {"b", 8}, {"c", 16, 0, 2}}), "low.obj");
  expect_moved(low, read(obj({{"z", 16, 0.5, 2}, {"y", 8, 0.5}, {"x", 0, 0.5}}), "cage.obj"), 0.5F);
  // Without names there are no pieces: in order.
  const Mesh bare = read(obj({{"a", 0}, {"b", 8}}, 0, false), "low.obj");
  expect_moved(bare, read(obj({{"a", 0, 0.5}, {"b", 8, 0.5}}, 0, false), "cage.obj"), 0.5F);
}

TEST(CageCopy, PairsPartsWithoutNamesByTheirPlaces) {
  const Mesh low = read(obj({{"", 0}, {"", 8}, {"", 16}}, 0, false), "low.obj");
  for (const int first_corner : {0, 1}) {
    const auto cage = [&](const std::vector<Block>& blocks) {
      return read(obj(blocks, first_corner, false), "cage.obj");
    };
    expect_moved(low, cage({{"", 16, 0.5}, {"", 0, 0.5}, {"", 8, 0.5}}), 0.5F);
    // Two of eight.
    std::vector<Block> many, swapped;
    for (int i = 0; i < 8; ++i) {
      many.push_back({"", 8.0 * i});
      swapped.push_back({"", 8.0 * (i == 2 ? 5 : i == 5 ? 2 : i), 0.5});
    }
    expect_moved(read(obj(many, 0, false), "low.obj"), cage(swapped), 0.5F);
    // If one is nearest to two parts, nothing says which is which.
    EXPECT_EQ(mismatch(low, cage({{"", 16, 0.5}, {"", 16.25, 0.5}, {"", 15.75, 0.5}})),
              "with faces paired in order, its vertices lie far from those of the low poly");
  }
  // Names that say otherwise have the last word.
  const Mesh named = read(obj({{"a", 0}, {"b", 8}}), "low.obj");
  EXPECT_EQ(
      read_cage(named, read(obj({{"a", 8, 0.5}, {"b", 0, 0.5}}), "c.obj"), frame_of(named)).kind,
      CageKind::offsets);
  // In order, a cage may lie as far out as it likes.
  expect_moved(low, read(obj({{"", 0, 3}, {"", 8, 3}, {"", 16, 3}}, 0, false), "cage.obj"), 3);
}

TEST(CageCopy, SaysWhatDoesNotFit) {
  const Mesh low = read(obj({{"a", 0}, {"b", 8}}), "low.obj");
  EXPECT_EQ(mismatch(low, read(obj({{"a", 0, 0.5}, {"b", 8, 0.5, 2}}), "cage.obj")),
            "its 'b' has 8 triangles, and the low poly's 'b' has 18");
  EXPECT_EQ(mismatch(low, read(obj({{"a_cage", 0, 0.5}}), "cage.obj")),
            "none of its parts has the name of the low poly's 'b'");
  Mesh other = read(obj({{"a", 0, 0.5}, {"b", 8, 0.5}}), "cage.obj");
  std::swap(other.triangles[18], other.triangles[35]);
  EXPECT_EQ(mismatch(low, other),
            "the faces of its 'b' do not use the same vertices in the same order as those of the "
            "low poly's 'b'");
  // A hull of its own is no copy, and nobody says so.
  EXPECT_EQ(mismatch(low, read(obj({{"hull", 0, 0.5, 7}}), "hull.obj")), "");
}

Mesh moved_groups(Mesh mesh, std::vector<std::string> names) {
  mesh.groups = mesh.objects;
  mesh.group_names = std::move(names);
  mesh.objects.clear();
  mesh.object_names.clear();
  return mesh;
}

/// Groups pair as objects do, where either mesh has no objects.
TEST(CageCopy, PairsGroupsByName) {
  const Mesh low = moved_groups(read(obj({{"a", 0}, {"b", 8}, {"c", 16}}), "low.obj"),
                                {"a_LP", "b_low.001", "c"});
  const Mesh cage = read(obj({{"a", 16, 0.5}, {"b", 0, 0.5}, {"c", 8, 0.5}}), "cage.obj");
  expect_moved(low, moved_groups(cage, {"C_cage", "a_low_cage", "b_low.001"}), 0.5F);
  // Two of one name pair by nothing but their places.
  expect_moved(low, moved_groups(cage, {"c_low", "c_cage", "a"}), 0.5F);
  const Mesh twice = moved_groups(low, {});
  Mesh same = twice;
  same.groups = low.groups;
  same.group_names = {"b_low", "b_lp", "c"};
  expect_moved(same, moved_groups(cage, {"c", "a", "b"}), 0.5F);
  // A vertex of the cage that has no place says nothing, wherever it is.
  Mesh holed = moved_groups(cage, {"C_cage", "a_low_cage", "b_low.001"});
  holed.positions[20].y = std::numeric_limits<float>::infinity();
  const CageCorners corners = read_cage(low, holed, frame_of(low));
  EXPECT_EQ(corners.kind, CageKind::offsets);
  std::size_t without_place = 0;
  for (const Vec3& p : corners.outer_corners) without_place += std::isfinite(p.y) ? 0 : 1;
  std::size_t uses = 0;
  for (const Triangle& t : holed.triangles) {
    uses += static_cast<std::size_t>(std::count(t.begin(), t.end(), 20U));
  }
  EXPECT_EQ(without_place, uses);
}

}  // namespace
}  // namespace kiln
