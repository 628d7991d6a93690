// What assess() found, as reports have it.
#pragma once

#include "kiln/kiln.h"
#include "report/report.h"

namespace kiln::cli {

/// Tarini's measures under the paper's names, and Kiln's own.
Json describe_assessment(const MatchAssessment& assessment);

}  // namespace kiln::cli
