// Decides whether a high poly is larger than memory, and whether the job can be baked from one on disk.
#include "bake/streaming.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "asset/obj_stream.h"
#include "asset/ply_stream.h"
#include "asset/stl_stream.h"
#include "base/memory.h"
#include "base/progress_guard.h"
#include "detail/registry.h"
#include "job/stages.h"
#include "job/streaming.h"
#include "job/transfers.h"
#include "options/parse.h"
#include "simplify/streamed_simplify.h"
#include "source/chunked_mesh.h"
#include "source/high_poly.h"

namespace kiln {
namespace {

constexpr std::uint64_t kBytesOfDeviceBuffers = std::uint64_t{256} << 20;
constexpr std::uint64_t kBytesPerTexel = 32;

LargeFile inspect_file(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply") {
    PlyLayout layout = ply_layout(path);
    return {layout.triangles, layout.has_normals, layout.has_pictures, std::move(layout.obstacle)};
  }
  if (extension == ".stl") {
    StlLayout layout = stl_layout(path);
    return {layout.triangles, false, false, std::move(layout.obstacle)};
  }
  if (extension == ".obj") {
    ObjLayout layout = obj_layout(path);
    return {layout.triangles, layout.has_normals, layout.has_pictures, std::move(layout.obstacle)};
  }
  return {};
}

[[noreturn]] void fail_to_stream(const std::string& path, const Message& obstacle) {
  throw OptionError("HIGH '" + path + "' is larger than memory, and " + obstacle +
                        " Or raise the " + option("memory_limit") + ".",
                    ErrorCode::usage, "larger-than-memory");
}

/// True if the job leaves the maps of its asset to Kiln.
bool chooses_asset_maps(const Job& job) {
  return !asset_file(job).empty() && !job.given.contains("--maps");
}

/// Explains which option of the job needs the whole high poly in memory; empty if none does.
Message find_streaming_obstacle(const LargeFile& high, const Job& job, const BakeOptions& options,
                                const RunHooks& hooks) {
  if (job.low.given.empty() && plans_low_poly(job)) {
    return "planning a LOW by rendered errors needs the whole high poly in memory: give LOW, " +
           option("faces") + ", or a largest deviation (" + option("max_error", "0.2%") + ").";
  }
  if (!asset_file(job).empty() && high.has_pictures) {
    return Message("its pictures need the whole high poly in memory: name a folder for ") +
           option("out") + ".";
  }
  if (job.max_bytes != 0) return explain_whole_mesh_need(option("max_bytes"));
  if (!job.transfers.empty()) return explain_whole_mesh_need(option("transfer"));
  if (job.match_auto) return explain_whole_mesh_need(option("match", kAutomatic));
  if (job.cage_auto) return explain_whole_mesh_need(option("cage", kAutomatic));
  if (job.parts_by) return explain_whole_mesh_need(option("match_by"));
  if (!job.load_match.empty()) return explain_whole_mesh_need(option("load_match"));
  if (!job.save_match.empty()) return explain_whole_mesh_need(option("save_match"));
  if (!job.save_source.empty()) return explain_whole_mesh_need(option("save_source"));
  if (job.reasons) return explain_whole_mesh_need(option("reasons"));
  if (job.alpha_test > 0) return explain_whole_mesh_need(option("alpha_test"));
  if (hooks.sample) return explain_whole_mesh_need("a function that samples images");
  if (job.given.contains("--clean") && job.clean != CleanHigh::none) {
    return explain_whole_mesh_need(
        option("clean", job.clean == CleanHigh::all ? "all" : kAutomatic));
  }
  // A streamed mesh uses the normals of its file, so smooth normals cannot replace them.
  if (job.frame.shading.rule == ShadingRule::smooth && high.has_normals) {
    return explain_whole_mesh_need(option("high_normals", "smooth"));
  }
  if (const Message obstacle = find_reading_obstacle(job.frame, job.fill_holes); !obstacle.empty())
    return obstacle;
  return streaming_obstacle(options);
}

}  // namespace

Message explain_whole_mesh_need(const Message& what) {
  return what + " needs the whole high poly in memory: leave it out.";
}

Message find_reading_obstacle(const MeshFrameArguments& frame, double fill_holes) {
  if (fill_holes > 0) return explain_whole_mesh_need(option("fill_holes"));
  if (!frame.up.empty()) return explain_whole_mesh_need(option("up"));
  if (!frame.unit.empty()) return explain_whole_mesh_need(option("unit"));
  const ShadingRule rule = frame.shading.rule;
  if (rule == ShadingRule::angle || rule == ShadingRule::flat) {
    return explain_whole_mesh_need(option("high_normals"));
  }
  return {};
}

std::shared_ptr<const MeshStream> open_larger_than_memory(
    const std::string& path, const MemoryNeed& memory_need, const StreamedReading& reading,
    const std::function<Message(const LargeFile& high)>& find_obstacle) {
  const LargeFile layout = inspect_file(path);
  if (layout.triangles == 0 ||
      memory_fits(layout.triangles * memory_need.bytes_per_triangle + memory_need.other_bytes)) {
    return nullptr;
  }
  Message obstacle = find_obstacle(layout);
  if (!layout.obstacle.empty()) {
    obstacle = "it " + layout.obstacle +
               ": write it as a binary, little-endian PLY of triangles, or as a binary STL.";
  }
  if (!obstacle.empty()) {
    if (memory_fits(layout.triangles * memory_need.min_bytes_per_triangle)) return nullptr;
    fail_to_stream(path, obstacle);
  }
  // At least this much is taken by each triangle of a chunk, with its BVH.
  constexpr std::uint64_t kBytesPerChunkTriangle = 100;
  const std::uint64_t chunk_bytes =
      std::min<std::uint64_t>(layout.triangles, ChunkOptions().triangles) * kBytesPerChunkTriangle;
  if (!memory_fits(chunk_bytes)) {
    throw OptionError("HIGH '" + path + "' is larger than memory, and a chunk of it would take " +
                          std::to_string(chunk_bytes >> 20) +
                          " MiB, which are not left. Raise the " + option("memory_limit") + ".",
                      ErrorCode::input, "larger-than-memory");
  }
  const std::string extension = lower_extension(path);
  const ParsingRules rules{reading.triangulation, reading.keep_hulls};
  if (extension == ".stl") return stream_stl(path, chunk_folder(), rules);
  if (extension != ".obj") return stream_ply(path);
  std::shared_ptr<const MeshStream> obj = stream_obj(path, chunk_folder(), rules);
  obstacle = find_obstacle({obj->triangle_count(), obj->has_normals(), obj->has_pictures(), {}});
  if (!obstacle.empty()) fail_to_stream(path, obstacle);
  return obj;
}

std::shared_ptr<const MeshStream> open_streamed_high(const Job& job, const BakeOptions& options,
                                                     const RunHooks& hooks, RunLog& log) {
  if (hooks.high != nullptr || job.high.size() != 1 || job.high.front().asset) return nullptr;
  const std::string& path = job.high.front().name;
  const std::uint64_t texels = std::uint64_t{options.width} * options.height;
  MemoryNeed memory_need = !job.low.given.empty()    ? kMemoryToBake
                           : job.low.make.faces != 0 ? kMemoryToSimplify
                                                     : kMemoryToSimplifyWithinError;
  memory_need.other_bytes = kBytesOfDeviceBuffers + texels * kBytesPerTexel;
  ProgressGuard progress_guard(
      [&](double, std::string_view stage) { return log.report_progress(0, stage); });
  std::shared_ptr<const MeshStream> streamed = open_larger_than_memory(
      path, memory_need, {job.load.triangulation, job.keep_hulls},
      [&](const LargeFile& high) { return find_streaming_obstacle(high, job, options, hooks); });
  if (streamed != nullptr) log.progress(0, "reading " + path);
  return streamed;
}

bool choose_streamed_asset_maps(Job& job, const MeshStream& high) {
  if (!chooses_asset_maps(job)) return false;
  if (high.has_colors())
    job.bake.maps.emplace_back(name_of(Words(kMaterialSlots), MaterialSlot::color));
  return true;
}

std::string streaming_line(const std::string& normals) {
  return "HIGH is larger than memory: read chunk by chunk, without repairs, normals " + normals;
}

ShadingReport shading_of(const MeshStream& streamed) {
  ShadingReport report;
  report.chosen = streamed.has_normals() ? ShadingRule::file : ShadingRule::smooth;
  (streamed.has_normals() ? report.given : report.missing) = streamed.triangle_count();
  return report;
}

Mesh reduce(const ChunkedMesh& mesh, std::uint32_t faces) {
  double share = reduced_share(mesh.mesh(), faces);
  const double chunk_share = std::max(share, kMinReducedShare);
  Mesh result =
      mesh.reduced([chunk_share](std::vector<Vec3>& positions, std::vector<Triangle>& triangles) {
        reduce_chunk(positions, triangles, chunk_share);
      });
  share /= chunk_share;
  while (share < 1) {
    ProgressGuard::poll_within_stage("reducing the chunks together");
    const double piece_share = std::max(share, kMinReducedShare);
    reduce_pieces(result, piece_share);
    share /= piece_share;
  }
  return result;
}

std::shared_ptr<const ChunkedMesh> sort_into_chunks(const LoadedHigh& high, double progress,
                                                    RunLog& log) {
  ProgressGuard progress_guard(
      [&](double, std::string_view stage) { return log.report_progress(progress, stage); });
  return std::make_shared<ChunkedMesh>(high.streamed);
}

Source make_streamed_source(const Device& device, const Job& job, const LoadedHigh& high,
                            RunLog& log) {
  return streamed_source(
      device, high.chunks != nullptr ? high.chunks : sort_into_chunks(high, kProgressAtSource, log),
      job.traversal);
}

}  // namespace kiln
