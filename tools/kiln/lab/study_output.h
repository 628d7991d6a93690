// What a study leaves behind: data, a plot's script, a picture, the report.
#pragma once

#include <string>

#include "lab/study.h"
#include "report/report.h"

namespace kiln::cli {

/// "views", "faces" or "size".
const char* study_name(StudyKind kind);

/// Comma-separated values, a line a setting after a line of column names: the same bytes on every run.
std::string study_data(const Study& study);

/// A gnuplot script that draws study_<kind>.csv, which lies beside it, to study_<kind>.png, or to standard
/// output where the variable to_stdout exists.
std::string study_script(const Study& study, const StudyOptions& options, const std::string& mesh);

/// HIGH, the setting with the largest mean error and that with the least, each pixel coloured by its error,
/// with a scale bar. RGB, [0, 1].
Image study_picture(const Study& study);

/// One line for a person.
std::string summary(const Setting& setting, double diagonal);
/// What the figures say, a line each.
std::vector<std::string> findings(const Study& study, const StudyOptions& options);

/// Settings and findings, for the report.
Json describe(const Study& study, const StudyOptions& options);

}  // namespace kiln::cli
