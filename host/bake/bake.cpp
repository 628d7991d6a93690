#include "kiln/bake.h"

#include <string>
#include <utility>

#include "bake/pipeline.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "match/match_array.h"

namespace kiln {
namespace {

void check_saved(const BakeOptions& options, const Source::Impl& high, const Mesh& low) {
  if (options.match.saved == nullptr) return;
  check_match(*options.match.saved, options, high.triangles.size());
  check_meshes(*options.match.saved, hash_source(high.positions, high.triangles), hash_low(low));
}

/// Appends another cluster's maps to those of the first cluster, and adds its seconds.
void append_cluster_maps(BakeResult& result, BakeResult baked) {
  for (BakedMap& map : baked.maps) {
    if (map.info.type != MapType::coverage) result.maps.push_back(std::move(map));
  }
  const BakeReport& further = baked.report;
  result.report.seconds_texels += further.seconds_texels;
  result.report.seconds_match += further.seconds_match;
  result.report.seconds_detail += further.seconds_detail;
  result.report.seconds_image += further.seconds_image;
  result.report.seconds_mips += further.seconds_mips;
}

/// Bakes all clusters of visibility directions, one after the other. \throws Cancelled
BakeResult bake_clusters(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
                         const OpenMapRows* open_rows, const BakeProgress& progress) {
  check_options(options);
  check_saved(options, high, low);
  const std::uint32_t cluster_count = options.match.visibility.clusters;
  Clusters clusters;
  BakeResult result;
  for (; clusters.cluster < cluster_count; ++clusters.cluster) {
    const double begin = clusters.cluster;
    BakeResult baked = Pipeline({high, low, options, 1, open_rows}, BandStorage::reused,
                                progress.part(begin / cluster_count, (begin + 1) / cluster_count))
                           .run(clusters);
    if (clusters.cluster == 0) {
      result = std::move(baked);
    } else {
      append_cluster_maps(result, std::move(baked));
    }
  }
  if (cluster_count > 1) result.clusters = clusters.field->clusters();
  return result;
}

BakeResult bake_unless_cancelled(const Source& source, const Mesh& low, const BakeOptions& options,
                                 const OpenMapRows* open_rows) {
  ProgressGuard guard(options.progress);
  const BakeProgress progress(guard.progress());
  return unless_cancelled<BakeResult>(
      [&] { return bake_clusters(impl_of(source), low, options, open_rows, progress); },
      [](BakeResult& none) { none.cancelled = true; });
}

}  // namespace

BakeResult bake_drawn(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
                      Image* drawn) {
  check_options(options);
  Clusters clusters;
  return Pipeline({high, low, options}, BandStorage::reused, BakeProgress(options.progress))
      .run(clusters, drawn);
}

BakeResult bake(const Source& source, const Mesh& low, const BakeOptions& options) {
  return bake_unless_cancelled(source, low, options, nullptr);
}

BakeResult bake_rows(const Source& source, const Mesh& low, const BakeOptions& options,
                     const OpenMapRows& open) {
  return bake_unless_cancelled(source, low, options, &open);
}

BakeResult bake(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options) {
  if (options.match.saved != nullptr) {
    throw Error(ErrorCode::usage,
                "A saved match and a match in memory were both given: leave " +
                    option("match.saved") + " out.",
                "option-contradiction");
  }
  BakeOptions match_options = options;
  match_options.match.saved = &match;
  return bake(source, low, match_options);
}

const BakedMap* BakeResult::find(MapKind kind, std::uint32_t cluster) const noexcept {
  for (const BakedMap& map : maps) {
    if (map.kind == kind && map.cluster == cluster) return &map;
  }
  return nullptr;
}

const BakedMap& BakeResult::map(MapKind kind, std::uint32_t cluster) const {
  if (const BakedMap* found = find(kind, cluster)) return *found;
  std::string message("The result has no map '");
  message.append(kind.name).append("'");
  if (cluster != 0) message.append(" of cluster ").append(std::to_string(cluster));
  message.append(maps.empty() ? ". It has none" : ". It has");
  for (const BakedMap& map : maps) message.append(" ").append(map.kind.name);
  throw Error(ErrorCode::usage, message + ".", "no-map");
}

}  // namespace kiln
