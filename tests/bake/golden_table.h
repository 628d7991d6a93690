// The table of golden_test: which bytes every configuration gave.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kiln/bake.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "support/environment.h"

namespace kiln::test {

/// A configuration: what it changes of the options that its test starts from.
struct GoldenRow {
  const char* name;
  void (*set)(BakeOptions& options);
};

inline BakeOptions sized(std::uint32_t width, std::uint32_t height) {
  BakeOptions options;
  options.width = width;
  options.height = height;
  return options;
}

inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

inline void by_uv(BakeOptions& options) {
  options.match.method = MatchMethod::uv;
  options.match.uv.max_distance = kNoBound;
}

/// True if KILN_GOLDEN_WRITE asks for the table to be written anew.
bool writes_golden_table();

/// One test's part of the table: the rows whose names start with `group` and a slash.
class GoldenGroup {
 public:
  explicit GoldenGroup(std::string group);

  /// Expect the hash to be the table's, or note it for a new table. Names are without the group.
  /// A bake's row is of its maps, their mip-maps and the coverage; `NAME:match` and `NAME:clusters` are
  /// rows of their own, where it has them.
  void check(const std::string& name, const BakeResult& result);
  void check(const std::string& name, const Match& match);
  void check(const std::string& name, const Image& image);
  void check(const std::string& name, const Mesh& mesh);

  /// Bakes and checks each row, its name followed by `suffix`.
  void check(const Source& source, const Mesh& low, const BakeOptions& start,
             std::span<const GoldenRow> rows, const std::string& suffix = "");

  /// Expects that the table has no other rows, or writes the noted ones into it.
  void finish();

 private:
  using Rows = std::vector<std::pair<std::string, std::uint64_t>>;

  void check_hash(const std::string& name, std::uint64_t hash);

  std::string group_;
  Rows wanted_;  ///< Of this group
  Rows found_;
};

/// Names in the table that belong to no group.
std::vector<std::string> rows_without_group();

}  // namespace kiln::test

/// Skips visibly without a device that promises the table's bytes.
#define KILN_REQUIRE_GOLDEN_DEVICE()                                                    \
  KILN_REQUIRE_DEVICE();                                                                \
  do {                                                                                  \
    if (!kiln::test::device()->info().has_correct_division) {                           \
      GTEST_SKIP() << "the device does not round divisions and square roots correctly"; \
    }                                                                                   \
  } while (false)

/// Ends a test; skips visibly where the table was written instead of compared with.
#define KILN_FINISH_GROUP(group)                                                    \
  do {                                                                              \
    (group).finish();                                                               \
    if (kiln::test::writes_golden_table()) GTEST_SKIP() << "the table was written"; \
  } while (false)
