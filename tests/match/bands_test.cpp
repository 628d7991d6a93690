// Matches of a map in bands are those of the map in one piece: what a match keeps from one band to the next fits a
// larger one, and what it counts is of all.
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "match/matcher.h"
#include "match/registry.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/host_correspondence.h"
#include "texel/texels.h"
#include "uv_scene.h"

namespace kiln {
namespace {

constexpr std::uint32_t kSide = 64;

struct Matched {
  std::vector<std::uint32_t> triangle = std::vector<std::uint32_t>(kSide * kSide, 0);
  std::vector<float> u = std::vector<float>(kSide * kSide, 0), v = u, distance = u;
  std::vector<std::uint8_t> status = std::vector<std::uint8_t>(kSide * kSide, KILN_STATUS_NONE);
  std::string words;  ///< Warnings, or the error
  std::uint32_t bands = 0, growing = 0;
};

/// \param samples  of a band at most
Matched match_in_bands(const MatchRow& row, const Source& source, const Mesh& low,
                       std::uint32_t samples) {
  const Source::Impl& impl = impl_of(source);
  cl::Context& context = context_of(impl.device);
  const LowSurface surface = LowSurface::of(low, impl.frame);
  MatchRequest request{.source = impl, .surface = surface};
  request.width = request.height = kSide;
  request.distance = 0.2;
  request.views.count = 0;
  request.views.directions = {{0, 0, 1}};
  request.visibility.directions = 32;
  request.visibility.view_size = 64;
  MatchNotes notes;
  const std::unique_ptr<Matcher> matcher = row.make(request, notes);
  TexelSampler sampler(context, surface, {kSide, kSide, 1, samples});
  Matched result;
  std::uint32_t before = 0;
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    const TexelBand band = sampler.sample(b);
    if (band.sample_count == 0) continue;
    ++result.bands;
    result.growing += before != 0 && band.sample_count > before ? 1 : 0;
    before = band.sample_count;
    DeviceCorrespondence match(context, band.capacity);
    matcher->run(band, match);
    const HostCorrespondence found(context, match, band.sample_count);
    const std::vector<std::uint32_t> texels = band.texel_index.download(context);
    for (std::uint32_t i = 0; i < band.sample_count; ++i) {
      const std::size_t at = std::size_t{band.first_row} * kSide + texels[i];
      result.triangle[at] = found.triangle[i];
      result.status[at] = found.status[i];
      if (found.triangle[i] == KILN_NO_TRIANGLE) continue;
      result.u[at] = found.u[i];
      result.v[at] = found.v[i];
      result.distance[at] = found.distance[i];
    }
  }
  try {
    matcher->finish(notes);
  } catch (const Error& error) {
    result.words = error.what();
  }
  for (const Warning& warning : notes.warnings) result.words += warning.message.text() + "\n";
  return result;
}

/// A triangle whose rows of texels grow from one to the next, over a bent one of many faces.
TEST(Bands, OfAnySizeGiveTheSameMatch) {
  KILN_REQUIRE_DEVICE();
  const auto pointed = [](Mesh mesh) {
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      Vec3& p = mesh.positions[v];
      p.x *= 0.5F - p.y;
      mesh.uvs[v] = {0.5F + 0.98F * p.x, 0.5F + 0.98F * p.y};
    }
    mesh.uv_triangles = mesh.triangles;
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    return mesh;
  };
  const Mesh low = pointed(test::plane(1, 8));
  const Mesh bent = test::bent_plane(24, 0.02);
  const Source source(*test::device(), pointed(bent));
  for (const MatchRow& row : match_rows()) {
    SCOPED_TRACE(row.info.method.name);
    const Matched whole = match_in_bands(row, source, low, 1U << 22);
    const Matched parts = match_in_bands(row, source, low, 8 * kSide);
    EXPECT_EQ(whole.bands, 1U);
    EXPECT_GT(parts.bands, 4U);
    EXPECT_GT(parts.growing, 3U);
    std::size_t found = 0;
    for (const std::uint32_t triangle : whole.triangle)
      found += triangle != KILN_NO_TRIANGLE ? 1 : 0;
    EXPECT_GT(found, 1000U);
    EXPECT_EQ(parts.triangle, whole.triangle);
    EXPECT_EQ(parts.u, whole.u);
    EXPECT_EQ(parts.v, whole.v);
    EXPECT_EQ(parts.distance, whole.distance);
    EXPECT_EQ(parts.status, whole.status);
    EXPECT_EQ(parts.words, whole.words);
  }
}

/// Charts of the high poly that overlap are told of with the first place, in whatever bands.
TEST(Bands, OfAnySizeTellTheSameOverlap) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::random_layout(40, 5, 0.2, false));
  for (const MatchRow& row : match_rows()) {
    if (row.find_at_uvs == nullptr) continue;
    const Matched whole = match_in_bands(row, source, test::plane(1, 1), 1U << 22);
    const Matched parts = match_in_bands(row, source, test::plane(1, 1), 8 * kSide);
    EXPECT_GT(parts.bands, 4U);
    EXPECT_NE(whole.words, "");
    EXPECT_EQ(parts.words, whole.words);
  }
}

}  // namespace
}  // namespace kiln
