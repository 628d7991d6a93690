// Mesh files written by hand, and ways to load them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/mesh_check.h"

namespace kiln::test::mesh_files {

struct Loaded {
  Mesh mesh;
  std::vector<Warning> warnings;

  std::uint64_t count(const std::string& code) const {
    std::uint64_t sum = 0;
    for (const Warning& warning : warnings) {
      if (warning.code == code) sum += warning.count;
    }
    return sum;
  }
  std::array<double, 3> world(std::size_t i) const {
    const Vec3& p = mesh.positions[i];
    return {mesh.origin[0] + double{p.x}, mesh.origin[1] + double{p.y},
            mesh.origin[2] + double{p.z}};
  }
};

inline std::filesystem::path write_file(const std::string& name, const std::string& content) {
  const std::filesystem::path path = scratch_folder() / name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

inline Loaded load(const std::filesystem::path& path) {
  Loaded result;
  result.mesh = load_mesh(path, &result.warnings);
  EXPECT_EQ(broken_promise(result.mesh), "") << path;
  return result;
}

inline Loaded load_text(const std::string& name, const std::string& content) {
  return load(write_file(name, content));
}

/// Loading must fail with an Error(input) whose message holds the path and each of `words`.
inline void expect_bad(const std::filesystem::path& path, const std::vector<std::string>& words) {
  try {
    load_mesh(path);
    ADD_FAILURE() << path << " was read";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::input) << message;
    EXPECT_NE(message.find(path.string()), std::string::npos) << message;
    for (const std::string& word : words) {
      EXPECT_NE(message.find(word), std::string::npos) << "no \"" << word << "\" in: " << message;
    }
  }
}

inline void expect_bad_text(const std::string& name, const std::string& content,
                            const std::vector<std::string>& words) {
  expect_bad(write_file(name, content), words);
}

class PlyText {
 public:
  PlyText(std::string encoding, const std::string& header) : encoding_(std::move(encoding)) {
    text_ = "ply\nformat " + encoding_ + " 1.0\n" + header + "end_header\n";
  }
  template <typename T>
  PlyText& put(T value) {
    if (encoding_ == "ascii") {
      char digits[40];
      std::snprintf(digits, sizeof digits, "%.17g ", static_cast<double>(value));
      text_ += digits;
    } else {
      char bytes[sizeof(T)];
      std::memcpy(bytes, &value, sizeof(T));
      const bool big = encoding_ == "binary_big_endian";
      if (big != (std::endian::native == std::endian::big)) std::reverse(bytes, bytes + sizeof(T));
      text_.append(bytes, sizeof(T));
    }
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string encoding_, text_;
};

inline const std::vector<std::array<double, 3>> pyramid{
    {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
inline const std::vector<std::vector<std::uint32_t>> pyramid_faces{
    {0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

template <typename Real, typename Count, typename Index>
std::string pyramid_ply(const std::string& encoding, const std::string& real,
                        const std::string& count, const std::string& index) {
  PlyText ply(encoding, "comment made by a test\nelement vertex 5\nproperty " + real +
                            " x\nproperty " + real + " y\nproperty " + real +
                            " z\nelement face 5\nproperty list " + count + " " + index +
                            " vertex_indices\n");
  for (const auto& p : pyramid) {
    for (const double value : p) ply.put(static_cast<Real>(value));
  }
  for (const auto& face : pyramid_faces) {
    ply.put(static_cast<Count>(face.size()));
    for (const std::uint32_t vertex : face) ply.put(static_cast<Index>(vertex));
  }
  return ply.text();
}

inline const std::string hard_edge =
    "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5 0\nvn 0 0 2\nvn 0 -1 0\n"
    "o thing\ng floor\ns off\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\ng wall\nf -5/1/-1 -1/5/-1 "
    "-4/2/-1\n";

inline std::string binary_stl(const std::vector<std::array<Vec3, 3>>& triangles,
                              const char* start = "binary") {
  std::string text(80, ' ');
  text.replace(0, std::strlen(start), start);
  const auto put = [&text](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(static_cast<std::uint32_t>(triangles.size()));
  for (const auto& triangle : triangles) {
    put(Vec3{});
    for (const Vec3& corner : triangle) put(corner);
    put(std::uint16_t{0});
  }
  return text;
}

}  // namespace kiln::test::mesh_files
