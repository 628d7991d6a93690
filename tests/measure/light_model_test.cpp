// What plans of low polys build on: meshes of many numbers of faces, and the model of their errors.
#include "measure/light_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "kiln/kiln.h"
#include "lowpoly/simplify_levels.h"
#include "measure/light_trials.h"
#include "support/shapes.h"

namespace kiln {
namespace {

TEST(SimplifyLevels, AreWhatSimplifyMakes) {
  const Mesh high = test::BumpySphere::dense(6000);
  const std::vector<std::uint32_t> faces = {2000, 700, 240};
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  ASSERT_EQ(levels.count(), 3U);
  for (const std::size_t i : {2U, 0U, 1U}) {
    SimplifyReport report, direct_report;
    const Mesh level = levels.mesh(i, &report);
    const Mesh direct = simplify(high, {.faces = faces[i]}, &direct_report);
    EXPECT_EQ(level.positions, direct.positions);
    EXPECT_EQ(level.triangles, direct.triangles);
    EXPECT_EQ(level.normals, direct.normals);
    EXPECT_EQ(levels.faces(i), direct.triangles.size());
    EXPECT_EQ(levels.vertices(i), direct.positions.size());
    EXPECT_EQ(report.faces, direct_report.faces);
    EXPECT_EQ(report.error, direct_report.error);
    EXPECT_EQ(report.warnings.size(), direct_report.warnings.size());
  }
}

TEST(SimplifyLevels, EndWhereTheShapeNeedsItsFaces) {
  const std::vector<std::uint32_t> faces = {8, 6, 4, 3, 2};
  const Mesh high = test::icosphere(1);
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  ASSERT_GE(levels.count(), 1U);
  for (std::size_t i = 1; i < levels.count(); ++i) EXPECT_LT(levels.faces(i), levels.faces(i - 1));
  EXPECT_GE(levels.faces(levels.count() - 1), 4U);
}

/// A collapse takes two faces: of goals one apart, each second gives a mesh of its own.
TEST(SimplifyLevels, GoOnWhereAGoalGivesNoMeshOfItsOwn) {
  std::vector<std::uint32_t> faces;
  for (std::uint32_t goal = 60; goal >= 8; --goal) faces.push_back(goal);
  const Mesh high = test::icosphere(2);
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  EXPECT_GE(levels.count(), 20U);
  EXPECT_LE(levels.faces(levels.count() - 1), 10U);
  for (std::size_t i = 0; i < levels.count(); ++i) {
    EXPECT_LE(levels.faces(i), levels.asked(i));
    if (i > 0) EXPECT_LT(levels.faces(i), levels.faces(i - 1));
  }
}

/// Levels of 4% fewer faces each, whose errors follow powers.
struct Powers {
  std::vector<double> faces;
  double bare_share = 1;  ///< Of a mesh for a map, without it, over one that is made to have none
  int looks = 0;
  LightModel::Node look(std::size_t level) {
    ++looks;
    const double plain = 200 / std::sqrt(faces[level]);
    return {plain, bare_share * plain, 900 / faces[level]};
  }
  LightModel model() {
    faces.clear();
    for (double f = 20000; f > 12; f *= 0.96) faces.push_back(std::floor(f));
    return LightModel(faces, [this](std::size_t level) { return look(level); });
  }
};

TEST(LightModel, FollowsPowersAndLooksSeldom) {
  Powers powers;
  LightModel model = powers.model();
  const auto level = model.fewest([&](std::size_t i) { return model.at(i).limit; });
  ASSERT_TRUE(level.has_value());
  EXPECT_NEAR(powers.faces[*level], 900, 40);
  EXPECT_LT(powers.looks, 6);
  EXPECT_FALSE(model.fewest([](std::size_t) { return 2.0; }).has_value());
  EXPECT_EQ(model.fewest([](std::size_t) { return 1.0; }), powers.faces.size() - 1);
}

TEST(LightModel, GuessesWithoutALook) {
  Powers powers;
  LightModel model = powers.model();
  model.exactly(34);
  model.exactly(51);
  const int looks = powers.looks;
  // Along the line between what is known, and beyond it to both sides.
  for (const std::size_t level : {0U, 20U, 34U, 40U, 51U, 80U}) {
    const LightModel::Node truth = powers.look(level);
    --powers.looks;
    EXPECT_NEAR(model.guess(level).plain, truth.plain, 0.01 * truth.plain) << level;
    EXPECT_NEAR(model.guess(level).limit, truth.limit, 0.01 * truth.limit) << level;
    EXPECT_EQ(model.guessed(level, 0), model.guess(level).plain) << level;
  }
  EXPECT_EQ(powers.looks, looks);
  // A level that is known is not looked at again, nor are those beside it.
  model.at(34);
  model.at(51);
  EXPECT_EQ(powers.looks, looks);
  model.at(85);  // A level where looks begin: itself alone.
  EXPECT_EQ(powers.looks, looks + 1);
}

/// Errors of neighbours scatter: a line through two of them says nothing of what is far off.
TEST(LightModel, GuessesBeyondByWhatIsFarthestApart) {
  Powers powers;
  powers.model();
  std::map<std::size_t, double> limits = {{34, 2}, {51, 3}, {52, 2.9}};
  LightModel model(powers.faces, [&](std::size_t level) {
    return LightModel::Node{4 * limits[level], 5 * limits[level], limits[level]};
  });
  for (const auto& [level, limit] : limits) model.exactly(level);
  EXPECT_GT(model.guess(100).limit, 2.9) << "of fewer faces";
  EXPECT_GT(model.guess(150).limit, model.guess(100).limit);
  limits[35] = 1.9;
  model.exactly(35);
  EXPECT_LT(model.guess(0).limit, 1.9);
}

TEST(LightModel, GlancesRememberNothing) {
  Powers powers;
  powers.model();
  LightModel model(
      powers.faces, [&](std::size_t level) { return powers.look(level); },
      [&](std::size_t level) { return 0.5 * powers.look(level).plain; });
  model.exactly(51);
  const int looks = powers.looks;
  EXPECT_NEAR(model.glance(20), 0.5 * 200 / std::sqrt(powers.faces[20]), 1e-9);
  EXPECT_EQ(powers.looks, looks + 1);
  EXPECT_FALSE(model.knows(20));
  EXPECT_EQ(model.glance(51), model.exactly(51).plain);
  EXPECT_EQ(powers.looks, looks + 1);
}

/// A mesh that was made for a map tells of meshes without one, or leaves that to looks around it.
TEST(LightModel, GuessesWhatAMeshDoesWithoutItsMap) {
  Powers powers;
  LightModel model = powers.model();
  EXPECT_FALSE(model.may_guess_plain(40));
  model.exactly(34);
  model.exactly(51);
  EXPECT_FALSE(model.may_guess_plain(40)) << "no mesh was made";
  LightModel::Node made = powers.look(34);
  made.plain *= 1.2;
  model.know(34, made);
  ASSERT_TRUE(model.may_guess_plain(40));
  EXPECT_FALSE(model.may_guess_plain(80)) << "beyond all looks";
  LightModel::Node mapped = powers.look(40);
  const double plain = mapped.plain;
  mapped.plain = 0;
  model.know(40, mapped);
  EXPECT_NEAR(model.guess(40).plain, 1.2 * plain, 0.01 * plain);
  EXPECT_EQ(model.guess(40).limit, mapped.limit);
}

TEST(LightModel, LooksWithoutAMapLeaveTheLimitToOthers) {
  Powers powers;
  powers.model();
  int plain = 0;
  LightModel model(
      powers.faces, [&](std::size_t level) { return powers.look(level); },
      [&](std::size_t level) { return ++plain, 0.5 * powers.look(level).plain; });
  model.plainly(40);  // Nothing is known around it.
  EXPECT_EQ(plain, 0);
  model.exactly(34);
  model.exactly(68);
  const int looks = powers.looks;
  const LightModel::Node node = model.plainly(51);
  EXPECT_EQ(plain, 1);
  EXPECT_EQ(powers.looks, looks + 1);  // That of the test's own.
  const LightModel::Node truth = powers.look(51);
  EXPECT_NEAR(node.plain, 0.5 * truth.plain, 1e-9 * truth.plain);
  EXPECT_NEAR(node.limit, truth.limit, 0.01 * truth.limit);
  model.plainly(51);
  EXPECT_EQ(plain, 1);
  // Where its limit is asked for, it is looked at.
  EXPECT_NEAR(model.exactly(51).limit, truth.limit, 1e-9 * truth.limit);
  EXPECT_EQ(model.exactly(51).plain, truth.plain);
  EXPECT_EQ(powers.looks, looks + 3);
}

TEST(LightModel, KnowsMeshesMadeForMapsFromThoseWithout) {
  Powers powers;
  powers.bare_share = 3;
  LightModel model = powers.model();
  const std::size_t level = 50;
  const LightModel::Node node = model.exactly(level);
  // Tiny maps hardly better what they are made for, though a mesh without a map is nearer.
  model.measured(level, 64, node.limit + 0.5 * (node.bare - node.limit));
  EXPECT_GT(model.expected(level, 16), 0.9 * node.bare);
  EXPECT_EQ(model.expected(level, 0), node.plain);
  // A mesh that is made without a map tells of others without one, and of those alone.
  model.know_plain(level, 1.2 * node.plain);
  EXPECT_NEAR(model.exactly(level).plain, 1.2 * node.plain, 1e-9);
  EXPECT_NEAR(model.exactly(level - 17).plain, 1.2 * powers.look(level - 17).plain, 1e-9);
  EXPECT_EQ(model.exactly(level).bare, node.bare);
  EXPECT_EQ(model.exactly(level - 17).limit, powers.look(level - 17).limit);
}

TEST(LightModel, LearnsFromMaps) {
  Powers powers;
  LightModel model = powers.model();
  const std::size_t level = 50;
  const LightModel::Node node = model.exactly(level);
  // A mip-map's figure gives way to that of a map of its own.
  model.measured(level, 64, node.limit + 3, LightModel::Map::mip);
  model.measured(level, 128, node.limit + 1);
  EXPECT_GT(model.expected(level, 64), node.limit + 3) << "charts of a small map are farther apart";
  EXPECT_LT(model.expected(level, 64), node.limit + 4);
  model.measured(level, 64, node.limit + 2);
  EXPECT_NEAR(model.expected(level, 64), node.limit + 2, 0.01 * node.limit + 1e-6);
  EXPECT_NEAR(model.expected(level, 128), node.limit + 1, 0.01 * node.limit + 1e-6);
  EXPECT_EQ(model.expected(level, 0), node.plain);
  EXPECT_LT(model.expected(level, 256), model.expected(level, 128));
  EXPECT_GT(model.expected(level, 256), node.limit);
  EXPECT_GT(model.expected(level, 32), model.expected(level, 64));
  EXPECT_LE(model.expected(level, 16), node.plain);
  // Two maps of a size tell how faces count: here, more of them leave each texel with more surface.
  LightModel two = powers.model();
  two.measured(level, 64, two.exactly(level).limit + 1);
  const std::size_t finer = level - 17, finest = level - 34;
  two.measured(finer, 64, two.exactly(finer).limit + 1.2);
  EXPECT_NEAR(two.expected(finer, 64), two.exactly(finer).limit + 1.2, 1e-6);
  LightModel one = powers.model();
  one.measured(finer, 64, one.exactly(finer).limit + 1.2);
  EXPECT_GT(two.expected(finest, 64), 1.05 * one.expected(finest, 64));
}

TEST(LightModel, CountsAMapThatIsLaidOutForHalfItsSizeAsALittleWorse) {
  Powers powers;
  LightModel model = powers.model();
  const double limit = model.exactly(50).limit;
  model.measured(50, 128, limit + 2, LightModel::Map::wide);
  EXPECT_LT(model.expected(50, 128), limit + 1.9);
  EXPECT_GT(model.expected(50, 128), limit + 1.6);
  // Its own layout decides at that level, and both tell how faces count.
  model.measured(50, 128, limit + 1.9);
  EXPECT_NEAR(model.expected(50, 128), limit + 1.9, 1e-6);
}

/// Looks are at rough fits. A mesh that is made well tells how much worse these are, at other levels, too.
TEST(LightModel, CorrectsRoughLooks) {
  Powers powers;
  LightModel model = powers.model();
  const LightModel::Node coarse = model.exactly(85), fine = model.exactly(51);
  const LightModel::Node seen = model.guess(70);
  model.know(70, {0.9 * seen.plain, 0.8 * seen.bare, 0.7 * seen.limit});
  EXPECT_NEAR(model.guess(70).limit, 0.7 * seen.limit, 1e-9);
  EXPECT_NEAR(model.exactly(85).limit, 0.7 * coarse.limit, 1e-9);
  EXPECT_NEAR(model.exactly(51).plain, 0.9 * fine.plain, 1e-9);
  EXPECT_NEAR(model.exactly(51).bare, 0.8 * fine.bare, 1e-9);
  EXPECT_NEAR(model.known().at(51).limit, 0.7 * fine.limit, 1e-9);
  // Between a mesh that was made and a look there is no jump.
  EXPECT_NEAR(model.guess(60).limit / (900 / powers.faces[60]), 0.7, 0.03);
  model.forget();
  EXPECT_NEAR(model.exactly(51).plain, fine.plain, 1e-9);
}

/// How fine further levels must be follows from those that there are.
TEST(LightModel, TellsHowManyFacesALimitNeeds) {
  Powers powers;
  LightModel model = powers.model();
  EXPECT_EQ(model.faces_for(1), powers.faces.front()) << "nothing is known";
  const double limit = model.exactly(0).limit;
  model.exactly(34);
  EXPECT_NEAR(model.faces_for(limit / 3) / powers.faces.front(), 3, 0.01);
  EXPECT_EQ(model.faces_for(2 * limit), powers.faces.front()) << "the finest does";
}

LightTrial miss(std::uint64_t faces, std::uint32_t size, double degrees, std::uint64_t bytes) {
  LightTrial trial;
  trial.faces = faces;
  trial.size = trial.laid_out_for = size;
  trial.expected = 2.9;
  trial.measured = degrees;
  trial.bytes.vertices = bytes;
  return trial;
}

/// What misses an error of 3 by little is worth a finer mesh, if what reaches it is far heavier.
TEST(LightMisses, TellWhatLiesBetween) {
  const std::vector<LightTrial> trials = {
      miss(1200, 128, 3.07, 50'000), miss(1500, 128, 3.25, 60'000), miss(300, 64, 4.4, 20'000)};
  const LightMisses near = LightMisses::of(trials, 128, 3), far = LightMisses::of(trials, 64, 3);
  EXPECT_NEAR(near.between(100'000, 3), std::sqrt(60'000.0 * 100'000), 1);
  EXPECT_EQ(near.between(70'000, 3), 0) << "hardly heavier";
  EXPECT_EQ(far.between(100'000, 3), 0) << "missed by much";
  EXPECT_EQ(LightMisses::of(trials, 256, 3).between(100'000, 3), 0) << "never tried";
}

/// Of maps that cost hardly more than the cheapest, the one whose mesh takes the least time to lay out.
TEST(LightOffers, TakeTheCoarserOfMapsThatWeighAboutAsMuch) {
  const LightOffer fine{10, 128, 4000, 100'000}, coarse{80, 256, 800, 105'000};
  const LightOffer dear{99, 512, 400, 120'000}, plain{20, 0, 3000, 99'000};
  const std::vector<LightOffer> maps = {fine, coarse, dear};
  const double any = 1e9;
  EXPECT_EQ(quickest(maps, any).size, 256U);
  EXPECT_EQ(quickest(std::vector{fine, dear}, any).size, 128U);
  EXPECT_EQ(quickest(std::vector{plain, fine, coarse}, any).size, 0U) << "needs no layout";
  EXPECT_EQ(quickest(std::vector{LightOffer{20, 0, 300, 103'000}, fine}, any).size, 128U);
}

/// A fifth of the faces are worth a tenth more bytes, unless these are too many to try at all.
TEST(LightOffers, TakeFarCoarserMapsThatWeighMore) {
  const LightOffer fine{10, 128, 4000, 100'000}, coarse{80, 256, 800, 112'000};
  const LightOffer half{40, 256, 2000, 112'000};
  EXPECT_EQ(quickest(std::vector{fine, coarse}, 1e9).size, 256U);
  EXPECT_EQ(quickest(std::vector{fine, coarse}, 110'000).size, 128U);
  EXPECT_EQ(quickest(std::vector{fine, half}, 1e9).size, 128U) << "half of the faces only";
}

/// A try that takes as long as several bakes of what is chosen must be expected to spare much.
TEST(LightTrials, AskMoreOfWhatTakesLong) {
  LightTrial next = miss(3800, 128, 9, 95'000);
  EXPECT_EQ(share_asked(next, 0, 750), 0.85);
  EXPECT_EQ(share_asked(next, 0, 2000), 0.93);
  EXPECT_EQ(share_asked(next, 4000, 2000), 0.85);
  next.faces = 900;
  EXPECT_EQ(share_asked(next, 0, 100), 0.93) << "laid out at once";
  next = miss(3800, 0, 9, 60'000);
  EXPECT_EQ(share_asked(next, 0, 750), 0.93) << "no layout";
}

/// Samples of a level are taken once, for normals with and without seams.
TEST(SimplifyLevels, FitNormalsAsFitNormalsDoes) {
  const Mesh high = test::BumpySphere::dense(6000);
  const std::vector<std::uint32_t> faces = {2000, 700};
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  const Mesh other = levels.mesh(1);
  Mesh low = unwrap(levels.mesh(0), {UnwrapMethod::charts, 256, 2});
  const Mesh expected = fit_normals(low, high);
  levels.fit_normals(low);
  EXPECT_EQ(low.normals, expected.normals);
  EXPECT_EQ(low.normal_triangles, expected.normal_triangles);
  Mesh coarser = other;
  levels.fit_normals(coarser);
  EXPECT_EQ(coarser.normals, fit_normals(other, high).normals);
}

}  // namespace
}  // namespace kiln
