// LOW's own tangents at the command line.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/call.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/pictures.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::ProcessResult;

/// A square whose tangents point along v instead of u: MikkTSpace's are along u.
void save_square(const fs::path& path, bool tangents) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex 4\n";
  for (const char* name : {"x", "y", "z", "s", "t"}) out << "property float " << name << "\n";
  for (const char* name : {"tx", "ty", "tz", "tw"}) {
    if (tangents) out << "property float " << name << "\n";
  }
  out << "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
    out << x << " " << y << " 0 " << (x + 1) / 2 << " " << (y + 1) / 2;
    out << (tangents ? " 0 1 0 -1\n" : "\n");
  }
  out << "4 0 1 2 3\n";
}

TEST(TangentsCommand, ThoseOfTheFileAreTaken) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_square(folder / "plain.ply", false);
  save_square(folder / "turned.ply", true);
  std::ofstream(folder / "high.obj")
      << "v -2 -2 -0.06\nv 2 -2 0.02\nv 2 2 0.06\nv -2 2 -0.02\nf 1 2 3 4\n";
  const auto bake = [&](const std::string& low, const std::vector<std::string>& flags,
                        std::string* says = nullptr) {
    std::vector<std::string> line = {"bake",
                                     folder / "high.obj",
                                     folder / (low + ".ply"),
                                     "--out",
                                     folder / "maps",
                                     "--size",
                                     "16",
                                     "--format",
                                     "exr32",
                                     "--raw",
                                     "--max-distance",
                                     "10%",
                                     "--recall",
                                     "0",
                                     "--json",
                                     folder / "report.json"};
    line.insert(line.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(line);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    if (says != nullptr) *says = test::read_file(folder / "report.json");
    return test::read_picture(folder / "maps" / (low + "_normal.exr"));
  };
  std::string report;
  const Image mikk = bake("plain", {}), own = bake("turned", {}, &report);
  EXPECT_NE(report.find("\"tangents\": \"file\""), std::string::npos);
  // n = (a, b, c) along u, v and the normal is (b, a, c) along the file's: v, then -cross(n, v) = u.
  const float* a = mikk.at(8, 8);
  const float* b = own.at(8, 8);
  EXPECT_GT(std::abs(a[0] - a[1]), 0.004F);
  EXPECT_NEAR(a[0], b[1], 1e-6F);
  EXPECT_NEAR(a[1], b[0], 1e-6F);
  EXPECT_NEAR(a[2], b[2], 1e-6F);
  EXPECT_EQ(bake("turned", {"--tangents", "mikktspace"}, &report).pixels, mikk.pixels);
  EXPECT_NE(report.find("\"tangents\": \"mikktspace\""), std::string::npos);

  // A renderer with the same tangents shows HIGH's normals, one with others does not.
  bake("turned", {});
  const auto angle = [&](const std::string& tangents) {
    const ProcessResult result =
        call_kiln({"render", folder / "turned.ply", "--reference", folder / "high.obj", "--normal",
                   folder / "maps" / "turned_normal.exr", "--tangents", tangents, "--size", "64",
                   "--out", folder / "look.png", "--frames", "1", "--json", folder / "look.json"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    std::ifstream file(folder / "look.json");
    const nlohmann::json json = nlohmann::json::parse(file);
    return json["rendered_normals"]["around"]["with_map"]["mean_angle_degrees"].get<double>();
  };
  EXPECT_LT(angle("file"), 0.01);
  EXPECT_GT(angle("mikktspace"), 0.3);
}

TEST(TangentsCommand, WhatCannotServeIsRefused) {
  const fs::path folder = test::scratch_folder();
  save_square(folder / "plain.ply", false);
  save_square(folder / "turned.ply", true);
  const auto refused = [&](const std::string& low, int code, const std::string& word,
                           const std::vector<std::string>& flags) {
    std::vector<std::string> line = {"bake",  folder / "turned.ply", folder / (low + ".ply"),
                                     "--out", folder / "maps",       "--tangents",
                                     "file"};
    line.insert(line.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(line);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    EXPECT_NE(result.errors.find(word), std::string::npos) << result.errors;
  };
  refused("plain", 3, "has none", {});
  refused("turned", 2, "--space tangent", {"--space", "object"});
  refused("turned", 2, "--split-at-seams", {"--split-at-seams"});
}

}  // namespace
}  // namespace kiln
