#include "tiles/store/groups_file.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "tiles/store/layout_section.h"
#include "tiles/store/pack.h"

namespace scarp {
namespace {

constexpr std::uint32_t kGroupsVersion = 3;

static_assert(sizeof(RegionPoint) == 2 * sizeof(double));

/// A GroupNode in two arrays without padding.
struct NodeLinks {
  GroupIndex parent;
  std::array<GroupIndex, 2> children;
  std::uint32_t triangles;
};
struct NodeCircle {
  double centre_x_m, centre_y_m, radius_m;
};

/// A CertifiedGroup in two arrays without padding.
struct CertifiedPlace {
  double centre_x_m, centre_y_m, height_m;
};
struct CertifiedScale {
  float radius_m, low_slope, slope_step;
};

constexpr std::size_t kStepsOfSector = std::tuple_size_v<SectorSteps>;
constexpr int kNoLaterRing = 128;

/// The steps of a sector, and of the one before it in its group, which they are told from: sectors
/// side by side have much in common.
class SectorBefore {
 public:
  void forget() { count_ = 0; }

  void remember(const SectorSteps& steps, std::size_t count) {
    steps_ = steps;
    count_ = count;
  }

  /// The first of its rings beyond one; none: -1.
  int ring_beyond(int ring) const {
    for (std::size_t i = 0; i < count_; ++i)
      if (ring_at(i) > ring) return ring_at(i);
    return -1;
  }

  /// The code that holds in a ring; none: 0.
  int code_in(int ring) const {
    int code = 0;
    for (std::size_t i = 0; i < count_ && ring_at(i) <= ring; ++i)
      code = steps_[i] & (kSlopeCodes - 1);
    return code;
  }

 private:
  int ring_at(std::size_t i) const { return steps_[i] >> kSlopeBits; }

  SectorSteps steps_{};
  std::size_t count_ = 0;
};

/// Steps in bytes of one meaning after the other, so that they can be packed.
struct StepPlanes {
  std::vector<std::uint8_t> count;       // of each sector: steps without the last one's repeats
  std::vector<std::uint8_t> first_ring;  // of each sector
  std::vector<std::uint8_t> ring;        // of each later step
  std::vector<std::uint8_t> low, high;   // of each step's code
};

unsigned sign_lowest(int value) {
  return static_cast<unsigned>(value << 1 ^ value >> 31);
}

int from_sign_lowest(unsigned code) {
  return static_cast<int>((code >> 1) ^ (0 - (code & 1)));
}

/// Steps up to those that only repeat the one before.
std::size_t different(const SectorSteps& steps) {
  std::size_t count = steps.size();
  while (count > 1 && steps[count - 1] == steps[count - 2]) --count;
  return count;
}

std::vector<std::uint8_t> planes_of(const CertifiedRegions& regions) {
  StepPlanes planes;
  SectorBefore before;
  const auto sectors = static_cast<std::size_t>(regions.layout.sectors);
  for (std::size_t row = 0; row < regions.steps.size(); ++row) {
    if (row % sectors == 0) before.forget();
    const SectorSteps& steps = regions.steps[row];
    const std::size_t count = different(steps);
    planes.count.push_back(static_cast<std::uint8_t>(count));
    for (std::size_t i = 0; i < count; ++i) {
      const int ring = steps[i] >> kSlopeBits, code = steps[i] & (kSlopeCodes - 1);
      if (i == 0) {
        planes.first_ring.push_back(static_cast<std::uint8_t>(ring));
      } else {
        const int last = steps[i - 1] >> kSlopeBits, beyond = before.ring_beyond(last);
        const unsigned told = beyond < 0 ? static_cast<unsigned>(kNoLaterRing + (ring - last))
                                         : sign_lowest(ring - beyond);
        planes.ring.push_back(static_cast<std::uint8_t>(told));
      }
      const unsigned told = sign_lowest(code - before.code_in(ring));
      planes.low.push_back(static_cast<std::uint8_t>(told));
      planes.high.push_back(static_cast<std::uint8_t>(told >> 8));
    }
    before.remember(steps, count);
  }
  std::vector<std::uint8_t> all = std::move(planes.count);
  for (const auto* plane : {&planes.first_ring, &planes.ring, &planes.low, &planes.high})
    all.insert(all.end(), plane->begin(), plane->end());
  return all;
}

/// What no writer makes comes out as some other step.
std::vector<SectorSteps> steps_of(const std::vector<std::uint8_t>& planes, std::size_t rows,
                                  std::size_t sectors, const SectionFile& file) {
  if (planes.size() < rows) file.fail("fewer counts of steps than certified sectors");
  std::size_t all = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    if (planes[row] < 1 || planes[row] > kStepsOfSector)
      file.fail(fmt::format("{} steps in a certified sector where 1 to {} were expected",
                            planes[row], kStepsOfSector));
    all += planes[row];
  }
  // Counts and first rings are of sectors, rings but those, low and high bytes of steps.
  if (planes.size() != rows + 3 * all)
    file.fail(fmt::format("{} bytes of certified steps where {} were expected", planes.size(),
                          rows + 3 * all));
  const std::uint8_t* first_ring = planes.data() + rows;
  const std::uint8_t* told_ring = first_ring + rows;
  const std::uint8_t* low = told_ring + (all - rows);
  const std::uint8_t* high = low + all;
  std::vector<SectorSteps> steps(rows);
  SectorBefore before;
  for (std::size_t row = 0; row < rows; ++row) {
    if (row % sectors == 0) before.forget();
    const std::size_t count = planes[row];
    int ring = first_ring[row] % kRings;
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0) {
        const unsigned told = *told_ring++;
        const int beyond = before.ring_beyond(ring);
        ring = (beyond < 0 ? ring + static_cast<int>(told) - kNoLaterRing
                           : beyond + from_sign_lowest(told)) &
               (kRings - 1);
      }
      const int told = from_sign_lowest(*low++ | unsigned{*high++} << 8);
      steps[row][i] = static_cast<std::uint16_t>(
          ring << kSlopeBits | ((before.code_in(ring) + told) & (kSlopeCodes - 1)));
    }
    std::fill(steps[row].begin() + static_cast<std::ptrdiff_t>(count), steps[row].end(),
              steps[row][count - 1]);
    before.remember(steps[row], count);
  }
  return steps;
}

void describe(const CertifiedRegions& regions, std::vector<CertifiedPlace>& places,
              std::vector<CertifiedScale>& scales) {
  for (const CertifiedGroup& g : regions.groups) {
    places.push_back({g.centre_x_m, g.centre_y_m, g.height_m});
    scales.push_back({g.radius_m, g.low_slope, g.slope_step});
  }
}

void add_certified(SectionFileWriter& writer, const CertifiedRegions& regions) {
  std::vector<CertifiedPlace> places;
  std::vector<CertifiedScale> scales;
  describe(regions, places, scales);
  const std::vector<std::int32_t> layout = {regions.layout.sectors, regions.layout.ring_bits};
  writer.add_owned<std::int32_t>("cert_layout", layout);
  writer.add_packed<double>("cert_place", places);
  writer.add_packed<float>("cert_scale", scales);
  writer.add_packed<std::uint8_t>("cert_steps", planes_of(regions));
}

void read_certified(Groups& groups, const SectionFile& file) {
  CertifiedRegions& regions = groups.certified;
  const auto layout = file.section<std::int32_t>("cert_layout");
  if (layout.size() != 2)
    file.fail(fmt::format("{} numbers of a layout where 2 were expected", layout.size()));
  regions.layout = {layout[0], layout[1]};
  const auto places = file.unpack<double, CertifiedPlace>("cert_place");
  const auto scales = file.unpack<float, CertifiedScale>("cert_scale");
  if (places.size() != groups.leaf_count || scales.size() != places.size())
    file.fail(fmt::format("{} places and {} scales of certified regions for {} groups",
                          places.size(), scales.size(), groups.leaf_count));
  for (std::size_t g = 0; g < places.size(); ++g)
    regions.groups.push_back({places[g].centre_x_m, places[g].centre_y_m, places[g].height_m,
                              scales[g].radius_m, scales[g].low_slope, scales[g].slope_step});
  if (regions.layout.sectors < 8 || regions.layout.sectors > 4096)
    file.fail("of the certified regions, sectors are not a multiple of 8 from 8 to 4096");
  const auto sectors = static_cast<std::size_t>(regions.layout.sectors);
  regions.steps = steps_of(file.unpack<std::uint8_t, std::uint8_t>("cert_steps"),
                           places.size() * sectors, sectors, file);
  if (const auto broken = check_certified(regions))
    file.fail(fmt::format("of the certified regions, {}", *broken));
  // Cameras are looked up in float: a centre from which a square of a distance overflows has none.
  for (std::size_t g = 0; g < regions.groups.size(); ++g)
    if (std::abs(regions.groups[g].centre_x_m) > kLatticeReachM ||
        std::abs(regions.groups[g].centre_y_m) > kLatticeReachM)
      file.fail(fmt::format("group {} is centred beyond the lattice", g));
}

std::size_t region_count(const Groups& groups) {
  return groups.nodes.size() * static_cast<std::size_t>(groups.regions.layout.count);
}

void read_nodes(Groups& groups, const SectionFile& file) {
  const auto links = file.unpack<std::uint32_t, NodeLinks>("node_links");
  const auto circles = file.unpack<double, NodeCircle>("node_circle");
  if (links.size() != circles.size() || links.size() >= kNone)
    file.fail(fmt::format("{} nodes with {} circles", links.size(), circles.size()));
  for (std::size_t n = 0; n < links.size(); ++n) {
    groups.nodes.push_back({links[n].parent, links[n].children, links[n].triangles,
                            circles[n].centre_x_m, circles[n].centre_y_m, circles[n].radius_m});
  }
}

void check_nodes(const Groups& groups, const SectionFile& file) {
  const std::size_t count = groups.nodes.size();
  if (groups.leaf_count > count)
    file.fail(fmt::format("{} leaves in a tree of {} nodes", groups.leaf_count, count));
  for (std::size_t n = 0; n < count; ++n) {
    const GroupNode& node = groups.nodes[n];
    const bool is_leaf = n < groups.leaf_count;
    for (const GroupIndex child : node.children) {
      if (is_leaf ? child != kNone : child >= n)
        file.fail(fmt::format("node {} has node {} as a child", n, child));
      if (!is_leaf && groups.nodes[child].parent != n)
        file.fail(fmt::format("node {} does not name its parent {}", child, n));
    }
    if (!is_leaf && node.children[0] == node.children[1])
      file.fail(fmt::format("node {} has one child twice", n));
    if (node.parent != kNone) {
      if (node.parent >= count || node.parent < groups.leaf_count)
        file.fail(fmt::format("node {} has node {} as its parent", n, node.parent));
      const auto& siblings = groups.nodes[node.parent].children;
      if (siblings[0] != n && siblings[1] != n)
        file.fail(fmt::format("node {} does not name its child {}", node.parent, n));
    }
    if (!std::isfinite(node.centre_x_m) || !std::isfinite(node.centre_y_m) ||
        !std::isfinite(node.radius_m) || node.radius_m < 0)
      file.fail(fmt::format("node {} has no proper circle", n));
  }
}

void check_group_of_triangle(const Groups& groups, const SectionFile& file) {
  for (std::size_t t = 0; t < groups.group_of_triangle.size(); ++t) {
    const GroupIndex group = groups.group_of_triangle[t];
    if (group != kNone && group >= groups.leaf_count)
      file.fail(fmt::format("triangle {} is in group {} of {}", t, group, groups.leaf_count));
  }
}

void check_regions(const Groups& groups, const SectionFile& file) {
  const Regions& regions = groups.regions;
  const std::size_t count = region_count(groups);
  const bool has_none = count == 0 && regions.first.empty();
  if ((!has_none && regions.first.size() != count + 1) || regions.end_slope.size() != count)
    file.fail(fmt::format("{} region starts and {} end slopes where {} and {} were expected",
                          regions.first.size(), regions.end_slope.size(), count + 1, count));
  std::uint32_t end = 0;
  for (std::size_t i = 0; i < regions.first.size(); ++i) {
    if ((i == 0 && regions.first[i] != 0) || regions.first[i] < end)
      file.fail(fmt::format("region {} begins before the one before it ends", i));
    end = regions.first[i];
  }
  if (end != regions.points.size())
    file.fail(fmt::format("{} region points where {} were expected", regions.points.size(), end));
  for (std::size_t i = 0; i < regions.points.size(); ++i) {
    if (std::isnan(regions.points[i].u_m) || std::isnan(regions.points[i].z_m))
      file.fail(fmt::format("region point {} is not a number", i));
  }
}

}  // namespace

std::size_t kept_bytes(const CertifiedRegions& regions) {
  std::vector<CertifiedPlace> places;
  std::vector<CertifiedScale> scales;
  describe(regions, places, scales);
  const std::vector<std::uint8_t> steps = planes_of(regions);
  return packed(std::as_bytes(std::span(places))).size() +
         packed(std::as_bytes(std::span(scales))).size() +
         packed(std::as_bytes(std::span(steps))).size();
}

SectionFileWriter groups_writer(const Groups& groups) {
  const Regions& regions = groups.regions;
  assert(regions.first.size() == region_count(groups) + 1 ||
         (groups.nodes.empty() && regions.first.empty()));
  assert(regions.end_slope.size() == region_count(groups));
  std::vector<NodeLinks> links;
  std::vector<NodeCircle> circles;
  for (const GroupNode& node : groups.nodes) {
    links.push_back({node.parent, node.children, node.triangles});
    circles.push_back({node.centre_x_m, node.centre_y_m, node.radius_m});
  }
  SectionFileWriter writer(kGroupsKind, kGroupsVersion);
  add_layout(writer, regions.layout);
  writer.add<std::uint32_t>("leaf_count", std::span(&groups.leaf_count, 1));
  writer.add_packed<std::uint32_t>("group_of_tri", groups.group_of_triangle);
  writer.add_packed<std::uint32_t>("node_links", links);
  writer.add_packed<double>("node_circle", circles);
  writer.add_packed<std::uint32_t>("region_first", regions.first);
  writer.add_packed<double>("region_point", regions.points);
  writer.add_packed<double>("end_slope", regions.end_slope);
  if (groups.has_certified()) add_certified(writer, groups.certified);
  return writer;
}

void write_groups(const std::string& path, const Groups& groups, Existing existing) {
  groups_writer(groups).write(path, existing);
}

Groups read_groups(const SectionFile& file) {
  file.require(kGroupsKind, kGroupsVersion);
  Groups groups;
  const auto leaf_count = file.section<std::uint32_t>("leaf_count");
  if (leaf_count.size() != 1)
    file.fail(fmt::format("{} leaf counts where one was expected", leaf_count.size()));
  groups.leaf_count = leaf_count[0];
  groups.group_of_triangle = file.unpack<std::uint32_t, GroupIndex>("group_of_tri");
  groups.regions.layout = read_layout(file);
  groups.regions.first = file.unpack<std::uint32_t, std::uint32_t>("region_first");
  groups.regions.points = file.unpack<double, RegionPoint>("region_point");
  groups.regions.end_slope = file.unpack<double, double>("end_slope");
  read_nodes(groups, file);
  check_nodes(groups, file);
  check_group_of_triangle(groups, file);
  check_regions(groups, file);
  if (file.has("cert_layout")) read_certified(groups, file);
  return groups;
}

}  // namespace scarp
