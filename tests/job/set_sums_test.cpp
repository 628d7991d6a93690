// Reports of several texture sets: their totals do not depend on the sets' order, and are those of the parts.
#include <algorithm>
#include <cmath>
#include <set>

#include "job/job_scene.h"

namespace kiln::test {
namespace {

using nlohmann::json;

/// A texture set: parts of LOW with one material, and the part of HIGH above each.
struct SetScene {
  std::vector<Mesh> low, high;
};

/// Sets that differ in all that a report counts: one is missed by half, one has copies of another surface, one has a
/// sheet above it, and one is plain and larger.
std::vector<SetScene> scenes() {
  Mesh leaning = square_at(4, 0.02F, "h"), falling = square_at(6, 0.02F, "h");
  for (Vec3& p : leaning.positions) p.z += 0.3F * (p.x - 4);
  for (Vec3& p : falling.positions) p.z -= 0.3F * (p.x - 6);
  for (Mesh* const mesh : {&leaning, &falling}) {
    mesh->normals.clear();
    mesh->normal_triangles.clear();
  }
  return {
      {{square_at(0, 0, "half")}, {square_at(-0.25F, 0.03F, "h", 0.5F)}},
      {{square_at(4, 0, "twice"), square_at(6, 0, "twice")}, {leaning, falling}},
      {{square_at(10, 0, "below")}, {square_at(10, 0.01F, "h"), square_at(10, 0.15F, "h", 0.5F)}},
      {{square_at(20, 0, "wide", 3)}, {square_at(20, 0.05F, "h", 3)}}};
}

json report_of(const std::vector<SetScene>& sets) {
  std::vector<Mesh> low, high;
  for (const SetScene& set : sets) {
    low.insert(low.end(), set.low.begin(), set.low.end());
    high.insert(high.end(), set.high.begin(), set.high.end());
  }
  Job job;
  job.high = {JobInput(join_meshes(high), "high")};
  job.low = JobLow(join_meshes(low));
  job.out = "maps";
  job.sets = SetsBy::material;
  job.bake.width = job.bake.height = 32;
  job.bake.match.max_distance = Length::absolute(0.5);
  job.bake.maps = {MapKind::normal, MapKind{"height"}, MapKind{"curvature"}};
  return json::parse(run_in_memory(job).report);
}

/// The numbers of a report's totals by their paths, without times, memory, and what is listed a set.
void collect_totals(const json& value, const std::string& path, std::map<std::string, double>& to) {
  static const std::set<std::string> kLeftOut = {
      "/seconds",         "/memory", "/sets",   "/outputs", "/warnings",
      "/compile_seconds", "/device", "/source", "/options", "/clean/seconds"};
  if (kLeftOut.contains(path)) return;
  if (value.is_number() || value.is_boolean()) {
    to[path] = value.is_boolean() ? value.get<bool>() : value.get<double>();
  } else if (value.is_structured()) {
    for (const auto& [key, item] : value.items()) collect_totals(item, path + "/" + key, to);
  }
}

std::map<std::string, double> totals_of(const json& report) {
  std::map<std::string, double> totals;
  collect_totals(report, "", totals);
  return totals;
}

std::map<std::string, int> warning_codes(const json& report) {
  std::map<std::string, int> codes;
  for (const json& warning : report["warnings"]) ++codes[warning["code"]];
  return codes;
}

TEST(JobSets, TotalsDoNotDependOnTheOrderOfSets) {
  KILN_REQUIRE_DEVICE();
  std::vector<SetScene> sets = scenes();
  const json first = report_of(sets);
  ASSERT_EQ(first["sets"].size(), sets.size());
  const std::map<std::string, double> wanted = totals_of(first);
  EXPECT_GT(wanted.at("/texels/missed"), 0);
  EXPECT_GT(wanted.at("/uv_copies_differ"), 0.5);
  EXPECT_GT(wanted.at("/recall/lost"), 0);
  for (int turn = 1; turn < 4; ++turn) {
    std::rotate(sets.begin(), sets.begin() + 1, sets.end());
    const json report = report_of(sets);
    const std::map<std::string, double> found = totals_of(report);
    ASSERT_EQ(found.size(), wanted.size());
    for (const auto& [path, value] : wanted) {
      const auto same = found.find(path);
      ASSERT_NE(same, found.end()) << path;
      // Losses are measured at places that are spread by the triangles' order.
      const double tolerance = path.starts_with("/recall/largest/where") ? 0.3
                               : path.starts_with("/recall")             ? 0.01
                                                                         : 1e-4;
      EXPECT_NEAR(same->second, value, tolerance * std::max(1.0, std::abs(value)))
          << path << " " << turn;
    }
    EXPECT_EQ(warning_codes(report), warning_codes(first)) << turn;
  }
}

/// Counts are sums over the sets, and maxima are those of one of them.
TEST(JobSets, TotalsAreThoseOfTheParts) {
  KILN_REQUIRE_DEVICE();
  const json report = report_of(scenes());
  for (const auto& [key, total] : report["texels"].items()) {
    if (!total.is_number_integer()) continue;
    std::int64_t sum = 0;
    for (const json& set : report["sets"]) sum += set["texels"].value(key, std::int64_t{0});
    EXPECT_EQ(total.get<std::int64_t>(), sum) << key;
  }
  double most_differing = 0;
  std::int64_t copies = 0;
  for (const json& set : report["sets"]) {
    most_differing = std::max(most_differing, set.value("uv_copies_differ", 0.0));
    copies += set.value("uv_copies", std::int64_t{0});
  }
  EXPECT_EQ(report["uv_copies_differ"].get<double>(), most_differing);
  EXPECT_EQ(report["uv_copies"].get<std::int64_t>(), copies);
}

}  // namespace
}  // namespace kiln::test
