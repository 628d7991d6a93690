// Jobs of the C interface: kiln::run() with options by name.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "c/objects.h"
#include "kiln/job.h"
#include "kiln/option_error.h"
#include "kiln/options.h"

struct kiln_job {
  kiln::Job job;
};
struct kiln_job_result {
  explicit kiln_job_result(kiln::JobResult made)
      : result(std::move(made)), failure(result.failure.text(kiln::option_as_member)) {
    for (const kiln::Warning& cause : result.causes) {
      warnings.push_back(cause.message.text(kiln::option_as_member));
    }
  }

  kiln::JobResult result;
  std::string failure;
  std::vector<std::string> warnings;
};

namespace kiln {
namespace {

const char* text_at(const std::vector<std::string>& texts, std::size_t index) {
  return index < texts.size() ? texts[index].c_str() : nullptr;
}

}  // namespace
}  // namespace kiln

using kiln::check_given;
using kiln::guarded;

extern "C" {

kiln_status kiln_job_new(kiln_job** job) {
  return guarded([&] {
    check_given(job, "job");
    *job = new kiln_job;
  });
}

void kiln_job_free(kiln_job* job) { delete job; }

kiln_status kiln_job_set(kiln_job* job, const char* option, const char* value) {
  return guarded([&] {
    check_given(job, "job");
    check_given(option, "option");
    check_given(value, "value");
    kiln::set_option(job->job, option, std::string_view(value));
  });
}

kiln_status kiln_job_add(kiln_job* job, const char* option, const char* value) {
  return guarded([&] {
    check_given(job, "job");
    check_given(option, "option");
    check_given(value, "value");
    const bool is_new = !kiln::is_given(job->job, option);
    std::vector<std::string> values;
    if (!is_new) values = kiln::option_values(job->job, option);
    values.emplace_back(value);
    kiln::set_option(job->job, option, values);
  });
}

kiln_status kiln_job_set_json(kiln_job* job, const char* json) {
  return guarded([&] {
    check_given(job, "job");
    check_given(json, "json");
    job->job = kiln::job_from_json(json);
  });
}

kiln_status kiln_job_set_high(kiln_job* job, const kiln_mesh* mesh, const char* name) {
  return guarded([&] {
    check_given(job, "job");
    check_given(mesh, "mesh");
    job->job.high = {kiln::JobInput(mesh->mesh, name == nullptr ? "high" : name)};
  });
}

kiln_status kiln_job_set_low(kiln_job* job, const kiln_mesh* mesh, const char* name) {
  return guarded([&] {
    check_given(job, "job");
    check_given(mesh, "mesh");
    job->job.low.given = {kiln::JobInput(mesh->mesh, name == nullptr ? "low" : name)};
  });
}

kiln_status kiln_job_set_in_memory(kiln_job* job, int32_t in_memory) {
  return guarded([&] {
    check_given(job, "job");
    job->job.in_memory = in_memory != 0;
  });
}

kiln_status kiln_job_run(const kiln_job* job, const char* device, kiln_progress progress,
                         void* user, kiln_job_result** result) {
  return guarded([&] {
    check_given(job, "job");
    check_given(result, "result");
    kiln::Progress tell;
    if (progress != nullptr) {
      tell = [&](double done, std::string_view stage) {
        return progress(done, std::string(stage).c_str(), user) != 0;
      };
    }
    kiln::check(job->job);
    kiln::JobResult made =
        kiln::run(kiln::Device::open(device == nullptr ? job->job.device : std::string(device)),
                  job->job, tell);
    kiln::check_cancelled(made.cancelled);
    *result = new kiln_job_result(std::move(made));
  });
}

void kiln_job_result_free(kiln_job_result* result) { delete result; }

const char* kiln_job_file(const kiln_job_result* result, size_t index) {
  return result == nullptr ? nullptr : kiln::text_at(result->result.files, index);
}

const char* kiln_job_warning(const kiln_job_result* result, size_t index) {
  return result == nullptr ? nullptr : kiln::text_at(result->warnings, index);
}

const char* kiln_job_failure(const kiln_job_result* result) {
  return result == nullptr || result->failure.empty() ? nullptr : result->failure.c_str();
}

const char* kiln_job_report(const kiln_job_result* result) {
  return result == nullptr ? nullptr : result->result.report.c_str();
}

const void* kiln_job_glb(const kiln_job_result* result, size_t* size) {
  if (result == nullptr || result->result.glb.empty()) return nullptr;
  if (size != nullptr) *size = result->result.glb.size();
  return result->result.glb.data();
}

void kiln_job_image_init(kiln_job_image* image) { kiln::begin(image); }

kiln_status kiln_job_map(const kiln_job_result* result, size_t index, kiln_job_image* image) {
  return guarded([&] {
    check_given(result, "result");
    check_given(image, "image");
    if (index >= result->result.maps.size()) {
      throw kiln::Error(kiln::ErrorCode::usage,
                        "index is " + std::to_string(index) + ", but the job has " +
                            std::to_string(result->result.maps.size()) + " maps.",
                        "index");
    }
    const kiln::JobMap& map = result->result.maps[index];
    const kiln::Image& pixels = map.map.image;
    kiln::give(image, {sizeof *image, map.name.c_str(), map.set.c_str(), map.tile.c_str(),
                       pixels.width, pixels.height, pixels.channels, pixels.pixels.data()});
  });
}

kiln_status kiln_job_low(const kiln_job_result* result, kiln_mesh** low) {
  return guarded([&] {
    check_given(result, "result");
    check_given(low, "low");
    *low = new kiln_mesh{result->result.low};
  });
}

}  // extern "C"
