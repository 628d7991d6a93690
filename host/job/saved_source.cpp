// Saves HIGH with its search structure (--save-source), and reuses the search structure of a saved HIGH.
#include <memory>
#include <string>

#include "asset/saved_mesh.h"
#include "job/stages.h"
#include "options/parse.h"
#include "source/high_poly.h"

namespace kiln {

std::unique_ptr<AtomicFile> begin_saved_source(const Job& job, const LoadedHigh& high,
                                               RunLog& log) {
  refuse_if(high.input.heights.has_value(),
            option("save_source") + " saves a mesh, but HIGH is a height field, which is read " +
                "quickly: leave it out.");
  auto file = std::make_unique<AtomicFile>(job.save_source);
  const Mesh& mesh = high.input.mesh;
  if (!mesh.material_names.empty())
    log.warnings.push_back(warning_of_unsaved_materials(mesh, job.save_source));
  write_saved_mesh(mesh, *file);
  return file;
}

void save_source(const RunContext& run, const Source& source, AtomicFile& file,
                 JobOutputs& outputs) {
  register_output(run, run.job.save_source, outputs);
  impl_of(source).save_tree([&](const void* data, std::size_t bytes) { file.write(data, bytes); });
  file.commit();
}

void attach_saved_tree(const Job& job, const Source& source) {
  if (job.high.size() != 1 || job.high.front().asset ||
      !is_saved_source_name(job.high.front().name))
    return;
  const std::string& path = job.high.front().name;
  impl_of(source).offer_tree(std::make_shared<SavedTree>(path, saved_mesh_end(path)));
}

}  // namespace kiln
