// Prints the table of docs/stability.md: where each method of culling fails.
//   stability_table                  the table; fails where `certified` is on the unsafe side
//   stability_table --scenes         what the scenes stand for
//   stability_table --judge SCENE    what the judge sees of a drawn scene, from each of its eyes

#include <fmt/core.h>

#include <string>

#include "core/sight/triangle_sight.h"
#include "tests/stability/compare_methods.h"

namespace scarp::test {
namespace {

void print_judge(const std::string& name) {
  for (const DrawnScene& scene : drawn_scenes()) {
    if (scene.name != name || scene.tin.triangles.empty()) continue;
    const TinIndex index(scene.tin);
    for (const NamedEye& eye : scene.eyes) {
      fmt::print("expect  {}\n", eye.name);
      for (const std::string& row : draw_sight(scene.grid, judge_all(index, eye.position)))
        fmt::print("{}\n", row);
      fmt::print("\n");
    }
  }
}

std::string share(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return "-";
  return fmt::format("{:.2f}", static_cast<double>(part) / static_cast<double>(whole));
}

void print_method(const MethodCounts& counts, std::uint64_t in_hidden_groups) {
  fmt::print(" {} | {} of {} | {} |", counts.falsely_culled, counts.search.false_culls,
             counts.search.cameras, share(counts.culled_of_hidden, in_hidden_groups));
}

/// @return whether `certified` was never wrong
bool print_table() {
  fmt::print(
      "| scene | triangles | eyes | visible | in hidden groups | thesis: falsely culled | searched "
      "| culled / hidden | certified: falsely culled | searched | culled / hidden |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  bool is_safe = true;
  for (const StabilityScene& scene : stability_scenes()) {
    const SceneCounts counts = compare_methods(scene, {});
    fmt::print("| {} | {} | {} | {} | {} |", scene.name, scene.tin.triangles.size(), counts.eyes,
               counts.visible, counts.in_hidden_groups);
    print_method(counts.thesis, counts.in_hidden_groups);
    print_method(counts.certified, counts.in_hidden_groups);
    fmt::print("\n");
    std::fflush(stdout);
    is_safe &= counts.certified.falsely_culled + counts.certified.search.false_culls == 0;
  }
  return is_safe;
}

/// What the names of the table stand for.
void print_scenes() {
  fmt::print("| scene | stands for | shows |\n|---|---|---|\n");
  for (const StabilityScene& scene : stability_scenes())
    fmt::print("| {} | {} | {} |\n", scene.name, scene.fails, scene.shows);
}

}  // namespace
}  // namespace scarp::test

int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--judge") {
    scarp::test::print_judge(argv[2]);
    return 0;
  }
  if (argc == 2 && std::string(argv[1]) == "--scenes") {
    scarp::test::print_scenes();
    return 0;
  }
  if (argc != 1) return 2;
  if (scarp::test::print_table()) return 0;
  fmt::print(stderr, "stability_table: certified culled what is visible, see the table\n");
  return 1;
}
