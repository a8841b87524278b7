#include "cli/compare/compared_page.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/build/report.h"
#include "cli/compare/job_chart.h"
#include "cli/svg.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

using nlohmann::json;

std::string picture_name(const ComparedJob& job, const ComparedChart& chart) {
  return fmt::format("{}-{}-by-{}.svg", job.name, chart.y, chart.x);
}

bool has_point(const ComparedJob& job, const ComparedChart& chart) {
  return std::any_of(job.points.begin(), job.points.end(), [&](const ComparedPoint& p) {
    return p.figures.contains(chart.x) && p.figures.contains(chart.y) && p.figures.at(chart.x) > 0;
  });
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

/// A line for each point and figure, so that jobs with other figures share one table.
std::string csv_of(const ComparedRun& run) {
  std::string csv = "job,method,setting,default,judge,figure,value,command\n";
  for (const ComparedJob& job : run.jobs)
    for (const ComparedPoint& p : job.points)
      for (const auto& [figure, value] : p.figures)
        csv += fmt::format("{},{},{},{:d},{:d},{},{:.9g},{}\n", job.name, quoted(p.method),
                           quoted(p.setting), p.is_default, p.is_judge, figure, value,
                           quoted(p.command));
  return csv;
}

std::vector<std::string> figure_names(const ComparedJob& job) {
  std::set<std::string> names;
  for (const ComparedPoint& p : job.points)
    for (const auto& [figure, value] : p.figures) names.insert(figure);
  return {names.begin(), names.end()};
}

std::string words_of(std::string figure) {
  std::replace(figure.begin(), figure.end(), '_', ' ');
  return figure;
}

std::string table_of(const ComparedJob& job) {
  const std::vector<std::string> figures = figure_names(job);
  std::string html = "<div class=\"wide\"><table><thead><tr><th>method</th><th>setting</th>";
  for (const std::string& figure : figures) html += "<th>" + escaped(words_of(figure)) + "</th>";
  html += "<th>command</th></tr></thead><tbody>\n";
  for (const ComparedPoint& p : job.points) {
    html += fmt::format("<tr{}><td>{}</td><td>{}{}</td>", p.is_default ? " class=\"default\"" : "",
                        escaped(p.method), escaped(p.setting),
                        p.is_judge     ? " (judge)"
                        : p.is_default ? " (default)"
                                       : "");
    for (const std::string& figure : figures) {
      const auto found = p.figures.find(figure);
      html += found == p.figures.end() ? std::string("<td></td>")
                                       : fmt::format("<td class=\"n\">{:.4g}</td>", found->second);
    }
    html += "<td><code>" + escaped(p.command) + "</code></td></tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

constexpr char kHead[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
    "<style>\n"
    "body{font:15px/1.5 Helvetica,Arial,sans-serif;color:#2b2f36;background:#fff;max-width:960px;"
    "margin:2rem auto;padding:0 1rem}\n"
    "svg{max-width:100%;height:auto}\n"
    ".wide{overflow-x:auto}\n"
    "table{border-collapse:collapse;font-size:13px}\n"
    "th,td{border-bottom:1px solid #dfe3e8;padding:3px 10px 3px 0;text-align:left;"
    "white-space:nowrap;vertical-align:top}\n"
    "th{white-space:normal}\n"
    "td.n{text-align:right;font-variant-numeric:tabular-nums}\n"
    "tr.default{font-weight:bold}\n"
    "code{font-size:12px}\n"
    "</style>\n";

std::string page_of(const ComparedRun& run) {
  std::string html = kHead;
  html += "<title>" + escaped(run.title) + "</title></head><body>\n<h1>" + escaped(run.title) +
          "</h1>\n<nav>";
  for (const ComparedJob& job : run.jobs)
    html += fmt::format("<a href=\"#{0}\">{0}</a> ", escaped(job.name));
  html += "</nav>\n";
  for (const ComparedJob& job : run.jobs) {
    html += fmt::format("<section id=\"{}\"><h2>{}</h2>\n", escaped(job.name), escaped(job.title));
    for (const ComparedChart& chart : job.charts)
      if (has_point(job, chart)) html += draw_chart(job, chart);
    html += table_of(job);
    for (const std::string& line : job.left_out) html += "<p>Left out: " + escaped(line) + "</p>\n";
    html += "</section>\n";
  }
  html += "<h2>What was measured on what</h2>\n<table>\n";
  for (const auto& [name, value] : run.facts)
    html += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", escaped(name), escaped(value));
  return html + "</table>\n</body></html>\n";
}

}  // namespace

std::map<std::string, std::string> machine_facts() {
  std::map<std::string, std::string> facts;
  utsname system{};
  if (uname(&system) == 0)
    facts["system"] = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  std::ifstream processors("/proc/cpuinfo");
  for (std::string line; std::getline(processors, line);)
    if (line.starts_with("model name")) {
      facts["processor"] = line.substr(line.find(':') + 2);
      break;
    }
  facts["threads"] = std::to_string(thread_count());
  facts["compiler"] = __VERSION__;
  const json versions = library_versions();
  for (const auto& [name, version] : versions.items())
    facts["version of " + name] = version.get<std::string>();
  return facts;
}

void name_commands(ComparedRun& run) {
  for (ComparedJob& job : run.jobs)
    for (ComparedPoint& p : job.points)
      if (p.command.empty()) p.command = run.facts.at("command");
}

json to_json(const ComparedRun& run) {
  json result = {{"title", run.title}, {"facts", run.facts}, {"jobs", json::array()}};
  for (const ComparedJob& job : run.jobs) {
    json points = json::array();
    for (const ComparedPoint& p : job.points)
      points.push_back({{"method", p.method},
                        {"setting", p.setting},
                        {"default", p.is_default},
                        {"judge", p.is_judge},
                        {"unsafe", p.is_unsafe},
                        {"figures", p.figures},
                        {"command", p.command}});
    json charts = json::array();
    for (const ComparedChart& chart : job.charts) {
      json front = json::array();
      const std::vector<bool> on_front = pareto_front(job.points, chart.x, chart.y);
      for (std::size_t i = 0; i < on_front.size(); ++i)
        if (on_front[i]) front.push_back(i);
      charts.push_back(
          {{"x", chart.x}, {"y", chart.y}, {"front", front}, {"file", picture_name(job, chart)}});
    }
    result["jobs"].push_back({{"name", job.name},
                              {"title", job.title},
                              {"notes", job.notes},
                              {"charts", charts},
                              {"points", points},
                              {"left_out", job.left_out}});
  }
  return result;
}

void write_comparison(const ComparedRun& run, PartFolder& folder) {
  for (const ComparedJob& job : run.jobs)
    for (const ComparedChart& chart : job.charts)
      if (has_point(job, chart)) folder.write(picture_name(job, chart), draw_chart(job, chart));
  folder.write("compare.html", page_of(run));
  folder.write("compare.csv", csv_of(run));
  folder.write(kComparisonName, to_json(run).dump(2) + "\n");
  folder.commit();
}

}  // namespace scarp
