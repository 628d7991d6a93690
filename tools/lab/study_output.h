// What a study leaves behind: data, plots, the report.
#pragma once

#include <string>

#include "lab/study.h"
#include "picture/plot.h"
#include "report/report.h"

namespace kiln::cli {

/// "views", "faces" or "size".
const char* study_name(StudyKind kind);

/// Comma-separated values, a line a setting after a line of column names: the same bytes on every run.
std::string study_data(const Study& study);

/// The figures as curves.
Plot study_plot(const Study& study, const StudyOptions& options, const std::string& mesh);

/// HIGH, the setting with the largest mean error and that with the least, each pixel coloured by its error.
Plot error_plot(const Study& study, const StudyOptions& options);

/// One line for a person.
std::string summary(const Setting& setting, double diagonal);
/// What the figures say, a line each.
std::vector<std::string> findings(const Study& study, const StudyOptions& options);

/// Settings and findings, for the report.
Json describe(const Study& study, const StudyOptions& options);

}  // namespace kiln::cli
