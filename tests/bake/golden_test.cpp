// Golden hashes: no map of these configurations changes by a byte unless it is meant to.
//
// Each configuration's result is hashed and compared with its row of tests/data/golden.txt. The rows pin
// down what a device with correctly rounded division and square root gives.
//
// A row that fails was changed by your change, or is not deterministic. Where the change is meant:
//
//   KILN_GOLDEN_WRITE=1 build/dev/tests/golden_test
//
// writes the table anew (the program itself, not ctest, which runs its cases side by side). With a
// --gtest_filter only the rows of the cases that run are replaced. Say in CHANGELOG.md why.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "bake/golden_scene.h"
#include "bake/golden_table.h"
#include "kiln/bake.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::GoldenGroup;
using test::sized;

using test::by_uv;
using test::golden_high;
using test::golden_low;
using Row = test::GoldenRow;

const Mesh& cage() {
  static const Mesh mesh = test::golden_cage();
  return mesh;
}

TEST(Golden, TableHasNoRowsOfUnknownGroups) {
  EXPECT_EQ(test::rows_without_group(), std::vector<std::string>());
}

// ---- how points are found -----------------------------------------------------------------------

const Row kTraversed[] = {
    {"ray", [](BakeOptions&) {}},
    {"ray-far", [](BakeOptions& o) { o.match.max_distance = Length::share(0.12); }},
    {"ray-two-sided", [](BakeOptions& o) { o.match.two_sided = true; }},
    {"ray-cage", [](BakeOptions& o) { o.match.cage = Length::share(0.03); }},
    {"ray-cage-mesh", [](BakeOptions& o) { o.match.cage_mesh = &cage(); }},
    {"closest", [](BakeOptions& o) { o.match.method = MatchMethod::closest; }},
    {"visibility-rays",
     [](BakeOptions& o) {
       o.match.method = MatchMethod::visibility;
       o.match.visibility.test = VisibilityTest::rays;
       o.match.visibility.directions = 100;
     }},
};

const Row kRays[] = {
    {"ray-absolute", [](BakeOptions& o) { o.match.max_distance = Length::absolute(0.03); }},
    {"ray-cage-reach",
     [](BakeOptions& o) {
       o.match.cage = Length::absolute(0.2);
       o.match.max_distance = Length::absolute(0.25);
     }},
    {"ray-cage-two-sided",
     [](BakeOptions& o) {
       o.match.cage = Length::share(0.05);
       o.match.two_sided = true;
     }},
    {"ray-cage-mesh-reach",
     [](BakeOptions& o) {
       o.match.cage_mesh = &cage();
       o.match.max_distance = Length::share(0.03);
     }},
    {"closest-far",
     [](BakeOptions& o) {
       o.match.method = MatchMethod::closest;
       o.match.max_distance = Length::share(0.15);
     }},
    {"closest-two-sided",
     [](BakeOptions& o) {
       o.match.method = MatchMethod::closest;
       o.match.two_sided = true;
     }},
    {"uv", by_uv},
};

const Row kViews[] = {
    {"views", [](BakeOptions&) {}},
    {"views-1", [](BakeOptions& o) { o.match.views.count = 1; }},
    {"views-40", [](BakeOptions& o) { o.match.views.count = 40; }},
    {"views-directions",
     [](BakeOptions& o) {
       o.match.views.count = 0;
       o.match.views.directions = {{0, 0, 2}, {1, 0.5F, 0}, {-1, 3, -2}};
     }},
    {"views-directions-beside",
     [](BakeOptions& o) {
       o.match.views.count = 6;
       o.match.views.directions = {{0, 1, 0.1F}};
     }},
    {"views-automatic", [](BakeOptions& o) { o.match.views.automatic = true; }},
    {"views-automatic-8",
     [](BakeOptions& o) {
       o.match.views.automatic = true;
       o.match.views.count = 8;
     }},
    {"views-depth", [](BakeOptions& o) { o.match.views.criterion = ViewCriterion::depth; }},
    {"views-distance", [](BakeOptions& o) { o.match.views.criterion = ViewCriterion::distance; }},
    {"views-unrefined", [](BakeOptions& o) { o.match.views.refine = false; }},
    {"views-depth-unrefined",
     [](BakeOptions& o) {
       o.match.views.criterion = ViewCriterion::depth;
       o.match.views.refine = false;
     }},
    {"views-size-64", [](BakeOptions& o) { o.match.views.size = 64; }},
    {"views-size-900", [](BakeOptions& o) { o.match.views.size = 900; }},
    {"views-two-sided", [](BakeOptions& o) { o.match.two_sided = true; }},
    {"views-far", [](BakeOptions& o) { o.match.max_distance = Length::share(0.1); }},
};

TEST(Golden, Matches) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("match");
  const Mesh low = golden_low();
  const Source source(*test::device(), golden_high());
  const Source vectors(*test::device(), golden_high(), RayTraversal::cpu);
  const Source scalars(*test::device(), golden_high(), RayTraversal::gpu);
  BakeOptions options = sized(144, 96);
  options.report.keep_match = true;
  group.check(vectors, low, options, kTraversed, "-vectors");
  group.check(scalars, low, options, kTraversed, "-scalars");
  group.check(source, low, options, kRays);
  options.match.method = MatchMethod::views;
  group.check(source, low, options, kViews);

  // The scene is worth it: some samples are out of reach.
  const BakeReport report = bake(source, low, sized(144, 96)).report;
  EXPECT_GT(report.missed, report.samples / 50);
  EXPECT_LT(report.missed, report.samples / 2);
  KILN_FINISH_GROUP(group);
}

// ---- directions of visibility -------------------------------------------------------------------

const Row kVisibility[] = {
    {"texel", [](BakeOptions&) {}},
    {"face", [](BakeOptions& o) { o.match.visibility.at = VisibilityAt::face; }},
    {"vertex", [](BakeOptions& o) { o.match.visibility.at = VisibilityAt::vertex; }},
    {"texel-rays", [](BakeOptions& o) { o.match.visibility.test = VisibilityTest::rays; }},
    {"face-rays",
     [](BakeOptions& o) {
       o.match.visibility.at = VisibilityAt::face;
       o.match.visibility.test = VisibilityTest::rays;
     }},
    {"vertex-views",
     [](BakeOptions& o) {
       o.match.visibility.at = VisibilityAt::vertex;
       o.match.visibility.test = VisibilityTest::views;
     }},
    {"directions-77", [](BakeOptions& o) { o.match.visibility.directions = 77; }},
    {"directions-512", [](BakeOptions& o) { o.match.visibility.directions = 512; }},
    {"view-size-50", [](BakeOptions& o) { o.match.visibility.view_size = 50; }},
    {"smoothing-0", [](BakeOptions& o) { o.match.visibility.smoothing = 0; }},
    {"smoothing-25", [](BakeOptions& o) { o.match.visibility.smoothing = 25; }},
    {"horizon", [](BakeOptions& o) { o.match.visibility.likelihood = ViewLikelihood::horizon; }},
    {"up", [](BakeOptions& o) { o.match.visibility.likelihood = ViewLikelihood::up; }},
    {"list",
     [](BakeOptions& o) {
       o.match.visibility.likelihood = ViewLikelihood::list;
       o.match.visibility.likelihoods = {{{1, 0, 0}, 1}, {{0, 2, 1}, 3}, {{-1, -1, 0}, 0.5}};
     }},
    {"two-sided", [](BakeOptions& o) { o.match.two_sided = true; }},
    {"far", [](BakeOptions& o) { o.match.max_distance = Length::share(0.1); }},
    {"samples-2", [](BakeOptions& o) { o.samples = 2; }},
    {"hybrid", [](BakeOptions& o) { o.match.method = MatchMethod::hybrid; }},
    {"hybrid-face",
     [](BakeOptions& o) {
       o.match.method = MatchMethod::hybrid;
       o.match.visibility.at = VisibilityAt::face;
     }},
    {"hybrid-vertex",
     [](BakeOptions& o) {
       o.match.method = MatchMethod::hybrid;
       o.match.visibility.at = VisibilityAt::vertex;
     }},
};

const Row kClusters[] = {
    {"clusters-2", [](BakeOptions& o) { o.match.visibility.clusters = 2; }},
    {"clusters-3", [](BakeOptions& o) { o.match.visibility.clusters = 3; }},
    {"clusters-4-rays",
     [](BakeOptions& o) {
       o.match.visibility.clusters = 4;
       o.match.visibility.test = VisibilityTest::rays;
     }},
    {"clusters-2-maps",
     [](BakeOptions& o) {
       o.match.visibility.clusters = 2;
       o.match.visibility.cluster_deviation = 0.7;
       o.maps = {MapKind::normal, MapKind::mask};
       o.encoding.mips = true;
       o.samples = 2;
       o.match.fallback = {MatchMethod::closest};
     }},
};

TEST(Golden, Visibility) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("visibility");
  const Mesh low = golden_low();
  const Source source(*test::device(), golden_high());
  BakeOptions options = sized(128, 80);
  options.match.method = MatchMethod::visibility;
  options.match.visibility.directions = 128;
  options.match.visibility.view_size = 128;
  group.check(source, low, options, kClusters);
  options.match.visibility.clusters = 2;
  EXPECT_GT(bake(source, low, options).report.visibility->clustered, 100U);
  options.match.visibility.clusters = 1;
  options.report.keep_match = true;
  group.check(source, low, options, kVisibility);
  KILN_FINISH_GROUP(group);
}

// ---- what decides the rest ----------------------------------------------------------------------

const Row kUndecided[] = {
    {"ray", [](BakeOptions&) {}},
    {"cage", [](BakeOptions& o) { o.match.cage = Length::share(0.012); }},
    {"closest", [](BakeOptions& o) { o.match.method = MatchMethod::closest; }},
    {"views",
     [](BakeOptions& o) {
       o.match.method = MatchMethod::views;
       o.match.views.count = 5;
       o.match.views.criterion = ViewCriterion::depth;
       o.match.views.refine = false;
     }},
    {"visibility", [](BakeOptions& o) { o.match.method = MatchMethod::visibility; }},
    {"hybrid", [](BakeOptions& o) { o.match.method = MatchMethod::hybrid; }},
    {"uv",
     [](BakeOptions& o) {
       by_uv(o);
       o.match.max_distance = Length::share(0.05);
     }},
};

const Row kFallbacks[] = {
    {"low", [](BakeOptions&) {}},
    {"ray", [](BakeOptions& o) { o.match.fallback = {MatchMethod::ray}; }},
    {"closest", [](BakeOptions& o) { o.match.fallback = {MatchMethod::closest}; }},
    {"views", [](BakeOptions& o) { o.match.fallback = {MatchMethod::views}; }},
};

/// True if the fallback is another way than the method's own.
bool is_another_way(const BakeOptions& options) {
  return options.match.fallback.empty() || options.match.fallback.front() != options.match.method;
}

TEST(Golden, Fallbacks) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("fallback");
  const Mesh low = golden_low();
  const Source source(*test::device(), golden_high());
  for (const Row& method : kUndecided) {
    std::uint64_t undecided = 0;
    for (const Row& fallback : kFallbacks) {
      BakeOptions options = sized(128, 96);
      options.match.max_distance = Length::share(0.011);
      options.match.visibility.directions = 64;
      options.match.visibility.view_size = 100;
      options.report.keep_match = true;
      method.set(options);
      fallback.set(options);
      if (!is_another_way(options)) continue;
      const std::string name = std::string(method.name) + "-" + fallback.name;
      const BakeResult result = bake(source, low, options);
      group.check(name, result);
      if (options.match.fallback.empty()) {
        undecided = result.report.missed;
        continue;
      }
      // If no face is near, neither rays nor views find one.
      if (options.match.method != MatchMethod::closest) {
        EXPECT_LT(result.report.missed, undecided) << name << ": the fallback decided nothing";
      }
      options.report.keep_match = false;
      options.match.fallback_blend = 6;
      options.samples = 2;
      group.check(name + "-blend", bake(source, low, options));
    }
  }
  KILN_FINISH_GROUP(group);
}

}  // namespace
}  // namespace kiln
