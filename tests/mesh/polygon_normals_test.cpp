// Computed normals weight polygons by their own corners and normals, not the triangles that they were cut into.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include "asset/mesh_reader.h"
#include "kiln/mesh.h"
#include "mesh/high_poly_normals.h"
#include "mesh/normals.h"

namespace kiln {
namespace {

using Face = std::vector<std::uint32_t>;

/// A bumpy sheet of quads, some of them joined to hexagons, none flat.
struct Sheet {
  static constexpr std::uint32_t kRows = 13, kColumns = 17;
  std::vector<std::array<double, 3>> points;
  std::vector<Face> faces;

  explicit Sheet(bool polygons) {
    std::mt19937 random(11);
    const auto jitter = [&] { return static_cast<double>(random() % 1000) / 2500 - 0.2; };
    for (std::uint32_t y = 0; y < kRows; ++y) {
      for (std::uint32_t x = 0; x < kColumns; ++x) {
        // Multiples of 2^-10, which a float and six digits hold.
        const auto round = [](double v) { return std::round(v * 1024) / 1024; };
        points.push_back({round(x + jitter()), round(y + jitter()), round(jitter())});
      }
    }
    const auto at = [](std::uint32_t x, std::uint32_t y) { return y * kColumns + x; };
    for (std::uint32_t y = 0; y + 1 < kRows; ++y) {
      for (std::uint32_t x = 0; x + 1 < kColumns; ++x) {
        if (!polygons) {
          faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
          faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
        } else if (random() % 4 == 0 && x + 2 < kColumns) {
          faces.push_back({at(x, y), at(x + 1, y), at(x + 2, y), at(x + 2, y + 1), at(x + 1, y + 1),
                           at(x, y + 1)});
          ++x;
        } else {
          faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)});
        }
      }
    }
  }

  std::string text(MeshFormat format) const {
    std::string result;
    const auto add_points = [&](const char* start) {
      for (const auto& p : points) {
        char line[120];
        std::snprintf(line, sizeof line, "%s%.12g %.12g %.12g\n", start, p[0], p[1], p[2]);
        result += line;
      }
    };
    const std::string vertices = std::to_string(points.size());
    const std::string count = std::to_string(faces.size());
    if (format == MeshFormat::ply) {
      result = "ply\nformat ascii 1.0\nelement vertex " + vertices +
               "\nproperty float x\nproperty float y\nproperty float z\nelement face " + count +
               "\nproperty list uchar int vertex_indices\nend_header\n";
    } else if (format == MeshFormat::off) {
      result = "OFF\n" + vertices + " " + count + " 0\n";
    }
    add_points(format == MeshFormat::obj ? "v " : "");
    for (const Face& face : faces) {
      result += format == MeshFormat::obj ? "f" : std::to_string(face.size());
      for (const std::uint32_t v : face) {
        result += " " + std::to_string(v + (format == MeshFormat::obj ? 1 : 0));
      }
      result += "\n";
    }
    return result;
  }
  Mesh mesh(MeshFormat format) const {
    std::vector<Warning> warnings;
    return parse_mesh({"sheet", text(format), &warnings}, format);
  }

  /// Newell's normal of each face, weighted by the angle between the sides at each corner.
  std::vector<Vec3d> expected() const {
    std::vector<Vec3d> sums(points.size());
    const auto at = [&](std::uint32_t v) {
      return Vec3d(points[v][0], points[v][1], points[v][2]);
    };
    for (const Face& face : faces) {
      const std::size_t n = face.size();
      Vec3d normal{};
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3d a = at(face[i]), b = at(face[(i + 1) % n]);
        normal +=
            Vec3d((a.y - b.y) * (a.z + b.z), (a.z - b.z) * (a.x + b.x), (a.x - b.x) * (a.y + b.y));
      }
      normal = normal * (1 / length(normal));
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3d back = at(face[(i + n - 1) % n]) - at(face[i]);
        const Vec3d fore = at(face[(i + 1) % n]) - at(face[i]);
        sums[face[i]] += normal * std::acos(dot(back, fore) / (length(back) * length(fore)));
      }
    }
    for (Vec3d& sum : sums) sum = sum * (1 / length(sum));
    return sums;
  }
};

TEST(PolygonNormals, AreThoseOfThePolygons) {
  const Sheet sheet(true);
  const std::vector<Vec3d> expected = sheet.expected();
  for (const MeshFormat format : {MeshFormat::obj, MeshFormat::ply, MeshFormat::off}) {
    Mesh mesh = sheet.mesh(format);
    ASSERT_EQ(mesh.polygons.size(), mesh.triangles.size());
    EXPECT_EQ(mesh.polygons.back() + 1, sheet.faces.size());
    const std::vector<Vec3> normals = corner_normals(mesh, mesh.positions).normals;
    double worst = 0, worst_of_triangles = 0;
    const std::vector<Vec3> others = vertex_normals(mesh.positions, mesh.triangles);
    for (std::size_t v = 0; v < expected.size(); ++v) {
      worst = std::max(worst, length(to_double(normals[v]) - expected[v]));
      worst_of_triangles = std::max(worst_of_triangles, length(to_double(others[v]) - expected[v]));
    }
    EXPECT_LT(worst, 1e-6);
    EXPECT_GT(worst_of_triangles, 0.01);  // so that the test can tell
  }
}

TEST(PolygonNormals, TrianglesStayAsTheyWere) {
  const Mesh mesh = Sheet(false).mesh(MeshFormat::obj);
  EXPECT_TRUE(mesh.polygons.empty());
  Mesh alone = mesh;  // each triangle a polygon of its own
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) alone.polygons.push_back(t);
  EXPECT_EQ(corner_normals(mesh, mesh.positions).normals,
            corner_normals(alone, mesh.positions).normals);
}

TEST(PolygonNormals, FollowWhereVerticesMove) {
  Mesh mesh = Sheet(true).mesh(MeshFormat::obj);
  HighPolyNormals normals(mesh, mesh.positions);
  for (const std::uint32_t vertex : {40U, 111U, 200U}) {
    mesh.positions[vertex].z += 0.375F;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const Triangle& corners = mesh.triangles[t];
      if (std::find(corners.begin(), corners.end(), vertex) != corners.end()) {
        triangles.push_back(t);
      }
    }
    normals.move(mesh, mesh.positions, triangles);
    EXPECT_EQ(normals.corners().normals, corner_normals(mesh, mesh.positions).normals);
  }
}

TEST(PolygonNormals, PolygonsThatAreNoneCountAsTriangles) {
  // A quad that passes a vertex twice, and one without area as a whole.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 1}, {0, 1, 4}};
  mesh.polygons = {0, 0, 1};
  Mesh plain = mesh;
  plain.polygons.clear();
  EXPECT_EQ(corner_normals(mesh, mesh.positions).normals,
            corner_normals(plain, mesh.positions).normals);
}

/// Processor seconds for a polygon's corner weights, the quickest of four tries.
double seconds_for_polygon(std::uint32_t corners) {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < corners; ++i) {
    const double angle = 6.283185307179586 * i / corners;
    positions.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
    if (i > 1) triangles.push_back({0, i - 1, i});
  }
  const std::vector<std::uint32_t> polygons(triangles.size(), 0);
  std::vector<CornerWeights> weights(triangles.size());
  double best = 1e9;
  for (int i = 0; i < 4; ++i) {
    const std::clock_t start = std::clock();
    corner_weights(positions, triangles, polygons, 0, triangles.size(), weights.data());
    best = std::min(best, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  return best;
}

// Each corner looked for its triangle from the first on: a disc of a million corners never ended.
TEST(PolygonNormals, GrowNearLinearlyWithCorners) {
  const double few = seconds_for_polygon(4'000), many = seconds_for_polygon(64'000);
  EXPECT_LE(many, 64 * few + 0.01) << "16 times the corners";  // with squares: 256 times
}

}  // namespace
}  // namespace kiln
