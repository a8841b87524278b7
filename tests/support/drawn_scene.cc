#include "tests/support/drawn_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

#include "core/sight/tin_index.h"
#include "tests/support/terrain.h"

namespace scarp::test {
namespace {

/// An eye as it is written; its place is known when the terrain is.
struct WrittenEye {
  std::string name;
  double column, row;
  std::string height;
  int line;
};

class Reader {
 public:
  Reader(const std::string& name, const std::string& text) : lines_(text) { scene_.name = name; }

  DrawnScene read() {
    while (next_line()) read_entry();
    if (heights_.empty()) fail("no terrain was drawn");
    if (scene_.shows.empty() || scene_.fails.empty()) fail("it must say what it shows and fails");
    make_terrain();
    for (const WrittenEye& eye : eyes_) place_eye(eye);
    check_sights();
    return std::move(scene_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error("scene " + scene_.name + ", line " + std::to_string(number_) + ": " +
                             what);
  }

  bool next_line() {
    while (std::getline(lines_, line_)) {
      ++number_;
      line_.erase(line_.find_last_not_of(" \t\r") + 1);
      if (!line_.empty() && line_[0] != '#') return true;
    }
    return false;
  }

  double number(const std::string& word) const {
    std::size_t end = 0;
    double value = 0;
    try {
      value = std::stod(word, &end);
    } catch (const std::exception&) {
      end = std::string::npos;
    }
    if (end != word.size()) fail("'" + word + "' is no number");
    return value;
  }

  double height(const std::string& word) const {
    return word == "?" ? std::numeric_limits<double>::quiet_NaN() : number(word);
  }

  void read_entry() {
    std::istringstream words(line_);
    std::string key, rest;
    words >> key >> std::ws;
    std::getline(words, rest);
    std::istringstream values(rest);
    std::string a, b, c, d;
    values >> a >> b >> c >> d;
    if (key == "shows") {
      scene_.shows += (scene_.shows.empty() ? "" : " ") + rest;
    } else if (key == "fails") {
      scene_.fails = rest;
    } else if (key == "cell") {
      cell_x_m_ = number(a);
      cell_y_m_ = b.empty() ? cell_x_m_ : number(b);
      if (!(cell_x_m_ > 0 && cell_y_m_ > 0)) fail("cells must be larger than nothing");
    } else if (key == "groups") {
      scene_.group_triangles = static_cast<std::uint32_t>(number(a));
      if (scene_.group_triangles < 1) fail("a group has at least one triangle");
    } else if (key == "draw") {
      if (a.size() != 1) fail("'" + a + "': one letter was expected");
      letters_[a[0]] = height(b);
    } else if (key == "terrain") {
      read_terrain();
    } else if (key == "eye") {
      if (d.empty()) fail("an eye is NAME COLUMN ROW HEIGHT");
      eyes_.push_back({a, number(b), number(c), d, number_});
    } else if (key == "expect") {
      scene_.sights.push_back({a, read_block()});
    } else {
      fail("'" + key + "' is none of shows, fails, cell, groups, draw, terrain, eye, expect");
    }
  }

  /// The lines up to an empty one or the end.
  std::vector<std::string> read_block() {
    std::vector<std::string> rows;
    while (std::getline(lines_, line_)) {
      ++number_;
      line_.erase(line_.find_last_not_of(" \t\r") + 1);
      line_.erase(0, line_.find_first_not_of(" \t"));
      if (line_.empty()) break;
      rows.push_back(line_);
    }
    return rows;
  }

  void read_terrain() {
    for (const std::string& drawn : read_block()) {
      std::vector<double> row;
      if (letters_.empty()) {
        std::istringstream words(drawn);
        for (std::string word; words >> word;) row.push_back(height(word));
      } else {
        for (const char letter : drawn) {
          if (!letters_.contains(letter)) fail(std::string("no height is drawn as ") + letter);
          row.push_back(letters_[letter]);
        }
      }
      if (!heights_.empty() && row.size() != heights_[0].size())
        fail("a row of " + std::to_string(row.size()) + " samples under one of " +
             std::to_string(heights_[0].size()));
      heights_.push_back(row);
    }
  }

  void make_terrain() {
    scene_.grid = grid_of(
        static_cast<std::int32_t>(heights_[0].size()), static_cast<std::int32_t>(heights_.size()),
        1, [&](std::int32_t column, std::int32_t row) {
          return heights_[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
        });
    for (Position& p : scene_.grid.positions) p.x_m *= cell_x_m_, p.y_m *= cell_y_m_;
    for (Position& p : scene_.grid.positions) p = round_to_lattice(p);
    scene_.grid.cell_x_m = cell_x_m_;
    scene_.grid.cell_y_m = cell_y_m_;
    scene_.tin = triangulated(scene_.grid);
  }

  void place_eye(const WrittenEye& eye) {
    number_ = eye.line;
    const double last_row = static_cast<double>(scene_.grid.rows - 1);
    Position p =
        round_to_lattice(Position{eye.column * cell_x_m_, (last_row - eye.row) * cell_y_m_, 0});
    if (eye.height[0] == '+') {
      std::optional<double> ground_m;
      if (!scene_.tin.triangles.empty())
        ground_m = TinIndex(scene_.tin).ground_height_m(p.x_m, p.y_m);
      if (!ground_m) fail("eye " + eye.name + " is not over ground; give its height as =Z");
      p.z_m = *ground_m;
    }
    const bool has_sign = eye.height[0] == '+' || eye.height[0] == '=';
    p.z_m = round_to_lattice(p.z_m + number(eye.height.substr(has_sign ? 1 : 0)));
    scene_.eyes.push_back({eye.name, p});
  }

  void check_sights() {
    for (const DrawnSight& sight : scene_.sights) {
      if (std::none_of(scene_.eyes.begin(), scene_.eyes.end(),
                       [&](const NamedEye& eye) { return eye.name == sight.eye; }))
        fail("there is no eye " + sight.eye);
    }
  }

  std::istringstream lines_;
  std::string line_;
  int number_ = 0;
  double cell_x_m_ = 10, cell_y_m_ = 10;
  std::map<char, double> letters_;
  std::vector<std::vector<double>> heights_;
  std::vector<WrittenEye> eyes_;
  DrawnScene scene_;
};

}  // namespace

DrawnScene read_drawn_scene(const std::string& name, const std::string& text) {
  return Reader(name, text).read();
}

std::vector<DrawnScene> drawn_scenes() {
  namespace fs = std::filesystem;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(fs::path(SCARP_SOURCE_DIR) / "tests/scenes"))
    if (entry.path().extension() == ".txt") paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<DrawnScene> scenes;
  for (const fs::path& path : paths) {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    scenes.push_back(read_drawn_scene(path.stem().string(), text.str()));
  }
  return scenes;
}

std::vector<std::string> draw_sight(const SampleGrid& grid,
                                    const std::vector<TriangleSight>& sight) {
  std::vector<std::string> rows;
  std::size_t triangle = 0;  // two for each ground cell, in the order of `triangulated`
  for (std::int32_t row = 0; row + 1 < grid.rows; ++row) {
    rows.emplace_back();
    for (std::int32_t column = 0; column + 1 < grid.columns; ++column) {
      if (!grid.is_ground_cell(column, row)) {
        rows.back() += '?';
        continue;
      }
      const bool visible = sight[triangle] == TriangleSight::kVisible ||
                           sight[triangle + 1] == TriangleSight::kVisible;
      rows.back() += visible ? 'v' : 'h';
      triangle += 2;
    }
  }
  return rows;
}

}  // namespace scarp::test
