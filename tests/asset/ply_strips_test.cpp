// PLY whose surface is triangle strips, as archives of scans have it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "asset/mesh_reader.h"
#include "kiln/mesh.h"

namespace kiln {
namespace {

struct Parsed {
  Mesh mesh;
  std::vector<Warning> warnings;
};

Parsed parse(const std::string& text) {
  Parsed result;
  result.mesh = parse_mesh({"scan.ply", text, &result.warnings}, MeshFormat::ply);
  return result;
}

std::string message(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    return error.what();
  }
  ADD_FAILURE() << "was read";
  return {};
}

/// Numbers as a PLY body of one encoding has them.
class Body {
 public:
  explicit Body(std::string encoding) : encoding_(std::move(encoding)) {}
  template <typename T>
  void put(T value) {
    if (encoding_ == "ascii") {
      text_ += std::to_string(value) + " ";
      return;
    }
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if (encoding_ == "binary_big_endian") std::reverse(bytes, bytes + sizeof(T));
    text_.append(bytes, sizeof(T));
  }
  const std::string& text() const { return text_; }

 private:
  std::string encoding_, text_;
};

constexpr int kRows = 9, kColumns = 14;

/// A bumpy sheet of kRows x kColumns vertices.
std::vector<float> sheet() {
  std::vector<float> values;
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      values.push_back(static_cast<float>(x));
      values.push_back(static_cast<float>(y));
      values.push_back(std::sin(0.7F * static_cast<float>(x * y)));
    }
  }
  return values;
}

/// A strip a row; where `ends`, each is closed by -1, else by turning round at repeated vertices.
std::vector<std::int32_t> strips(bool ends) {
  std::vector<std::int32_t> result;
  for (int y = 0; y + 1 < kRows; ++y) {
    const int first = y * kColumns;
    if (!ends && y != 0) result.insert(result.end(), {result.back(), first + kColumns});
    for (int x = 0; x < kColumns; ++x)
      result.insert(result.end(), {first + x + kColumns, first + x});
    if (ends) result.push_back(-1);
  }
  return result;
}

std::string ply(const std::string& encoding, const std::string& type,
                const std::vector<std::int32_t>& list) {
  Body body(encoding);
  for (const float value : sheet()) body.put(value);
  body.put(static_cast<std::int32_t>(list.size()));
  for (const std::int32_t index : list) {
    if (type == "uint") {
      body.put(static_cast<std::uint32_t>(index));
    } else if (type == "short") {
      body.put(static_cast<std::int16_t>(index));
    } else {
      body.put(index);
    }
  }
  return "ply\nformat " + encoding + " 1.0\nelement vertex " + std::to_string(kRows * kColumns) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n"
         "property list int " +
         type + " vertex_indices\nend_header\n" + body.text();
}

TEST(PlyStrips, EveryEncodingGivesTheSheet) {
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const std::string type : {"int", "uint", "short"}) {
      for (const bool ends : {true, false}) {
        const Parsed got = parse(ply(encoding, type, strips(ends)));
        EXPECT_TRUE(got.warnings.empty());
        const auto& triangles = got.mesh.triangles;
        ASSERT_EQ(triangles.size(), 2U * (kRows - 1) * (kColumns - 1)) << encoding << type << ends;
        // Each cell of the sheet twice, all looking up.
        std::vector<int> cells(kRows * kColumns);
        for (const Triangle& t : triangles) {
          const Vec3 &a = got.mesh.positions[t[0]], &b = got.mesh.positions[t[1]],
                     &c = got.mesh.positions[t[2]];
          EXPECT_EQ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x), 1);
          const float x = std::min({a.x, b.x, c.x}), y = std::min({a.y, b.y, c.y});
          ++cells[static_cast<std::size_t>(y) * kColumns + static_cast<std::size_t>(x)];
        }
        EXPECT_EQ(std::count(cells.begin(), cells.end(), 2), (kRows - 1) * (kColumns - 1));
      }
    }
  }
}

TEST(PlyStrips, StandBesideFacesAndAttributes) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
      "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "element face 1\nproperty list uchar int vertex_indices\n"
      "element tristrips 2\nproperty uchar kind\nproperty list int int vertex_index\nend_header\n"
      "0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n1 1 0 0 0 1\n0 2 0 0 0 1\n"
      "3 0 1 2\n7 3 2 1 3\n7 6 -1 2 3 4 -1 0\n";
  const Parsed got = parse(text);
  const std::vector<Triangle> wanted = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
  EXPECT_EQ(got.mesh.triangles, wanted);
  EXPECT_EQ(got.mesh.normal_triangles, wanted);
  // The lone vertex 0 is no strip.
  ASSERT_EQ(got.warnings.size(), 1U);
  EXPECT_EQ(got.warnings[0].code, "short-faces");
  EXPECT_EQ(got.warnings[0].count, 1U);
}

TEST(PlyStrips, BadOnesAreNamed) {
  auto list = strips(true);
  list[2 * kColumns + 5] = kRows * kColumns;
  for (const std::string encoding : {"ascii", "binary_big_endian"}) {
    const std::string text = message(ply(encoding, "int", list));
    for (const char* word : {"scan.ply", "strip 1", "uses vertex 126", "are 126"}) {
      EXPECT_NE(text.find(word), std::string::npos) << text;
    }
    std::string cut = ply(encoding, "int", strips(true));
    cut.resize(cut.size() - 9);
    const std::string short_text = message(cut);
    EXPECT_NE(short_text.find("truncated"), std::string::npos) << short_text;
  }
  list[2 * kColumns + 5] = -2;
  EXPECT_NE(message(ply("ascii", "int", list)).find("uses vertex -2"), std::string::npos);
  EXPECT_NE(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                    "property float z\nelement tristrips 1\nproperty int n\nend_header\n0 0 0\n1\n")
                .find("triangle strips need exactly one list"),
            std::string::npos);
}

}  // namespace
}  // namespace kiln
