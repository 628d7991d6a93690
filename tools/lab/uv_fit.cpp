#include "lab/uv_fit.h"

#include "report/check_result.h"
#include "report/flags.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kTrialSize = 256;

/// Empty where it does.
std::string why_not(MatchMethod method, const Source& source, const Mesh& high, const Mesh& low,
                    const UvOptions& uv) {
  if (high.uvs.empty()) return "'" + high.name + "' has no UVs.";
  BakeOptions trial;
  trial.method = method;
  trial.uv = uv;
  trial.width = trial.height = kTrialSize;
  try {
    const BakeReport report = bake(source, low, trial).report;
    if (report.samples != 0 && report.missed == report.samples)
      return why_nothing(report, high, low);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    return with_flags(error.what());
  }
  return {};
}

}  // namespace

std::optional<LeftOut> unfit(MatchMethod method, const std::string& name, const Source& source,
                             const Mesh& high, const Mesh& low, const UvOptions& uv, bool must) {
  if (!find_match(method.name).needs_uvs) return std::nullopt;
  const std::string reason = why_not(method, source, high, low, uv);
  if (reason.empty()) return std::nullopt;
  if (must) {
    throw Error(ErrorCode::input,
                name + " does not do for '" + high.name + "' and '" + low.name + "': " + reason);
  }
  return LeftOut{name, reason};
}

}  // namespace kiln::cli
