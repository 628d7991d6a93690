// Plans: the error that is asked for is reached by the smallest map, or said to be out of reach.
#include "kiln/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kiln/kiln.h"
#include "measure/normal_probe.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Pair {
  Mesh high = test::BumpySphere::dense(30000, true);
  Mesh low = test::BumpySphere::light(48, 24);
};

/// A sphere with waves that small maps are too coarse for.
struct Ripples {
  Mesh high = test::icosphere(6);
  Mesh low = test::uv_sphere(96, 48);

  Ripples() { bend(high); }
  static void bend(Mesh& mesh) {
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    for (Vec3& p : mesh.positions) {
      const float scale =
          1 + 0.002F * (std::sin(60 * p.x) + std::sin(60 * p.y) + std::sin(60 * p.z));
      p = {p.x * scale, p.y * scale, p.z * scale};
    }
  }
};

PlanOptions plan_options(double max_error, std::uint32_t size = 1024) {
  PlanOptions options;
  options.max_error = max_error;
  options.bake.width = options.bake.height = size;
  options.bake.max_distance = Length::share(0.05);
  return options;
}

/// What plans measure with, found in another way: every picture drawn.
class Pictures {
 public:
  explicit Pictures(const Mesh& high, std::uint32_t pixels)
      : box_(box_of(high)), reference_(Scene(*test::device(), high), box_, views(), pixels) {}

  double error(const Mesh& low, const Image& map) const {
    return reference_.compare(Scene(*test::device(), low, {&map})).mean_degrees;
  }
  double without_map(const Mesh& low, const Image& any) const {
    return reference_.compare(Scene(*test::device(), low, {&any}), true).mean_degrees;
  }

  static std::vector<ViewAngles> views() {
    std::vector<ViewAngles> result;
    for (const Vec3& toward : held_out_views(kPlanViews, spread_views(12))) {
      result.push_back(view_angles(toward));
    }
    return result;
  }

 private:
  /// Plans fit their pictures to it.
  static Mesh box_of(const Mesh& mesh) {
    Vec3 low = mesh.positions[0], high = low;
    for (const Vec3& p : mesh.positions) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    Mesh box = test::cube();
    for (Vec3& p : box.positions) {
      p = {p.x < 0 ? low.x : high.x, p.y < 0 ? low.y : high.y, p.z < 0 ? low.z : high.z};
    }
    return box;
  }

  Mesh box_;
  NormalReference reference_;
};

TEST(Plan, ReachesTheErrorWithTheSmallestMap) {
  KILN_REQUIRE_DEVICE();
  const Ripples pair;
  const Source source(*test::device(), pair.high);
  const Pictures pictures(pair.high, kPlanPixels);
  // Every size's own error first.
  std::vector<double> errors;
  std::vector<Image> maps;
  const std::vector<std::uint32_t> sizes = {128, 256, 512};
  for (const std::uint32_t size : sizes) {
    maps.push_back(bake(source, pair.low, plan_options(0, size).bake).maps[0].image);
    errors.push_back(pictures.error(pair.low, maps.back()));
  }
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
    ASSERT_GT(errors[i], 1.1 * errors[i + 1]);
    const double between = (errors[i] + errors[i + 1]) / 2;
    const PlannedBake planned = bake_planned(source, pair.low, plan_options(between));
    EXPECT_TRUE(planned.reached);
    EXPECT_EQ(planned.wanted, between);
    EXPECT_EQ(planned.chosen.width, sizes[i + 1]);
    EXPECT_EQ(planned.chosen.method, MatchMethod::ray);
    EXPECT_NEAR(planned.chosen.error.mean_degrees, errors[i + 1], 0.005 * errors[i + 1]);
    // The result is what the method bakes at this size.
    ASSERT_EQ(planned.result.maps.size(), 1U);
    EXPECT_EQ(planned.result.maps[0].image.pixels, maps[i + 1].pixels);
    // One small map, the one that is chosen, and at most one between them; and no other way is looked at.
    EXPECT_LE(planned.trials.size(), 3U);
    EXPECT_EQ(planned.limits.size(), 1U);
  }
}

TEST(Plan, WithoutAnErrorTakesWhatLargerMapsWouldNotImprove) {
  KILN_REQUIRE_DEVICE();
  const Ripples pair;
  const Source source(*test::device(), pair.high);
  const Pictures pictures(pair.high, kPlanPixels);
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 2048));
  ASSERT_TRUE(planned.reached);
  EXPECT_EQ(planned.wanted, planned.chosen.error.mean_degrees);
  ASSERT_LT(planned.chosen.width, 2048U);
  ASSERT_GT(planned.chosen.width, 128U);
  const auto error = [&](std::uint32_t size) {
    const BakeResult baked = bake(source, pair.low, plan_options(0, size).bake);
    return pictures.error(pair.low, baked.maps[0].image);
  };
  const double largest = error(2048);
  EXPECT_LT(planned.chosen.error.mean_degrees, 1.06 * largest);
  EXPECT_GT(error(planned.chosen.width / 2), 1.04 * largest);
  // An endless map's error was known without baking one.
  ASSERT_EQ(planned.limits.size(), 1U);
  EXPECT_NEAR(planned.limits[0].error.mean_degrees, largest, 0.02 * largest);
}

TEST(Plan, MeasuresWhatOthersMeasure) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 512));
  const Image& map = planned.result.maps[0].image;
  for (const auto& [pixels, tolerance] : {std::pair{kPlanPixels, 0.002}, std::pair{512U, 0.03}}) {
    const Pictures pictures(pair.high, pixels);
    const double mean = pictures.error(pair.low, map);
    EXPECT_NEAR(planned.chosen.error.mean_degrees, mean, tolerance * mean) << pixels;
    const double plain = pictures.without_map(pair.low, map);
    EXPECT_NEAR(planned.without_map.mean_degrees, plain, tolerance * plain) << pixels;
  }
}

TEST(Plan, MeasuresTheSameWithoutAHierarchy) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const BakeResult baked = bake(source, pair.low, plan_options(0, 256).bake);
  const NormalProbe rays(impl_of(source), pair.low, nullptr, Pictures::views(), kPlanPixels, false);
  const NormalProbe drawn(impl_of(source), pair.low, nullptr, Pictures::views(), kPlanPixels, true);
  const Image& map = baked.maps[0].image;
  const NormalError a = rays.with_map(map, {});
  const NormalError b = drawn.with_map(map, {});
  EXPECT_GT(a.pixels, 10000U);
  EXPECT_NEAR(static_cast<double>(a.pixels), static_cast<double>(b.pixels), 0.002 * a.pixels);
  EXPECT_NEAR(a.mean_degrees, b.mean_degrees, 0.002 * a.mean_degrees);
}

TEST(Plan, MeasuresAnOpenMeshTheSameWithoutAHierarchy) {
  KILN_REQUIRE_DEVICE();
  // From below, drawing would show the steepest places alone, and those turned away.
  Mesh high = test::plane(200, 200);
  high.normals.clear();
  high.normal_triangles.clear();
  for (Vec3& p : high.positions) p.z = 0.02F * std::sin(60 * p.x) * std::cos(50 * p.y);
  const Source source(*test::device(), high);
  const Mesh low = test::plane(2, 2);
  const Image map = bake(source, low, plan_options(0, 512).bake).maps[0].image;
  const NormalProbe rays(impl_of(source), low, nullptr, Pictures::views(), kPlanPixels, false);
  const NormalProbe drawn(impl_of(source), low, nullptr, Pictures::views(), kPlanPixels, true);
  const NormalError a = rays.with_map(map, {});
  const NormalError b = drawn.with_map(map, {});
  EXPECT_NEAR(static_cast<double>(b.pixels), 0.5 * static_cast<double>(a.pixels), 0.05 * a.pixels);
  EXPECT_NEAR(a.mean_degrees, b.mean_degrees, 0.05 * a.mean_degrees);
}

TEST(Plan, KnowsWhatNoMapCanShow) {
  KILN_REQUIRE_DEVICE();
  // Waves on a plane: from the side, other parts of them are behind each place. Flat, nothing is.
  const auto least_of = [](double height) {
    Mesh high = test::plane(200, 200);
    high.normals.clear();
    high.normal_triangles.clear();
    for (Vec3& p : high.positions) p.z = static_cast<float>(height * std::sin(60 * p.x));
    const Source source(*test::device(), high);
    const NormalProbe probe(impl_of(source), test::plane(2, 2), nullptr, Pictures::views(),
                            kPlanPixels, false);
    EXPECT_GT(probe.places(), 1000U);
    // As a share of another error the least is the same, but for what grazing directions, of which it takes
    // none, add to each.
    std::shared_ptr<const VisibilityField> field;
    NormalProbe::Limit limit = probe.limit(plan_options(0).bake, field);
    const double least = limit.error.mean_degrees * probe.least_share(limit);
    EXPECT_LT(least, limit.error.mean_degrees);
    for (std::size_t i = 0; i < limit.normals.size(); ++i) limit.normals[i] = i % 3 == 2 ? 1 : 0;
    const double plain = probe.with_normals(limit.normals).mean_degrees;
    EXPECT_NEAR(plain, probe.without_map().mean_degrees, 1e-3 * plain);
    EXPECT_NEAR(plain * probe.least_share(limit), least, 0.2 * least);
    return least;
  };
  // By the height for slopes, and again for how far pictures shift.
  const double low = least_of(0.001), high = least_of(0.002);
  EXPECT_GT(low, 0.01);
  EXPECT_GT(high, 3 * low);
  EXPECT_LT(high, 5 * low);
}

std::vector<MatchMethod> looked_at(const PlannedBake& planned) {
  std::vector<MatchMethod> methods;
  for (const PlanLimit& limit : planned.limits) methods.push_back(limit.method);
  return methods;
}

TEST(Plan, SaysWhatIsOutOfReach) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  // Below what any map can show: there is no need to look at other ways.
  PlanOptions options = plan_options(1e-4, 512);
  const PlannedBake hopeless = bake_planned(source, pair.low, options);
  EXPECT_FALSE(hopeless.reached);
  EXPECT_EQ(hopeless.wanted, 1e-4);
  EXPECT_EQ(looked_at(hopeless), std::vector{MatchMethod::ray});
  EXPECT_GT(hopeless.least, 0);
  EXPECT_LE(hopeless.least, hopeless.limits[0].error.mean_degrees);
  // What it gives is the best that it found, within what a larger map must gain.
  for (const PlanTrial& trial : hopeless.trials) {
    EXPECT_LE(hopeless.chosen.error.mean_degrees, trial.error.mean_degrees / 0.98);
  }

  // Rays that are too short miss, which a better match would not: the others are looked at, views too.
  options.max_error = 1.1 * hopeless.chosen.error.mean_degrees;
  EXPECT_TRUE(bake_planned(source, pair.low, options).reached);
  options.bake.max_distance = Length::share(0.0005);
  const PlannedBake short_rays = bake_planned(source, pair.low, options);
  EXPECT_FALSE(short_rays.reached);
  EXPECT_GT(short_rays.limits.front().missed, 0.01);
  const std::vector<MatchMethod> all = {MatchMethod::ray, MatchMethod::hybrid,
                                        MatchMethod::visibility, MatchMethod::closest,
                                        MatchMethod::views};
  EXPECT_EQ(looked_at(short_rays), all);
}

TEST(Plan, LooksAtViewsLastAndOnlyWhereTheyMayHelp) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Source source(*test::device(), load_mesh(*test::shared_data("bunny_high.ply")));
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const PlannedBake hopeless = bake_planned(source, low, plan_options(0.1, 2048));
  EXPECT_EQ(looked_at(hopeless), std::vector{MatchMethod::ray});
  const double least = hopeless.least, by_rays = hopeless.limits[0].error.mean_degrees;
  ASSERT_LT(least * 1.05, by_rays);
  // Between the two another way might reach it. None does.
  const PlannedBake planned = bake_planned(source, low, plan_options(least * 1.02, 2048));
  EXPECT_FALSE(planned.reached);
  const std::vector<MatchMethod> expected = {MatchMethod::ray, MatchMethod::hybrid,
                                             MatchMethod::visibility, MatchMethod::closest};
  EXPECT_EQ(looked_at(planned), expected);
  for (const PlanLimit& limit : planned.limits) EXPECT_GT(limit.error.mean_degrees, least);
}

/// Waves on a plane, and a plane under them with the same layout but for a shift.
struct Waves {
  Mesh high = test::plane(200, 200);
  Mesh low = test::plane(2, 2);

  explicit Waves(float shift = 0, float lift = 0) {
    high.normals.clear();
    high.normal_triangles.clear();
    for (Vec3& p : high.positions) p.z = 0.002F * std::sin(60 * p.x) * std::cos(50 * p.y) + lift;
    for (Vec2& uv : high.uvs) uv.x += shift;
  }
};

TEST(Plan, TakesUvsBeforeAllElseWhereLayoutsAgree) {
  KILN_REQUIRE_DEVICE();
  Ripples pair;
  pair.bend(pair.high = test::uv_sphere(384, 192));
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(0);
  options.bake.method = MatchMethod::uv;
  const Pictures pictures(pair.high, kPlanPixels);
  const auto error = [&](std::uint32_t size) {
    options.bake.width = options.bake.height = size;
    return pictures.error(pair.low, bake(source, pair.low, options.bake).maps[0].image);
  };
  const double small = error(128), larger = error(256), largest = error(2048);
  ASSERT_GT(small, 1.02 * larger);
  const PlannedBake planned =
      bake_planned(source, pair.low, plan_options((small + larger) / 2, 2048));
  EXPECT_TRUE(planned.reached);
  EXPECT_EQ(planned.chosen.method, MatchMethod::uv);
  EXPECT_EQ(planned.chosen.width, 256U);
  EXPECT_NEAR(planned.chosen.error.mean_degrees, larger, 0.005 * larger);
  EXPECT_EQ(planned.result.report.by_uv, planned.result.report.samples);
  // No other way is looked at, and what an endless map would reach was known without baking one.
  EXPECT_EQ(looked_at(planned), std::vector{MatchMethod::uv});
  EXPECT_NEAR(planned.limits[0].error.mean_degrees, largest, 0.02 * largest);
  EXPECT_EQ(planned.limits[0].missed, 0);

  // Out of reach: no way is better, and rays are only looked at.
  const PlannedBake hopeless = bake_planned(source, pair.low, plan_options(1e-4, 512));
  EXPECT_FALSE(hopeless.reached);
  EXPECT_EQ(hopeless.chosen.method, MatchMethod::uv);
  const std::vector<MatchMethod> both = {MatchMethod::uv, MatchMethod::ray};
  EXPECT_EQ(looked_at(hopeless), both);
  for (const PlanTrial& trial : hopeless.trials) EXPECT_EQ(trial.method, MatchMethod::uv);
  EXPECT_GT(hopeless.least, 0);
}

TEST(Plan, ATrialThatFindsNothingIsNeverTheResult) {
  KILN_REQUIRE_DEVICE();
  // Half of the low poly's layout lies beside the unit square; the dense one's lies beside the rest.
  Waves pair;
  for (Vec2& uv : pair.low.uvs) uv.x += 0.5F;
  for (Vec2& uv : pair.high.uvs) uv.x *= 0.4F;
  const Source source(*test::device(), pair.high);
  BakeOptions by_uv = plan_options(0, 128).bake;
  by_uv.method = MatchMethod::uv;
  const BakeReport nothing = bake(source, pair.low, by_uv).report;
  ASSERT_GT(nothing.samples, 0U);
  ASSERT_EQ(nothing.missed, nothing.samples) << "else this tests nothing";
  for (const double wanted : {0.0, 4.0, 60.0}) {
    const PlannedBake planned = bake_planned(source, pair.low, plan_options(wanted, 256));
    EXPECT_NE(planned.chosen.method, MatchMethod::uv) << wanted;
    EXPECT_EQ(planned.result.report.missed, 0U);
    EXPECT_FALSE(planned.result.report.uv);
    if (wanted == 60) {
      EXPECT_TRUE(planned.reached);
    }
  }
  // Rays that end too early find nothing; nearest points have no such end.
  const Mesh far = test::plane(8, 8), low = test::plane(2, 2);
  Mesh raised = far;
  for (Vec3& p : raised.positions) p.z = 0.3F;
  raised.uvs.clear();
  raised.uv_triangles.clear();
  PlanOptions turned = plan_options(60, 128);
  turned.bake.max_distance = Length::absolute(0.5);
  Mesh inward = low;
  inward.normals = {{1, 0, 0}};  // rays run along the plane
  const PlannedBake planned = bake_planned(Source(*test::device(), raised), inward, turned);
  EXPECT_NE(planned.chosen.method, MatchMethod::ray);
  EXPECT_LT(planned.chosen.missed, 1);
  EXPECT_LT(planned.result.report.missed, planned.result.report.samples);
}

TEST(Plan, LeavesUvsOutWhereTheyDoNotFit) {
  KILN_REQUIRE_DEVICE();
  const auto expect_rays = [](const Waves& pair, const PlanOptions& options) {
    const Source source(*test::device(), pair.high);
    const PlannedBake planned = bake_planned(source, pair.low, options);
    EXPECT_TRUE(planned.reached);
    EXPECT_EQ(looked_at(planned), std::vector{MatchMethod::ray});
    for (const PlanTrial& trial : planned.trials) EXPECT_EQ(trial.method, MatchMethod::ray);
    for (const Warning& warning : planned.result.report.warnings) {
      EXPECT_EQ(warning.code.find("uv-"), std::string::npos) << warning.message;
    }
    EXPECT_FALSE(planned.result.report.uv);
  };
  const double reachable = 4;
  expect_rays(Waves(0.2F), plan_options(reachable, 256));
  expect_rays(Waves(0.2F), plan_options(0, 256));
  // The bound is the caller's.
  PlanOptions strict = plan_options(reachable, 256);
  strict.bake.uv.max_distance = 1e-4;
  expect_rays(Waves(), strict);
  // A cage is for rays.
  PlanOptions cage = plan_options(reachable, 256);
  cage.bake.cage = Length::share(0.05);
  expect_rays(Waves(), cage);
}

TEST(Plan, WithoutAnErrorTakesUvsUnlessRaysGetNearer) {
  KILN_REQUIRE_DEVICE();
  const auto chosen = [](const Waves& pair) {
    const Source source(*test::device(), pair.high);
    const PlannedBake planned = bake_planned(source, pair.low, plan_options(0, 512));
    EXPECT_TRUE(planned.reached);
    const std::vector<MatchMethod> both = {MatchMethod::uv, MatchMethod::ray};
    EXPECT_EQ(looked_at(planned), both);
    return planned.chosen.method;
  };
  EXPECT_EQ(chosen(Waves()), MatchMethod::uv);
  // Layouts that agree within the bound, but not well: a tenth of a wave.
  EXPECT_EQ(chosen(Waves(0.01F)), MatchMethod::ray);
  // Too far for rays.
  const Waves lifted(0, 0.04F);
  const Source source(*test::device(), lifted.high);
  PlanOptions options = plan_options(0, 512);
  options.bake.max_distance = Length::share(0.01);
  options.bake.uv.max_distance = 0.1;
  const PlannedBake planned = bake_planned(source, lifted.low, options);
  EXPECT_EQ(planned.chosen.method, MatchMethod::uv);
  EXPECT_EQ(planned.chosen.missed, 0);
  EXPECT_EQ(planned.limits.back().missed, 1);
}

TEST(Plan, KnowsWhatAFallbackAddsToUvs) {
  KILN_REQUIRE_DEVICE();
  Waves pair;
  for (Vec2& uv : pair.high.uvs) {
    if (uv.x > 0.5F) uv.x = NAN;
  }
  const Source source(*test::device(), pair.high);
  const NormalProbe probe(impl_of(source), pair.low, nullptr, Pictures::views(), kPlanPixels, true);
  std::shared_ptr<const VisibilityField> field;
  BakeOptions options = plan_options(0).bake;
  const double by_rays = probe.limit(options, field).error.mean_degrees;
  options.method = MatchMethod::uv;
  const NormalProbe::Limit half = probe.limit(options, field);
  EXPECT_NEAR(half.missed, 0.5, 0.02);
  EXPECT_GT(half.error.mean_degrees, 1.2 * by_rays);
  for (const MatchMethod fallback : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views}) {
    options.fallback = {fallback};
    const NormalProbe::Limit whole = probe.limit(options, field);
    EXPECT_LT(whole.missed, 0.01);
    EXPECT_NEAR(whole.error.mean_degrees, by_rays, 0.05 * by_rays);
  }
}

TEST(Plan, EncodingsChangeNothingInWhatIsMeasured) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(0, 256);
  const double plain = bake_planned(source, pair.low, options).chosen.error.mean_degrees;
  options.bake.flip_y = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 1e-3);
  options.bake.raw = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 1e-3);
  options.bake.two_component = true;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain, 0.02);
  options.bake.raw = options.bake.two_component = options.bake.flip_y = false;
  options.bake.space = NormalMapSpace::object;
  EXPECT_NEAR(bake_planned(source, pair.low, options).chosen.error.mean_degrees, plain,
              0.2 * plain);
}

TEST(Plan, KeepsTheShapeOfTheMapAndTheCage) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  PlanOptions options = plan_options(1e-4, 256);
  options.bake.width = 512;
  options.bake.cage = Length::share(0.05);
  const PlannedBake planned = bake_planned(source, pair.low, options);
  for (const PlanTrial& trial : planned.trials) {
    EXPECT_EQ(trial.width, 2 * trial.height);
    EXPECT_EQ(trial.method, MatchMethod::ray);
  }
}

TEST(Plan, RefusesAndCancels) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  EXPECT_THROW(bake_planned(source, pair.low, plan_options(-1)), Error);
  EXPECT_THROW(bake_planned(source, pair.low, plan_options(std::nan(""))), Error);
  PlanOptions options = plan_options(1);
  options.bake.maps = {MapKind::mask};
  EXPECT_THROW(bake_planned(source, pair.low, options), Error);
  options = plan_options(1);
  options.bake.progress = [](double, std::string_view) { return false; };
  EXPECT_TRUE(bake_planned(source, pair.low, options).result.cancelled);
}

}  // namespace
}  // namespace kiln
