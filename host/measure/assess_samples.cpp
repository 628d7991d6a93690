#include "measure/assess_samples.h"

#include <cmath>

#include "base/parallel.h"
#include "match/match_array.h"
#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {
namespace {

constexpr std::size_t kFoundSamplesPerTask = 1 << 14;

/// For each triangle of the low poly, its unit normal, and its surface area divided by its texture area.
struct FaceDensities {
  std::vector<Vec3> normal;
  std::vector<double> texel_density;
};

FaceDensities face_densities(const LowSurface& surface) {
  FaceDensities faces{std::vector<Vec3>(surface.triangles.size()),
                      std::vector<double>(surface.triangles.size())};
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3d normal = cross(to_double(b.position) - to_double(a.position),
                               to_double(c.position) - to_double(a.position));
    const double size = length(normal);
    const double uv_area = std::abs((double{b.uv.x} - a.uv.x) * (double{c.uv.y} - a.uv.y) -
                                    (double{b.uv.y} - a.uv.y) * (double{c.uv.x} - a.uv.x));
    if (!(size > 0) || !(uv_area > 0)) continue;
    faces.normal[t] = to_float(normal * (1 / size));
    faces.texel_density[t] = size / uv_area;
  }
  return faces;
}

/// Computes F(p), the matched point of a sample p.
void find_match(const Source::Impl& source, const Match& match, std::size_t element, std::size_t i,
                AssessedSamples& samples) {
  const std::uint32_t triangle = match.triangle[element];
  samples.found[i] = triangle != KILN_NO_TRIANGLE ? 1 : 0;
  if (samples.found[i] == 0) return;
  const Triangle& corners = source.triangles[triangle];
  const Vec3d a = to_double(source.positions[corners[0]]);
  const Vec3d ab = to_double(source.positions[corners[1]]) - a;
  const Vec3d ac = to_double(source.positions[corners[2]]) - a;
  samples.match[i] = a + ab * double{match.u[element]} + ac * double{match.v[element]};
  const Vec3d normal = cross(ab, ac);
  const double size = length(normal);
  if (size > 0) samples.match_normal[i] = to_float(normal * (1 / size));
}

}  // namespace

AssessedSamples assessed_samples(const Source::Impl& source, const Mesh& low, const Match& match) {
  BakeOptions sampling_options;
  sampling_options.samples = match.samples;
  sampling_options.width = match.width / match.samples;
  sampling_options.height = match.height / match.samples;
  check_match(match, sampling_options, source.triangles.size());
  check_meshes(match, match.source_hash != 0 ? hash_source(source.positions, source.triangles) : 0,
               hash_low(low));

  cl::Context& context = context_of(source.device);
  const LowSurface surface = LowSurface::of(low, source.frame);
  const FaceDensities faces = face_densities(surface);
  const double texel = 1 / (static_cast<double>(match.width) * match.height);
  TexelSampler sampler(
      context, surface,
      {sampling_options.width, sampling_options.height, sampling_options.samples, 1U << 20});
  AssessedSamples samples;
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    const TexelBand band = sampler.sample(b);
    const std::size_t first = samples.size();
    const std::size_t size = first + band.sample_count;
    samples.element.resize(size);
    samples.triangle.resize(size);
    samples.position.resize(size);
    samples.normal.resize(size);
    samples.area.resize(size);
    samples.found.resize(size);
    samples.match.resize(size);
    samples.match_normal.resize(size);
    if (band.sample_count == 0) continue;
    const std::vector<std::size_t> elements = sample_elements(context, band, match);
    std::vector<float> planes[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      planes[axis].resize(band.sample_count);
      band.points.read(context, planes[axis], axis * band.capacity);
    }
    band.triangle.read(context, std::span(samples.triangle).subspan(first));
    parallel_for(band.sample_count, kFoundSamplesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t i = first + k;
        const std::uint32_t triangle = samples.triangle[i];
        samples.element[i] = elements[k];
        samples.position[i] = {planes[0][k], planes[1][k], planes[2][k]};
        samples.normal[i] = faces.normal[triangle];
        samples.area[i] = faces.texel_density[triangle] * texel;
        find_match(source, match, elements[k], i, samples);
      }
    });
  }
  return samples;
}

}  // namespace kiln
