// Keys of reports: each holds the member of its name.
#include <cmath>

#include "job/describe.h"
#include "job/job_scene.h"
#include "kiln/bake.h"
#include "kiln/clean.h"
#include "kiln/measure.h"

namespace kiln::test {
namespace {

using nlohmann::json;

json parsed(const Json& value) { return json::parse(value.dump()); }

TEST(ReportKeys, HoldTheMembersOfTheirNames) {
  NormalError error;
  error.mean_degrees = 1;
  error.rms_degrees = 2;
  error.median_degrees = 3;
  error.p95_degrees = 4;
  error.p99_degrees = 5;
  error.max_degrees = 6;
  error.mean_8bit = 7;
  error.pixels = 8;
  error.one_sided = 9;
  const json angles = parsed(describe(error));
  EXPECT_EQ(angles["mean_angle_degrees"], 1);
  EXPECT_EQ(angles["rms_angle_degrees"], 2);
  EXPECT_EQ(angles["median_angle_degrees"], 3);
  EXPECT_EQ(angles["p95_angle_degrees"], 4);
  EXPECT_EQ(angles["p99_angle_degrees"], 5);
  EXPECT_EQ(angles["max_angle_degrees"], 6);
  EXPECT_EQ(angles["mean_8bit_difference"], 7);
  EXPECT_EQ(angles["pixels"], 8);
  EXPECT_EQ(angles["one_sided_pixels"], 9);

  const json cage = parsed(describe(CageReport{CageKind::shells, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(cage["outward"], json({{"least", 1.0}, {"median", 2.0}, {"most", 3.0}}));
  EXPECT_EQ(cage["inward"], json({{"least", 4.0}, {"median", 5.0}, {"most", 6.0}}));

  EdgeReport edges;
  edges.edges = 7;
  edges.found = 6;
  edges.min_width = 1;
  edges.median_width = 2;
  edges.max_width = 3;
  const json width = parsed(describe(edges));
  EXPECT_EQ(width["edges"], 7);
  EXPECT_EQ(width["found"], 6);
  EXPECT_EQ(width["width"], json({{"least", 1.0}, {"median", 2.0}, {"most", 3.0}}));

  HighCoverageReport recall;
  recall.places = 4;
  recall.lost = 0.5;
  recall.by_copies = 0.25;
  recall.largest = 0.125;
  recall.where = {1, 2, 3};
  const json lost = parsed(describe(recall));
  EXPECT_EQ(lost["places"], 4);
  EXPECT_EQ(lost["lost"], 0.5);
  EXPECT_EQ(lost["by_copies"], 0.25);
  EXPECT_EQ(lost["largest"]["lost"], 0.125);
  EXPECT_EQ(lost["largest"]["where"], json({1.0, 2.0, 3.0}));

  BakeReport report;
  report.texels = 1;
  report.samples = 2;
  report.outward = 3;
  report.inward = 4;
  report.cage = 5;
  report.viewed = 6;
  report.closest = 7;
  report.by_uv = 8;
  report.missed = 9;
  report.gutter_texels = 10;
  report.passed_over = 11;
  EXPECT_EQ(parsed(describe_texels(report)), json({{"covered", 1},
                                                   {"samples", 2},
                                                   {"outward", 3},
                                                   {"inward", 4},
                                                   {"cage", 5},
                                                   {"views", 6},
                                                   {"closest", 7},
                                                   {"uv", 8},
                                                   {"missed", 9},
                                                   {"gutter", 10},
                                                   {"passed_over", 11}}));

  MapError map;
  map.kind = MapKind::normal;
  map.rms = 1;
  map.mean = 2;
  map.p95 = 3;
  map.max = 4;
  map.texels = 5;
  const json errors = parsed(describe(std::vector<MapError>{map}));
  EXPECT_EQ(errors[0]["rms"], 1);
  EXPECT_EQ(errors[0]["mean"], 2);
  EXPECT_EQ(errors[0]["p95"], 3);
  EXPECT_EQ(errors[0]["max"], 4);
  EXPECT_EQ(errors[0]["texels"], 5);
}

TEST(ReportKeys, OfSearchesHoldTheMembersOfTheirNames) {
  VisibilityReport visibility;
  visibility.directions = 1;
  visibility.by_rays = true;
  visibility.width = 2;
  visibility.places = 4;
  visibility.unseen = 5;
  visibility.without = 6;
  visibility.mean_deviation = 7;
  visibility.clustered = 8;
  visibility.seconds = 9;
  const json seen = parsed(describe(visibility));
  EXPECT_EQ(seen["directions"], 1);
  EXPECT_EQ(seen["test"], "rays");
  EXPECT_EQ(seen["width"], 2);
  EXPECT_EQ(seen["places"], 4);
  EXPECT_EQ(seen["unseen"], 5);
  EXPECT_EQ(seen["without"], 6);
  EXPECT_EQ(seen["mean_deviation"], 7);
  EXPECT_EQ(seen["clustered"], 8);
  EXPECT_EQ(seen["seconds"], 9);

  ViewReport views;
  views.directions = {{1, 0, 0}, {0, 1, 0}};
  views.size = 3;
  views.pixel = 4;
  views.undersampled = 0.5;
  views.coverage = {0.25, 0.75};
  const json drawn = parsed(describe(views));
  EXPECT_EQ(drawn["count"], 2);
  EXPECT_EQ(drawn["size"], 3);
  EXPECT_EQ(drawn["pixel"], 4);
  EXPECT_EQ(drawn["undersampled"], 0.5);
  EXPECT_EQ(drawn["height_field"], false);
  EXPECT_EQ(drawn["coverage_after_each"], json({0.25, 0.75}));
  EXPECT_EQ(drawn["directions"][1], json({0.0, 1.0, 0.0}));

  TransitionReport transitions;
  transitions.sides = 1;
  transitions.mean_degrees = 2;
  transitions.elsewhere_degrees = 3;
  const json switches = parsed(describe(transitions));
  EXPECT_EQ(switches["sides"], 1);
  EXPECT_EQ(switches["mean_degrees"], 2);
  EXPECT_EQ(switches["elsewhere_degrees"], 3);

  UvReport uv;
  uv.covered = 8;
  uv.overlapping = 2;
  uv.outside = 3;
  uv.without_area = 4;
  uv.mean_distance = 5;
  uv.p95_distance = 6;
  uv.overlap.lower = 10;
  uv.overlap.upper = 11;
  uv.overlap.column = 12;
  uv.overlap.row = 13;
  const json layouts = parsed(describe(uv));
  EXPECT_EQ(layouts["covered"], 8);
  EXPECT_EQ(layouts["overlapping"], 2);
  EXPECT_EQ(layouts["overlap_share"], 0.25);
  EXPECT_EQ(layouts["overlap"], json({{"triangles", {10, 11}}, {"column", 12}, {"row", 13}}));
  EXPECT_EQ(layouts["outside"], 3);
  EXPECT_EQ(layouts["without_area"], 4);
  EXPECT_EQ(layouts["distance"], json({{"mean", 5.0}, {"p95", 6.0}}));
}

TEST(ReportKeys, OfRepairsHoldTheCountsOfTheirNames) {
  CleanReport report;
  const std::vector<std::pair<const char*, Cleaned CleanReport::*>> counts = {
      {"welded_vertices", &CleanReport::welded},
      {"degenerate_triangles", &CleanReport::degenerate},
      {"duplicate_triangles", &CleanReport::duplicates},
      {"split_at_junctions", &CleanReport::junctions},
      {"dropped_fins", &CleanReport::fins},
      {"turned_triangles", &CleanReport::turned},
      {"filled_holes", &CleanReport::holes},
      {"filled_large_holes", &CleanReport::large_holes},
      {"open_rims", &CleanReport::open_rims},
      {"open_edges", &CleanReport::open_edges},
      {"dropped_floaters", &CleanReport::floaters},
      {"dropped_inner", &CleanReport::inner},
  };
  for (std::size_t i = 0; i < counts.size(); ++i) (report.*counts[i].second).count = i + 1;
  report.flat_holes = 100;
  const json cleaned = parsed(describe(report));
  for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_EQ(cleaned[counts[i].first], i + 1);
  EXPECT_EQ(cleaned["flat_holes"], 100);
}

}  // namespace
}  // namespace kiln::test
