#include "reference/detail.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "detail/normal.h"
#include "mesh/vector.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// Random light triangles, dense triangles and correspondences, and what the kernels need of them.
class DetailScene {
 public:
  DetailScene(cl::Context& context, std::uint32_t texels, std::uint32_t samples_per_texel)
      : context_(context), random_(7) {
    for (int i = 0; i < 40; ++i) add_low();
    for (int i = 0; i < 60; ++i) {
      Triangle t{};
      for (std::uint32_t& index : t) {
        index = static_cast<std::uint32_t>(high.normals.size());
        high.normals.push_back(unit());
      }
      // Corners of one face differ by less than a right angle, as on real meshes.
      for (std::size_t k = 1; k < 3; ++k) {
        const Vec3d sum = to_double(high.normals[t[0]]) * 2.0 + to_double(high.normals[t[k]]);
        high.normals[t[k]] = to_float(sum * (1 / length(sum)));
      }
      high.triangles.push_back(t);
    }
    const std::uint32_t count = texels * samples_per_texel;
    std::vector<std::uint32_t> index, first, low_triangle, hit_triangle;
    for (std::uint32_t t = 0; t < texels; ++t) {
      index.push_back((t * 7) % texels_capacity(texels));
      first.push_back(t * samples_per_texel);
      for (std::uint32_t s = 0; s < samples_per_texel; ++s) add_sample(low_triangle, hit_triangle);
    }
    first.push_back(count);
    texel_index = index;
    texel_first = first;
    band.row_count = 1;
    band.texel_count = texels;
    band.sample_count = count;
    band.capacity = count + 5;
    band.texel_index = upload(index);
    band.texel_first = upload(first);
    band.triangle = upload(low_triangle);
    band.barycentric =
        planes(&test::DetailSample::low_u, &test::DetailSample::low_v, band.capacity);
    match = DeviceCorrespondence(context, count + 3);
    match.count = count;
    match.triangle.write(context, hit_triangle);
    match.barycentric = planes(&test::DetailSample::u, &test::DetailSample::v, match.capacity);
  }

  static std::uint32_t texels_capacity(std::uint32_t texels) { return texels * 7 + 1; }

  LowSurface surface;
  CornerNormals high;
  std::vector<test::DetailSample> samples;
  std::vector<std::uint32_t> texel_index, texel_first;
  TexelBand band;
  DeviceCorrespondence match;

 private:
  double number() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  Vec3 unit() {
    Vec3d v{};
    do v = {number(), number(), number()};
    while (length(v) < 0.1 || length(v) > 1);
    return to_float(v * (1 / length(v)));
  }
  void add_low() {
    std::array<LowSurface::Corner, 3> corners;
    const float sign = surface.triangles.size() % 2 == 0 ? 1.0F : -1.0F;
    const Vec3d up = to_double(unit());
    for (LowSurface::Corner& corner : corners) {
      corner.position = unit();
      const Vec3d normal = up * 2.0 + to_double(unit());
      corner.normal = to_float(normal * (1 / length(normal)));
      corner.sign = sign;
      corner.uv = {static_cast<float>(number()), static_cast<float>(number())};
    }
    const Vec3d along = to_double(unit());
    for (LowSurface::Corner& corner : corners) {
      const Vec3d n = to_double(corner.normal);
      const Vec3d t = along - n * dot(n, along);
      corner.tangent = to_float(t * (1 / length(t)));
    }
    surface.triangles.push_back(corners);
    surface.usable.push_back(1);
    surface.with_uvs.push_back(static_cast<std::uint32_t>(surface.with_uvs.size()));
  }
  void add_sample(std::vector<std::uint32_t>& low_triangle,
                  std::vector<std::uint32_t>& hit_triangle) {
    test::DetailSample sample;
    const auto weights = [&](double& u, double& v) {
      u = float((number() + 1) / 2);
      v = float((number() + 1) / 2 * (1 - u));
    };
    weights(sample.low_u, sample.low_v);
    weights(sample.u, sample.v);
    const auto low = static_cast<std::uint32_t>(random_() % surface.triangles.size());
    const auto hit = static_cast<std::uint32_t>(random_() % high.triangles.size());
    sample.low = surface.triangles[low];
    sample.hit = random_() % 5 != 0;
    for (std::size_t k = 0; k < 3; ++k)
      sample.high_normals[k] = high.normals[high.triangles[hit][k]];
    low_triangle.push_back(low);
    hit_triangle.push_back(sample.hit ? hit : KILN_NO_TRIANGLE);
    samples.push_back(sample);
  }
  cl::Array<std::uint32_t> upload(const std::vector<std::uint32_t>& data) {
    return cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(data));
  }
  cl::Array<float> planes(double test::DetailSample::*a, double test::DetailSample::*b,
                          std::uint32_t capacity) {
    std::vector<float> data(std::size_t{2} * capacity, NAN);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      data[i] = static_cast<float>(samples[i].*a);
      data[capacity + i] = static_cast<float>(samples[i].*b);
    }
    return cl::Array<float>(context_, std::span<const float>(data));
  }

  cl::Context& context_;
  std::mt19937 random_;
};

struct Case {
  NormalMapSpace space;
  bool flip_y;
};

class DetailTest : public testing::TestWithParam<Case> {};

// Single precision with the frame's inverse: the determinant of a frame of corners within 30 degrees
// of each other is above 0.2, so rounding grows by less than a factor of 10 over 2^-23 a term.
constexpr double kTolerance = 2e-5;

TEST_P(DetailTest, AgreesWithTheDoublePrecisionInverse) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  for (const std::uint32_t texels : {1U, 63U, 64U, 65U, 1000U}) {
    DetailScene scene(context, texels, 1);
    BakeOptions options;
    options.encoding.space = GetParam().space;
    options.encoding.flip_y = GetParam().flip_y;
    const SourceAttributes attributes(context, scene.high);
    NormalDetail detail(context, scene.surface, attributes, options);
    const std::uint32_t places = DetailScene::texels_capacity(texels);
    cl::Array<float> image(context, std::size_t{places} * 3);
    cl::Array<std::uint8_t> coverage(context, places);
    context.fill(image, -9.0F);
    context.fill(coverage, std::uint8_t{77});
    detail.run(scene.band, scene.match, image, coverage);
    const std::vector<float> values = image.download(context);
    const std::vector<std::uint8_t> flags = coverage.download(context);
    std::vector<bool> written(places);
    for (std::uint32_t t = 0; t < texels; ++t) {
      const auto expected =
          test::reference_normal(scene.samples[t], options.encoding.space, options.encoding.flip_y);
      const std::uint32_t place = scene.texel_index[t];
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(values[place * 3 + c], expected[c], kTolerance) << "texel " << t;
      }
      EXPECT_EQ(flags[place], scene.samples[t].hit ? 1 : 2);
      written[place] = true;
    }
    for (std::uint32_t p = 0; p < places; ++p) {
      if (written[p]) continue;
      EXPECT_EQ(values[p * 3], -9.0F) << "wrote outside its texels";
      EXPECT_EQ(flags[p], 77);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Spaces, DetailTest,
                         testing::Values(Case{NormalMapSpace::tangent, false},
                                         Case{NormalMapSpace::tangent, true},
                                         Case{NormalMapSpace::object, false},
                                         Case{NormalMapSpace::object, true},
                                         Case{NormalMapSpace::face, false}));

TEST(Detail, BothPathsGiveTheSameBytes) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  int options_tried = 0;
  for (const std::uint32_t texels : {1U, 7U, 8U, 9U, 130U}) {
    for (const std::uint32_t samples : {1U, 3U}) {
      DetailScene scene(context, texels, samples);
      const SourceAttributes attributes(context, scene.high);
      const std::uint32_t places = DetailScene::texels_capacity(texels);
      for (const NormalMapSpace space :
           {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
        for (const MissPolicy miss : {MissPolicy::keep, MissPolicy::fill, MissPolicy::mark}) {
          BakeOptions options;
          options.encoding.space = space;
          options.encoding.miss = miss;
          options.encoding.flip_y = options_tried % 2 == 0;
          options.match.two_sided = options_tried % 3 == 0;
          ++options_tried;
          std::vector<std::vector<float>> images;
          std::vector<std::vector<std::uint8_t>> flags;
          for (const DetailPath path : {DetailPath::plain, DetailPath::wide}) {
            NormalDetail detail(context, scene.surface, attributes, options, path);
            cl::Array<float> image(context, std::size_t{places} * 3);
            cl::Array<std::uint8_t> coverage(context, places);
            context.fill(image, -9.0F);
            context.fill(coverage, std::uint8_t{77});
            detail.run(scene.band, scene.match, image, coverage);
            images.push_back(image.download(context));
            flags.push_back(coverage.download(context));
          }
          EXPECT_EQ(0, std::memcmp(images[0].data(), images[1].data(), images[0].size() * 4))
              << texels << " texels, " << samples << " samples, option " << options_tried;
          EXPECT_EQ(flags[0], flags[1]);
        }
      }
    }
  }
}

class ResolveTest : public testing::TestWithParam<MissPolicy> {};

TEST_P(ResolveTest, AveragesTheSamplesThatCount) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  constexpr std::uint32_t kTexels = 130;
  constexpr std::uint32_t kSamples = 4;
  DetailScene scene(context, kTexels, kSamples);
  BakeOptions options;
  options.encoding.space = NormalMapSpace::object;
  options.encoding.miss = GetParam();
  const SourceAttributes attributes(context, scene.high);
  NormalDetail detail(context, scene.surface, attributes, options);
  const std::uint32_t places = DetailScene::texels_capacity(kTexels);
  cl::Array<float> image(context, std::size_t{places} * 3);
  cl::Array<std::uint8_t> coverage(context, places);
  detail.run(scene.band, scene.match, image, coverage);
  const std::vector<float> values = image.download(context);
  const std::vector<std::uint8_t> flags = coverage.download(context);
  for (std::uint32_t t = 0; t < kTexels; ++t) {
    Vec3d sum{};
    int hits = 0;
    int used = 0;
    for (std::uint32_t s = t * kSamples; s < (t + 1) * kSamples; ++s) {
      hits += scene.samples[s].hit;
      if (!scene.samples[s].hit && options.encoding.miss != MissPolicy::keep) continue;
      const auto n = test::reference_normal(scene.samples[s], options.encoding.space, false);
      sum += Vec3d{n[0], n[1], n[2]};
      ++used;
    }
    const std::uint32_t place = scene.texel_index[t];
    EXPECT_EQ(flags[place], hits != 0 ? 1 : 2);
    if (used != 0 && length(sum) < 0.05) continue;  // the direction of nearly nothing
    Vec3d expected = used != 0 ? sum * (1 / length(sum)) : Vec3d{0, 0, 1};
    if (used == 0 && options.encoding.miss == MissPolicy::mark) expected = {1, -1, 1};
    const double tolerance = 2e-4;  // sums of four may cancel to 0.05: kTolerance / 0.05 / 2
    EXPECT_NEAR(values[place * 3], expected.x, tolerance);
    EXPECT_NEAR(values[place * 3 + 1], expected.y, tolerance);
    EXPECT_NEAR(values[place * 3 + 2], expected.z, tolerance);
  }
}

INSTANTIATE_TEST_SUITE_P(Policies, ResolveTest,
                         testing::Values(MissPolicy::keep, MissPolicy::fill, MissPolicy::mark));

}  // namespace
}  // namespace kiln
