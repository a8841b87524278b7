#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/sight/triangle_sight.h"
#include "core/terrain/sample_grid.h"
#include "core/terrain/tin.h"

namespace scarp::test {

/// An eye of a scene.
struct NamedEye {
  std::string name;
  Position position;
};

/// What the judge is expected to see from an eye, cell by cell: `v` some of the cell's two
/// triangles is visible, `h` both are hidden, `?` no ground.
struct DrawnSight {
  std::string eye;
  std::vector<std::string> rows;  ///< [rows - 1] of columns - 1 letters
};

/// A terrain that a person drew. The file format, line by line; `#` begins a comment but in the
/// lines of a drawing, and empty lines do not count:
///   shows    what the scene shows, and the expected answer, in words
///   fails    the line of the catalogue that it stands for
///   cell     X [Y]               cell size, metres; Y as X unless given
///   groups   N                   triangles in a group
///   draw     C Z                 the letter C means height Z (metres, or ? for void)
///   terrain                      then a line for each row, northern row first: heights in metres
///                                or ? for void, between blanks; one letter a sample where there
///                                are `draw` lines
///   eye      NAME COLUMN ROW H   H: +2 above ground, 1200 (no sign) or =-5 as height; columns
///                                from the west, rows from the north, fractions and places outside
///                                the terrain (heights as such only) are allowed
///   expect   NAME                then a line for each row of cells, see DrawnSight
struct DrawnScene {
  std::string name;  ///< of the file, without ending
  std::string shows;
  std::string fails;
  std::uint32_t group_triangles = 8;
  SampleGrid grid;
  Tin tin;
  std::vector<NamedEye> eyes;
  std::vector<DrawnSight> sights;
};

/// Reads a scene from text. Throws std::runtime_error that names the scene, the line and what was
/// expected there.
DrawnScene read_drawn_scene(const std::string& name, const std::string& text);

/// All of tests/scenes, by name.
std::vector<DrawnScene> drawn_scenes();

/// The judge's answer in the form of DrawnSight::rows.
std::vector<std::string> draw_sight(const SampleGrid& grid,
                                    const std::vector<TriangleSight>& sight);

}  // namespace scarp::test
