#include "bake/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "base/formatted.h"
#include "base/option.h"
#include "base/parallel.h"
#include "detail/registry.h"
#include "image/gutter.h"
#include "match/registry.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxNamedTriangles = 5;

std::string good_fallback_names() {
  return match_names([](const MatchRow& row) { return row.is_good_fallback; });
}

/// The remedy for missed samples, as the end of a warning.
Message miss_advice(const BakeReport& report) {
  if (report.uv) {
    return "no UVs of the high poly cover them. Give both meshes the same UV layout, or find the "
           "rest by rays or nearest points (" +
           option("match.fallback") + " " + good_fallback_names() + ").";
  }
  if (!report.views) {
    return "check that both meshes coincide. Raise " + option("match.max_distance") + ", or add " +
           option("match.two_sided") + " if faces of the high poly point inward.";
  }
  Message advice = "find them by rays or nearest points (" + option("match.fallback") + " " +
                   good_fallback_names() + "), ";
  advice += report.views->undersampled > 0.5
                ? "raise " + option("match.views.size") +
                      ", since most triangles are smaller "
                      "than a pixel of the views, "
                : "use more views (" + option("match.views.count") + "), ";
  advice += "raise " + option("match.max_distance") + ", or add " + option("match.two_sided") +
            " if faces are inside out.";
  return advice;
}

}  // namespace

std::uint32_t band_samples(const Source::Impl& high, const BakeOptions& options) {
  const bool smooths_occlusion = !occlusion_error_bounds(options).empty();
  return high.is_streamed() && !smooths_occlusion ? kStreamedBandSamples : kBandSamples;
}

void clear_counts(BakeReport& report) {
  report.texels = report.samples = report.outward = report.inward = report.cage = report.viewed =
      report.closest = report.by_uv = report.passed_over = report.missed = 0;
}

void count_samples(BandReads& reads, const DeviceCorrespondence& match, double unit,
                   BakeReport& report, double& distance_sum) {
  const std::vector<std::uint8_t>& status = reads.read(match.status, match.count);
  const std::vector<float>& distance = reads.read(match.distance, match.count);
  struct Sums {
    std::array<std::uint64_t, KILN_STATUS_COUNT> counts{};
    double distance = 0;
  };
  constexpr std::size_t kSamplesPerBlock = 1 << 16;
  std::vector<Sums> blocks((match.count + kSamplesPerBlock - 1) / kSamplesPerBlock);
  parallel_for(match.count, kSamplesPerBlock, [&](std::size_t begin, std::size_t end) {
    // Sums values in several independent variables, which hides the latency of additions, and adds these in a fixed
    // order.
    constexpr std::size_t kParallelSums = 4;
    std::array<Sums, kParallelSums> parallel_sums;
    const auto add = [&](std::size_t i, Sums& sums) {
      ++sums.counts[std::min<std::size_t>(status[i], KILN_STATUS_COUNT - 1)];
      sums.distance += status[i] != KILN_STATUS_MISS ? double{std::abs(distance[i])} : 0.0;
    };
    std::size_t i = begin;
    for (; i + kParallelSums <= end; i += kParallelSums) {
      for (std::size_t k = 0; k < kParallelSums; ++k) add(i + k, parallel_sums[k]);
    }
    for (; i < end; ++i) add(i, parallel_sums[0]);
    Sums& sums = blocks[begin / kSamplesPerBlock];
    for (const Sums& lane : parallel_sums) {
      for (std::size_t s = 0; s < sums.counts.size(); ++s) sums.counts[s] += lane.counts[s];
      sums.distance += lane.distance;
    }
  });
  for (const Sums& sums : blocks) {
    report.outward += sums.counts[KILN_STATUS_OUTWARD];
    report.passed_over += sums.counts[KILN_STATUS_OUTERMOST];
    report.inward += sums.counts[KILN_STATUS_INWARD];
    report.cage += sums.counts[KILN_STATUS_CAGE];
    report.viewed += sums.counts[KILN_STATUS_VIEW];
    report.closest += sums.counts[KILN_STATUS_CLOSEST];
    report.by_uv += sums.counts[KILN_STATUS_UV];
    report.missed += sums.counts[KILN_STATUS_MISS];
    distance_sum += sums.distance * unit;
  }
}

void flatten_below_surface(std::string_view map, Image& image,
                           std::span<const std::uint8_t> coverage, BakeReport& report) {
  std::uint64_t baked = 0, below_surface = 0;
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    if (coverage[i] != kCoverageBaked) continue;
    ++baked;
    float* const normal = &image.pixels[i * image.channels];
    if (!std::signbit(normal[2])) continue;
    ++below_surface;
    if (normal[2] == 0) continue;
    const float size = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1]);
    normal[0] = size > 0 ? normal[0] / size : 1;
    normal[1] = size > 0 ? normal[1] / size : 0;
    normal[2] = -0.0F;  // The value -0 marks a texel whose normal was raised to the horizon
  }
  if (below_surface == 0) return;
  const std::string share =
      formatted("%.2g", 100 * static_cast<double>(below_surface) / static_cast<double>(baked));
  report.warnings.push_back(
      {"below-surface",
       share + "% of the texels of the map " + std::string(map) + " point below the surface. " +
           option("encoding.two_component") +
           " cannot represent this: they were clamped to the horizon. Leave it out to keep "
           "them.",
       below_surface});
}

void warn_about_coverage(std::uint64_t size, BakeReport& report) {
  // Reciprocal of the minimum coverage, which is 1%.
  constexpr std::uint64_t kCoverageDivisor = 100;
  if (report.texels == 0 || report.texels * kCoverageDivisor >= size) return;
  report.warnings.push_back({"little-coverage",
                             "UVs of the low poly cover " + std::to_string(report.texels) + " of " +
                                 std::to_string(size) +
                                 " texels, less than 1% of the map. Check the scale of its UV "
                                 "layout, and which UV set is used.",
                             report.texels});
}

void warn_about_misses(BakeReport& report) {
  if (report.samples == 0) {
    report.warnings.push_back(
        {"no-texels",
         "No texel centre lies inside a UV triangle: the map is empty. Use a larger "
         "size, or check the UV layout.",
         1});
  } else if (report.missed * 50 > report.samples) {
    const auto percent = static_cast<int>(100.0 * static_cast<double>(report.missed) /
                                          static_cast<double>(report.samples));
    report.warnings.push_back(
        {"many-misses",
         std::to_string(percent) + "% of the samples found no point of the high poly" +
             (report.uv ? ": " : " within the distance: ") + miss_advice(report),
         report.missed});
  }
}

std::string triangle_names(const Mesh& mesh, std::uint32_t triangle) {
  std::string names;
  const auto add = [&](const char* what, const std::vector<std::uint32_t>& of,
                       const std::vector<std::string>& list) {
    // Repeated names are omitted: in files without names, object and group both have the file's name.
    if (of.empty() || names.find("'" + list[of[triangle]] + "'") != std::string::npos) return;
    names += (names.empty() ? "" : ", ") + std::string(what) + " '" + list[of[triangle]] + "'";
    std::replace(names.begin(), names.end(), '\n',
                 ' ');  // glTF names may contain line breaks, which would split the message
  };
  add("object", mesh.objects, mesh.object_names);
  add("group", mesh.groups, mesh.group_names);
  add("material", mesh.materials, mesh.material_names);
  return names;
}

std::string describe_triangle(const Mesh& mesh, std::uint32_t triangle) {
  const std::string names = triangle_names(mesh, triangle);
  return "triangle " + std::to_string(triangle) + (names.empty() ? "" : " (" + names + ")");
}

void warn_about_small_charts(const SmallCharts& small_charts, const Mesh& low,
                             std::vector<Warning>& warnings) {
  if (small_charts.triangles.empty()) return;
  const auto to_text = [](std::size_t count) { return std::to_string(count); };
  std::string message = to_text(small_charts.triangles.size()) +
                        " triangles of the low poly are in charts that contain no texel centre. ";
  if (!small_charts.texels.empty()) {
    const AssignedTexel& texel = small_charts.texels.front();
    message +=
        "Of these, " +
        to_text(small_charts.triangles.size() - small_charts.triangles_without_texel.size()) +
        " use free texels nearby (" + to_text(small_charts.texels.size()) + "); for example, " +
        describe_triangle(low, texel.triangle) + " uses the texel in column " +
        to_text(texel.column) + ", row " + to_text(texel.row) + ". ";
  }
  if (!small_charts.triangles_without_texel.empty()) {
    message += to_text(small_charts.triangles_without_texel.size()) +
               " have no free texel within 8 texels and are not baked: " +
               describe_triangle(low, small_charts.triangles_without_texel.front());
    // Further triangles with the same names would add no information.
    std::set<std::string> seen_names;
    seen_names.insert(triangle_names(low, small_charts.triangles_without_texel.front()));
    std::size_t remaining_count = 0;
    for (const std::uint32_t t : small_charts.triangles_without_texel) {
      if (!seen_names.insert(triangle_names(low, t)).second) continue;
      if (seen_names.size() <= kMaxNamedTriangles) {
        message += ", " + describe_triangle(low, t);
      } else {
        ++remaining_count;
      }
    }
    if (remaining_count > 0)
      message += ", and triangles of " + to_text(remaining_count) + " other names";
    message += ". ";
  }
  message += "Enlarge these charts, or the map.";
  warnings.push_back({"uv-small", message, small_charts.triangles.size()});
}

}  // namespace kiln
