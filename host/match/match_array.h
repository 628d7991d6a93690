// Copies correspondences between a band on the device and a whole map on the host.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cl/context.h"
#include "kiln/bake.h"
#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Makes a match without samples, for a map of this size.
Match make_match(std::uint32_t width, std::uint32_t height, std::uint32_t samples,
                 std::uint64_t source_triangles);

/// Checks that a match is valid and fits this map and source. \throws Error(input)
void check_match(const Match& match, const BakeOptions& options, std::uint64_t source_triangles);
/// Checks only that a match was made for the high poly's number of triangles.
void check_source(const Match& match, std::uint64_t source_triangles);

/// Hashes of the two meshes of a match, which are the same on every machine and for any number of
/// threads.
std::uint64_t hash_source(std::span<const Vec3> positions, std::span<const Triangle> triangles);
std::uint64_t hash_low(const Mesh& low);

/// Checks that a match was made for these meshes, if it has their hashes. \throws Error(input)
void check_meshes(const Match& match, std::uint64_t source_hash, std::uint64_t low_hash);

/// For each sample of a band, its index in the map's match.
std::vector<std::size_t> sample_elements(cl::Context& context, const TexelBand& band,
                                         const Match& match);

/// Copies a band's correspondences into the map's match. \param unit world length of a frame unit
void store_band(cl::Context& context, const TexelBand& band, const DeviceCorrespondence& from,
                double unit, Match& match);

/// Copies a band's correspondences from the map's match. Samples that the match does not cover
/// become misses.
void load_band(cl::Context& context, const TexelBand& band, const Match& from, double unit,
               DeviceCorrespondence& match);

}  // namespace kiln
