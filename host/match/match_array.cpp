#include "match/match_array.h"

#include "base/byte_hash.h"
#include "base/parallel.h"
#include "kiln/validate.h"
#include "mesh/kernels_shared.h"
#include "texel/host_correspondence.h"

namespace kiln {
namespace {

/// Calls body(sample of the band, element of the match) for every sample, in parallel.
template <typename Body>
void for_each_sample(cl::Context& context, const TexelBand& band, const Match& match,
                     const Body& body) {
  const std::vector<std::size_t> match_elements = sample_elements(context, band, match);
  parallel_for(match_elements.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) body(s, match_elements[s]);
  });
}

}  // namespace

std::vector<std::size_t> sample_elements(cl::Context& context, const TexelBand& band,
                                         const Match& match) {
  std::vector<std::uint32_t> texel_index(band.texel_count);
  std::vector<std::uint32_t> first(band.texel_count + std::size_t{1});
  std::vector<std::uint32_t> slot(band.sample_count);
  band.texel_index.read(context, texel_index);
  band.texel_first.read(context, first);
  band.sample_slot.read(context, slot);
  const std::uint32_t n = match.samples;
  const std::uint32_t width = match.width / n;
  std::vector<std::size_t> match_elements(band.sample_count);
  parallel_for(band.texel_count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::size_t x = texel_index[t] % width;
      const std::size_t y = band.first_row + texel_index[t] / width;
      for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) {
        match_elements[s] = (y * n + slot[s] / n) * match.width + x * n + slot[s] % n;
      }
    }
  });
  return match_elements;
}

Match make_match(std::uint32_t width, std::uint32_t height, std::uint32_t samples,
                 std::uint64_t source_triangles) {
  Match match;
  match.width = width * samples;
  match.height = height * samples;
  match.samples = samples;
  match.source_triangles = source_triangles;
  const std::size_t count = std::size_t{match.width} * match.height;
  match.triangle.assign(count, KILN_NO_TRIANGLE);
  match.u.assign(count, 0);
  match.v.assign(count, 0);
  match.distance.assign(count, 0);
  match.status.assign(count, KILN_STATUS_NONE);
  return match;
}

void check_match(const Match& match, const BakeOptions& options, std::uint64_t source_triangles) {
  validate(match);
  if (match.samples != options.samples || match.width != options.width * options.samples ||
      match.height != options.height * options.samples) {
    throw Error(ErrorCode::input,
                "The saved match does not fit: it was made for a map of " +
                    std::to_string(match.width / match.samples) + "x" +
                    std::to_string(match.height / match.samples) + " with " +
                    std::to_string(match.samples) + "x" + std::to_string(match.samples) +
                    " samples a texel. Use that size, or match again.",
                "match-size");
  }
  check_source(match, source_triangles);
}

void check_source(const Match& match, std::uint64_t source_triangles) {
  if (match.source_triangles == source_triangles) return;
  throw Error(ErrorCode::input,
              "The saved match does not fit: it refers to a high poly of " +
                  std::to_string(match.source_triangles) + " triangles, this one has " +
                  std::to_string(source_triangles) + ". Give the same mesh, or match again.",
              "match-source");
}

std::uint64_t hash_source(std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  return hash_bytes(positions, triangles);
}

std::uint64_t hash_low(const Mesh& low) {
  return hash_bytes(low.origin, low.positions, low.triangles, low.uvs, low.uv_triangles);
}

void check_meshes(const Match& match, std::uint64_t source_hash, std::uint64_t low_hash) {
  const auto check = [](std::uint64_t saved, std::uint64_t given, const char* which,
                        const char* id) {
    if (saved == 0 || saved == given) return;
    throw Error(ErrorCode::input,
                std::string("The saved match belongs to another ") + which +
                    " poly. Use the same mesh, or match again.",
                id);
  };
  check(match.source_hash, source_hash, "high", "match-source");
  check(match.low_hash, low_hash, "low", "match-low");
}

void store_band(cl::Context& context, const TexelBand& band, const DeviceCorrespondence& from,
                double unit, Match& match) {
  const HostCorrespondence host(context, from, band.sample_count);
  for_each_sample(context, band, match, [&](std::size_t sample, std::size_t element) {
    match.triangle[element] = host.triangle[sample];
    match.status[element] = host.status[sample];
    if (host.triangle[sample] == KILN_NO_TRIANGLE) return;
    match.u[element] = host.u[sample];
    match.v[element] = host.v[sample];
    match.distance[element] = static_cast<float>(host.distance[sample] * unit);
  });
}

void load_band(cl::Context& context, const TexelBand& band, const Match& from, double unit,
               DeviceCorrespondence& match) {
  HostCorrespondence host(band.sample_count);
  for_each_sample(context, band, from, [&](std::size_t sample, std::size_t element) {
    const bool is_covered = from.status[element] != KILN_STATUS_NONE;
    host.triangle[sample] = from.triangle[element];
    host.u[sample] = from.u[element];
    host.v[sample] = from.v[element];
    host.distance[sample] = static_cast<float>(from.distance[element] / unit);
    host.status[sample] = is_covered ? from.status[element] : std::uint8_t{KILN_STATUS_MISS};
  });
  match.count = band.sample_count;
  host.write(context, match);
}

}  // namespace kiln
