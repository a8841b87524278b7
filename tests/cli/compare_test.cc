#include <cpl_minixml.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "cli/compare/compared_job.h"
#include "cli/compare/compared_page.h"
#include "cli/compare/job_chart.h"
#include "cli/compare/scale_job.h"
#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

/// Ridges and valleys without a CRS.
std::string hills(int columns, int rows) {
  std::ostringstream text;
  text << "ncols " << columns << "\nnrows " << rows << "\nxllcorner 0\nyllcorner 0\ncellsize 100\n";
  for (int r = 0; r < rows; ++r, text << '\n')
    for (int c = 0; c < columns; ++c)
      text << std::round(200 + 150 * std::sin(0.9 * c + 0.2 * r) + 40 * std::cos(0.7 * r)) << ' ';
  return text.str();
}

/// Other programs take seconds to start.
const std::string kWithoutGrass = "PATH=/nowhere ";

std::string read_text(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class CompareCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    std::ofstream(folder_->path("hills.asc")) << hills(24, 24);
    scene_ = folder_->path("hills.scene");
    const RunResult built =
        run_scarp("$SCARP build " + folder_->path("hills.asc") + " -o " + scene_ +
                  " --vertices 200 --group-triangles 16 --min-group-triangles 4 --fans 8");
    ASSERT_EQ(built.exit_code, 0) << built.errors;
  }
  static void TearDownTestSuite() { delete folder_; }

  static inline test::TempFolder* folder_ = nullptr;
  static inline std::string scene_;
};

json point_of(const json& job, const std::string& method, const std::string& setting) {
  for (const json& point : job["points"])
    if (point["method"] == method && point["setting"] == setting) return point;
  return {};
}

/// Every figure of every point is a line of the table, with the command that repeats it.
void expect_same_figures(const std::string& csv, const json& result) {
  const auto quoted = [](const json& text) {
    std::string out;
    for (const char c : text.get<std::string>())
      out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return '"' + out + '"';
  };
  std::multiset<std::string> lines;
  std::istringstream text(csv);
  for (std::string line; std::getline(text, line);) lines.insert(line);
  std::size_t figures = 0;
  for (const json& job : result["jobs"])
    for (const json& p : job["points"]) {
      EXPECT_NE(p["command"], "") << p;
      for (const auto& [figure, value] : p["figures"].items()) {
        ++figures;
        std::ostringstream number;
        number << std::setprecision(9) << value.get<double>();
        const std::string line = job["name"].get<std::string>() + "," + quoted(p["method"]) + "," +
                                 quoted(p["setting"]) + "," + (p["default"] ? "1" : "0") + "," +
                                 (p["judge"] ? "1" : "0") + "," + figure + "," + number.str() +
                                 "," + quoted(p["command"]);
        EXPECT_EQ(lines.count(line), 1U) << line;
      }
    }
  EXPECT_EQ(lines.size(), figures + 1);
}

void expect_whole_page(const std::string& folder, const json& result) {
  const std::string page = read_text(folder + "/compare.html");
  EXPECT_EQ(page.find("http"), page.find("http://www.w3.org/2000/svg")) << "needs the network";
  for (const json& job : result["jobs"])
    for (const json& chart : job["charts"]) {
      const std::string name = chart["file"];
      CPLXMLNode* svg = CPLParseXMLString(read_text(folder + "/" + name).c_str());
      ASSERT_NE(svg, nullptr) << name;
      EXPECT_STREQ(svg->pszValue, "svg");
      CPLDestroyXMLNode(svg);
      EXPECT_FALSE(chart["front"].empty()) << name;
    }
  EXPECT_EQ(json::parse(read_text(folder + "/compare.json")), result);
  expect_same_figures(read_text(folder + "/compare.csv"), result);
}

/// Every method flew, and those that promise it show no pixel that an exact ray calls wrong.
void expect_a_flight(const json& job) {
  ASSERT_EQ(job["name"], "flight");
  std::set<std::string> methods;
  for (const json& point : job["points"]) {
    const json& figures = point["figures"];
    methods.insert(point["method"]);
    EXPECT_GT(figures["triangles"], 0) << point;
    EXPECT_EQ(point["unsafe"].get<bool>(), figures["judged_wrong_pixels"] > 0) << point;
    for (const char* promises : {"frustum", "certified", "swept", "cells", "law-tan", "hzb"})
      if (point["method"] == promises) {
        EXPECT_EQ(figures["judged_wrong_pixels"], 0) << point;
        EXPECT_GE(figures["drawn_of_visible"].get<double>(), 1 - 1e-9) << point;
      }
  }
  for (const char* method : {"frustum", "certified", "swept", "hzb", "lod-query", "stop-and-wait"})
    EXPECT_EQ(methods.count(method), 1U) << method;
}

TEST_F(CompareCommand, ChartsBothMethodsOfASceneAndCertifiedIsNeverWrong) {
  const std::string out = folder_->path("compared");
  const RunResult run = run_scarp("$SCARP compare " + scene_ + " -o " + out +
                                  " --eyes 2 --heights 2,300 --time 60min --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json result = json::parse(run.output);
  ASSERT_EQ(result["jobs"].size(), 2U);
  expect_a_flight(result["jobs"][1]);
  const json& job = result["jobs"][0];
  std::set<std::string> defaults;
  for (const json& point : job["points"]) {
    if (point["default"]) defaults.insert(point["method"]);
    EXPECT_GT(point["figures"]["seconds"], 0);
    EXPECT_GT(point["figures"]["bytes_a_triangle"], 0);
    EXPECT_LE(point["figures"]["seconds_least"], point["figures"]["seconds"]);
    EXPECT_LE(point["figures"]["seconds"], point["figures"]["seconds_most"]);
    if (point["method"].get<std::string>().starts_with("certified")) {
      EXPECT_EQ(point["figures"]["falsely_culled_triangles"], 0);
      EXPECT_FALSE(point["unsafe"]);
    }
  }
  EXPECT_EQ(defaults, (std::set<std::string>{"certified"}));
  std::set<std::string> methods;
  for (const json& point : job["points"]) methods.insert(point["method"]);
  EXPECT_EQ(methods, (std::set<std::string>{"thesis", "thesis, in squares", "certified",
                                            "certified, in squares"}));
  EXPECT_GE(job["points"].size(), 10U);
  EXPECT_TRUE(job["left_out"].empty());
  expect_whole_page(out, result);
}

TEST_F(CompareCommand, OfADemEveryJobIsThereAndWhatIsExactIsNeverWrong) {
  const std::string out = folder_->path("dem");
  const RunResult run = run_scarp(kWithoutGrass + "$SCARP compare " + folder_->path("hills.asc") +
                                  " -o " + out + " --eyes 1 --heights 2 --time 60min --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json result = json::parse(run.output);
  std::map<std::string, json> jobs;
  for (const json& job : result["jobs"]) jobs[job["name"]] = job;
  for (const char* name : {"viewshed", "heights", "horizon", "mesh", "groups", "flight", "scale"})
    ASSERT_TRUE(jobs.contains(name)) << name;
  expect_a_flight(jobs["flight"]);
  EXPECT_EQ(point_of(jobs["viewshed"], "scarp", "exact")["figures"]["wrong_percent"], 0);
  EXPECT_GT(point_of(jobs["viewshed"], "gdal_viewshed", "edge")["figures"]["wrong_percent"], 0);
  EXPECT_LT(point_of(jobs["heights"], "scarp", "exact")["figures"]["mean_error_m"], 1e-3);
  EXPECT_EQ(point_of(jobs["horizon"], "scarp", "0.3 degrees")["figures"]["outside_bounds"], 0);
  for (const json& point : jobs["mesh"]["points"]) {
    if (point["method"] == "meshoptimizer") continue;
    EXPECT_LE(point["figures"]["largest_error_m"], point["figures"]["asked_m"].get<double>() + 1e-6)
        << point;
  }
  EXPECT_EQ(result["facts"].count("input hills.asc"), 1U);
  EXPECT_EQ(jobs["viewshed"]["left_out"], json::array({"r.viewshed: GRASS is not installed"}));
  expect_whole_page(out, result);
}

TEST_F(CompareCommand, LeavesOutWhatDoesNotFitIntoTheTimeAndSaysSo) {
  const std::string out = folder_->path("hasty");
  const RunResult run = run_scarp("$SCARP compare " + scene_ + " -o " + out +
                                  " --eyes 1 --heights 2 --time 0.05s --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_FALSE(json::parse(run.output)["jobs"][0]["left_out"].empty());
}

TEST_F(CompareCommand, RefusalsAreOneLineAndLeaveNothingBehind) {
  const std::string taken = folder_->path("taken");
  std::filesystem::create_directory(taken);
  std::ofstream(taken + "/compare.csv") << "mine";
  struct Refusal {
    std::string arguments;
    int exit_code;
    std::string says;
  };
  const Refusal refusals[] = {
      {scene_ + " -o " + taken, 1, "exists"},
      {scene_ + " -o " + taken + " --overwrite", 1, "taken"},
      {scene_ + " -o " + folder_->path("none/deep"), 1, "none/deep"},
      {scene_ + " -o " + folder_->path("hills.asc"), 1, "exists"},
      {folder_->path("missing") + " -o " + folder_->path("x"), 1, "missing"},
      {scene_ + " -o " + folder_->path("x") + " --time soon", 2, "90s or 5min"},
      {scene_ + " -o " + folder_->path("x") + " --eyes 0", 2, "--eyes"},
  };
  for (const Refusal& refusal : refusals) {
    const RunResult run = run_scarp("$SCARP compare " + refusal.arguments);
    EXPECT_EQ(run.exit_code, refusal.exit_code) << refusal.arguments << '\n' << run.errors;
    EXPECT_NE(run.errors.find(refusal.says), std::string::npos) << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
    EXPECT_FALSE(std::filesystem::exists(folder_->path("x")));
  }
  EXPECT_EQ(read_text(taken + "/compare.csv"), "mine");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(taken), {}), 1);
}

/// Time and memory differ from run to run; what is measured, of what, and what is said does not.
TEST(CompareScale, HalvesTheSideDownFromTheWholeDemAndFitsTheLargestSizes) {
  const test::TempFolder folder;
  std::ofstream(folder.path("wide.asc")) << hills(80, 50);
  ScaleQuestion question;
  question.files = {folder.path("wide.asc")};
  question.limit_s = 3600;
  std::string why;
  const auto job = compare_scale(question, {}, why);
  ASSERT_TRUE(job) << why;
  std::map<std::string, std::vector<double>> samples;
  for (const ComparedPoint& p : job->points) {
    samples[p.method].push_back(p.figures.at("samples"));
    EXPECT_GT(p.figures.at(p.method + "_seconds"), 0);
    EXPECT_NE(p.command.find("wide.asc"), std::string::npos) << p.command;
    EXPECT_EQ(p.command.starts_with("gdal_translate"), p.figures.at("samples") < 80 * 50);
  }
  for (const char* work : {"viewshed", "horizons", "mesh"})
    EXPECT_EQ(samples[work], (std::vector<double>{20 * 20, 40 * 40, 80 * 50})) << work;
  EXPECT_TRUE(job->left_out.empty());
  std::size_t exponents = 0;
  for (const std::string& note : job->notes)
    exponents += note.find("grows as samples to the power of") != std::string::npos;
  EXPECT_EQ(exponents, 3U);
}

TEST(CompareScale, LeavesOutWhatWouldNotFit) {
  const test::TempFolder folder;
  std::ofstream(folder.path("hills.asc")) << hills(80, 80);
  ScaleQuestion question;
  question.files = {folder.path("hills.asc")};
  question.limit_s = 3600;
  question.memory_bytes = 500'000;  // 40 x 40 samples, not 80 x 80
  std::string why;
  const auto job = compare_scale(question, {}, why);
  ASSERT_TRUE(job) << why;
  for (const ComparedPoint& p : job->points) EXPECT_LE(p.figures.at("samples"), 40 * 40);
  ASSERT_EQ(job->left_out.size(), 1U);
  EXPECT_NE(job->left_out[0].find("memory"), std::string::npos) << job->left_out[0];
  for (const std::string& note : job->notes) EXPECT_EQ(note.find("power"), std::string::npos);
  question.limit_s = 0;
  EXPECT_FALSE(compare_scale(question, {}, why));
  EXPECT_NE(why.find("time"), std::string::npos) << why;
}

TEST(CompareScale, FindsThePowerThatAFigureGrowsWith) {
  std::vector<ComparedPoint> points;
  for (const double samples : {1e3, 4e3, 2e5})
    points.push_back({"m",
                      "",
                      {{"samples", samples}, {"s", 7 * std::pow(samples, 1.3)}},
                      false,
                      false,
                      false,
                      ""});
  EXPECT_NEAR(fitted_exponent(points, "s"), 1.3, 1e-9);
}

TEST(JobChart, DrawsAPointAtZeroAndEscapesWords) {
  ComparedJob job;
  job.title = "a < b & c";
  job.charts = {{"seconds", "s", "error", "e", ""}};
  job.points = {{"one", "alpha", {{"seconds", 1}, {"error", 0}}, true, false, false, ""},
                {"two", "beta", {{"seconds", 2}, {"error", 3}}, false, true, true, ""},
                {"two", "gamma", {{"seconds", 2}}, false, false, false, ""}};
  const std::string svg = draw_chart(job, job.charts[0]);
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  for (const char* label : {"alpha", "beta"}) EXPECT_NE(svg.find(label), std::string::npos);
  EXPECT_EQ(svg.find("gamma"), std::string::npos);  // has no error
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(JobChart, ShowsTheSpreadOfRunsAndSharesFromZero) {
  ComparedJob job;
  job.charts = {{"s", "s", "e", "e", "", true}, {"s", "s", "e", "e", ""}};
  const auto point = [](double error, double least, double most) {
    return ComparedPoint{
        "m",   "", {{"s", 2}, {"s_least", least}, {"s_most", most}, {"e", error}}, false, false,
        false, ""};
  };
  const auto lines_of = [](const std::string& svg) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = svg.find("stroke-opacity=\"0.5\"", at)) != std::string::npos;
         ++at)
      ++count;
    return count;
  };
  job.points = {point(50, 1, 3), point(100, 2, 2)};
  const std::string shares = draw_chart(job, job.charts[0]);
  EXPECT_EQ(lines_of(shares), 2U);
  for (const char* mark : {">0<", ">20<", ">100<"})
    EXPECT_NE(shares.find(mark), std::string::npos) << mark;
  job.points = {point(0, 1, 3)};
  for (const ComparedChart& chart : job.charts)
    EXPECT_EQ(draw_chart(job, chart).find("nan"), std::string::npos);
}

TEST(JobChart, NamesFarPowersOfTenShortly) {
  ComparedJob job;
  job.charts = {{"s", "s", "e", "e", ""}};
  job.points = {{"m", "", {{"s", 1e5}, {"e", 1e-6}}, false, false, false, ""},
                {"m", "", {{"s", 1e8}, {"e", 10}}, false, false, false, ""}};
  const std::string svg = draw_chart(job, job.charts[0]);
  for (const char* mark : {">10\u2076<", ">10\u207b\u2075<", ">1<"})
    EXPECT_NE(svg.find(mark), std::string::npos) << mark;
}

TEST(NameCommands, LeavesTheirOwnToThoseThatHaveThem) {
  ComparedRun run;
  run.facts["command"] = "all";
  run.jobs.emplace_back().points = {{"a", "", {}, false, false, false, "own"},
                                    {"b", "", {}, false, false, false, ""}};
  name_commands(run);
  EXPECT_EQ(run.jobs[0].points[0].command, "own");
  EXPECT_EQ(run.jobs[0].points[1].command, "all");
}

TEST(ParetoFront, HoldsWhatNoOtherBeatsAndNeverTheJudge) {
  const auto point = [](double seconds, double error, bool is_judge = false) {
    return ComparedPoint{"m", "", {{"s", seconds}, {"e", error}}, false, is_judge, false, ""};
  };
  ComparedPoint unsafe = point(0.5, 0.5);
  unsafe.is_unsafe = true;
  const std::vector<ComparedPoint> points = {
      point(1, 5), point(2, 3), point(2, 4), point(3, 3), point(4, 0, true), point(5, 1), unsafe};
  EXPECT_EQ(pareto_front(points, "s", "e"),
            (std::vector<bool>{true, true, false, false, false, true, false}));
}

}  // namespace
}  // namespace scarp
