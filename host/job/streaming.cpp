// A high poly that is larger than memory: whether it is, and whether the job can do with one.
#include "bake/streaming.h"

#include <optional>
#include <utility>

#include "asset/ply_stream.h"
#include "base/memory.h"
#include "base/progress_guard.h"
#include "job/stages.h"
#include "options/parse.h"
#include "source/high_poly.h"

namespace kiln {
namespace {

// Memory of a bake whose high poly is read whole: a triangle of 10 million took 130 bytes. No bake does with 100: the
// BVH takes 62, a triangle and its half of a vertex 18, in the working frame as much again.
constexpr std::uint64_t kBytesATriangle = 140, kLeastBytesATriangle = 100;
constexpr std::uint64_t kBytesOfDevice = std::uint64_t{256} << 20;
constexpr std::uint64_t kBytesATexel = 32;

/// What the job asks for that needs the whole high poly; empty: nothing.
Message obstacle_of(const Job& job, const BakeOptions& options, const RunHooks& hooks) {
  const auto needs = [](const Message& what) {
    return what + " needs all of it at once: leave it out.";
  };
  if (job.low.given.empty()) {
    return Message("no LOW is made from it: give one, or simplify it before (kiln simplify).");
  }
  if (!asset_file(job).empty()) {
    return Message("the materials of an asset need all of it at once: name a folder for ") +
           option("out") + ".";
  }
  if (job.match_auto) return needs(option("match", kAutomatic));
  if (job.cage_auto) return needs(option("cage", kAutomatic));
  if (job.parts_by) return needs(option("match_by"));
  if (!job.load_match.empty()) return needs(option("load_match"));
  if (!job.save_match.empty()) return needs(option("save_match"));
  if (job.reasons) return needs(option("reasons"));
  if (job.alpha_test > 0) return needs(option("alpha_test"));
  if (hooks.sample) return needs("a function that samples images");
  if (!job.frame.up.empty()) return needs(option("up"));
  if (!job.frame.unit.empty()) return needs(option("unit"));
  if (job.given.contains("--clean") && job.clean != CleanHigh::none) {
    return needs(option("clean", job.clean == CleanHigh::all ? "all" : kAutomatic));
  }
  const ShadingRule rule = job.frame.shading.rule;
  if (rule == ShadingRule::angle || rule == ShadingRule::flat) return needs(option("high_normals"));
  return streaming_obstacle(options);
}

}  // namespace

std::shared_ptr<const MeshStream> stream_high(const Job& job, const BakeOptions& options,
                                              const RunHooks& hooks, RunLog& log) {
  if (hooks.high != nullptr || job.high.size() != 1 || job.high.front().asset ||
      lower_extension(job.high.front().name) != ".ply") {
    return nullptr;
  }
  const std::string& path = job.high.front().name;
  const PlyLayout layout = ply_layout(path);
  const std::uint64_t texels = std::uint64_t{options.width} * options.height;
  const std::uint64_t beside = kBytesOfDevice + texels * kBytesATexel;
  if (layout.triangles == 0 || memory_fits(layout.triangles * kBytesATriangle + beside)) {
    return nullptr;
  }
  Message obstacle = obstacle_of(job, options, hooks);
  if (!layout.obstacle.empty()) {
    obstacle = "it " + layout.obstacle + ": write it as a binary, little-endian PLY of triangles.";
  }
  if (!obstacle.empty()) {
    if (memory_fits(layout.triangles * kLeastBytesATriangle)) return nullptr;
    throw OptionError("HIGH '" + path + "' is larger than memory, and " + obstacle +
                          " Or raise the " + option("memory_limit") + ".",
                      ErrorCode::usage, "larger-than-memory");
  }
  log.progress(0, "reading " + path);
  return stream_ply(path);
}

ShadingReport shading_of(const MeshStream& streamed) {
  ShadingReport report;
  report.chosen = streamed.has_normals() ? ShadingRule::file : ShadingRule::smooth;
  (streamed.has_normals() ? report.given : report.missing) = streamed.triangle_count();
  return report;
}

Source make_streamed_source(const Device& device, const Job& job, const LoadedHigh& high,
                            RunLog& log) {
  ProgressGuard guard(
      [&](double, std::string_view stage) { return log.goes_on(kAtSource, stage); });
  return streamed_source(device, std::make_shared<ChunkedMesh>(high.streamed), job.traversal);
}

}  // namespace kiln
