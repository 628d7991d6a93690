#include "bake/golden_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string_view>

namespace kiln::test {
namespace {

/// In the table's order.
constexpr std::array<std::string_view, 16> kGroups = {
    "match",   "visibility", "fallback", "image",  "mesh",   "session", "views",   "plan",
    "lowmesh", "height",     "volume",   "assess", "render", "maps",    "byviews", "cages"};

/// FNV-1a with 64 bits (Fowler, Noll, Vo), over values' bytes in the machine's order.
class Hash {
 public:
  template <typename T>
  Hash& add(const std::vector<T>& values) {
    for (const std::byte byte : std::as_bytes(std::span(values))) {
      value_ = (value_ ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001B3u;
    }
    return *this;
  }
  Hash& add(const Image& image) {
    add(std::vector<std::uint32_t>{image.width, image.height, image.channels});
    return add(image.pixels);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325u;
};

using Rows = std::vector<std::pair<std::string, std::uint64_t>>;

std::filesystem::path table_path() { return test_data("golden.txt"); }

std::string group_of(std::string_view name) { return std::string(name.substr(0, name.find('/'))); }

Rows load_table() {
  Rows rows;
  std::ifstream file(table_path());
  std::string name, hash;
  while (file >> name >> hash) rows.emplace_back(name, std::stoull(hash, nullptr, 16));
  return rows;
}

std::string in_digits(std::uint64_t hash) {
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016" PRIx64, hash);
  return digits.data();
}

void save_table(const Rows& rows) {
  std::ofstream file(table_path(), std::ios::trunc);
  for (const std::string_view group : kGroups) {
    for (const auto& [name, hash] : rows) {
      if (group_of(name) != group) continue;
      file << name << "  " << in_digits(hash) << '\n';
    }
  }
  EXPECT_TRUE(file.flush()) << "cannot write " << table_path();
}

constexpr const char* kRemedy =
    "\nIf the change is meant, run golden_test with KILN_GOLDEN_WRITE=1, which writes the table "
    "anew, "
    "and\nsay in CHANGELOG.md why. If not, find what caused it.";

}  // namespace

bool writes_golden_table() {
  const char* value = std::getenv("KILN_GOLDEN_WRITE");
  return value != nullptr && std::string_view(value) == "1";
}

GoldenGroup::GoldenGroup(std::string group) : group_(std::move(group)) {
  EXPECT_NE(std::ranges::find(kGroups, group_), kGroups.end()) << group_;
  for (auto& row : load_table()) {
    if (group_of(row.first) == group_) wanted_.push_back(std::move(row));
  }
}

void GoldenGroup::check(const std::string& name, const BakeResult& result) {
  Hash hash;
  for (const BakedMap& map : result.maps) {
    hash.add(map.image);
    for (const Image& level : map.mips) hash.add(level);
  }
  check_hash(name, hash.add(result.coverage).value());
  if (result.match) check(name + ":match", *result.match);
  if (result.clusters) {
    check_hash(name + ":clusters",
               Hash().add(result.clusters->number).add(result.clusters->directions).value());
  }
}

void GoldenGroup::check(const std::string& name, const Match& match) {
  check_hash(name, Hash()
                       .add(match.triangle)
                       .add(match.u)
                       .add(match.v)
                       .add(match.distance)
                       .add(match.status)
                       .value());
}

void GoldenGroup::check(const std::string& name, const Image& image) {
  check_hash(name, Hash().add(image).value());
}

void GoldenGroup::check(const std::string& name, const Mesh& mesh) {
  check_hash(name, Hash()
                       .add(std::vector<double>(mesh.origin.begin(), mesh.origin.end()))
                       .add(mesh.positions)
                       .add(mesh.triangles)
                       .add(mesh.uvs)
                       .add(mesh.uv_triangles)
                       .add(mesh.normals)
                       .add(mesh.normal_triangles)
                       .value());
}

void GoldenGroup::check(const Source& source, const Mesh& low, const BakeOptions& start,
                        std::span<const GoldenRow> rows, const std::string& suffix) {
  for (const GoldenRow& row : rows) {
    BakeOptions options = start;
    row.set(options);
    check(row.name + suffix, bake(source, low, options));
  }
}

void GoldenGroup::check_hash(const std::string& name, std::uint64_t hash) {
  const std::string full = group_ + '/' + name;
  EXPECT_EQ(std::ranges::count(found_, full, &Rows::value_type::first), 0)
      << full << ": two configurations of one name";
  found_.emplace_back(full, hash);
  if (writes_golden_table()) return;
  const auto row = std::ranges::find(wanted_, full, &Rows::value_type::first);
  if (row == wanted_.end()) {
    ADD_FAILURE() << full << ": tests/data/golden.txt has no such row." << kRemedy;
  } else if (row->second != hash) {
    ADD_FAILURE() << full << ": the result changed. Its hash is " << in_digits(hash) << "; "
                  << in_digits(row->second) << " in tests/data/golden.txt." << kRemedy;
  }
}

void GoldenGroup::finish() {
  if (!writes_golden_table()) {
    for (const auto& [name, hash] : wanted_) {
      EXPECT_EQ(std::ranges::count(found_, name, &Rows::value_type::first), 1)
          << name << ": a row of tests/data/golden.txt that no configuration makes." << kRemedy;
    }
    return;
  }
  Rows rows = load_table();
  std::erase_if(rows, [&](const auto& row) { return group_of(row.first) == group_; });
  rows.insert(rows.end(), found_.begin(), found_.end());
  save_table(rows);
}

std::vector<std::string> rows_without_group() {
  std::vector<std::string> names;
  for (const auto& [name, hash] : load_table()) {
    if (std::ranges::find(kGroups, group_of(name)) == kGroups.end()) names.push_back(name);
  }
  return names;
}

}  // namespace kiln::test
