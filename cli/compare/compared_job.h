#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace scarp {

/// One setting of one method: what it costs and how far it errs, as figures by name. Names carry
/// their units: seconds, wrong_share, mean_error_deg.
struct ComparedPoint {
  std::string method;   ///< points of one method share a colour
  std::string setting;  ///< short, unique within the method
  /// A spread of FIGURE, where there is one, is FIGURE_least and FIGURE_most.
  std::map<std::string, double> figures;
  bool is_default = false;
  bool is_judge = false;   ///< what the others' errors are measured against
  bool is_unsafe = false;  ///< errs to the side that must not be; drawn hollow
  std::string command;     ///< that gives this point's answer; empty where none does
};

/// A chart of a job's points. Less is better on both axes; x is logarithmic.
struct ComparedChart {
  std::string x, x_words;  ///< name of a figure, and what it is with its unit
  std::string y, y_words;
  /// The method whose points are joined by a line, because they differ in what the chart is about;
  /// may be empty. Otherwise the points that no other beats on both axes are joined.
  std::string joined;
  bool is_y_linear = false;  ///< from zero, or else logarithmic
};

/// What several methods make of one task, measured in one run.
struct ComparedJob {
  std::string name;  ///< of its files
  std::string title;
  std::vector<std::string> notes;  ///< what was asked, of what, how often
  std::vector<ComparedChart> charts;
  std::vector<ComparedPoint> points;
  std::vector<std::string> left_out;  ///< and why, a line each
};

/// What several runs of one thing took.
struct Timed {
  double median_s = 0, least_s = 0, most_s = 0;
};
/// How often each thing is timed, where there is time for it.
inline constexpr int kComparedRuns = 3;
/// Of the seconds of some runs, at least one.
Timed median_of(std::vector<double> seconds);
/// Runs it so many times.
Timed timed(int runs, const std::function<void()>& run);
/// Adds seconds, seconds_least and seconds_most.
void add_time(ComparedPoint& point, const Timed& time);

/// Which points no other beats: is no worse on one axis and better on the other. Points without
/// both figures, unsafe ones and the judge are no part of it.
std::vector<bool> pareto_front(const std::vector<ComparedPoint>& points, const std::string& x,
                               const std::string& y);

}  // namespace scarp
