#include "cli/fly/flight.h"

#include <algorithm>

#include "cli/fly/pixel_judge.h"
#include "cli/stopwatch.h"

namespace scarp {
namespace {

/// Draws some groups and the orphans.
class Painter {
 public:
  explicit Painter(const GroupBatches& batches) : batches_(batches) {}

  void gather(std::span<const GroupIndex> groups) {
    drawing_.vertices.clear();
    drawing_.triangles.clear();
    drawing_.objects.clear();
    for (const GroupIndex g : groups) batches_.add_to(g, drawing_);
    batches_.add_to(batches_.groups(), drawing_);
  }

  std::uint64_t triangles() const { return drawing_.triangles.size(); }

  Target draw(const Shot& shot, int scale) const {
    Target target = empty_target(shot.width_px * scale, shot.height_px * scale);
    rasterise(target,
              project_all(look_at(shot.view, target.width_px, target.height_px), drawing_.vertices),
              drawing_.triangles, drawing_.objects);
    return target;
  }

 private:
  const GroupBatches& batches_;
  GroupBatches::Drawing drawing_;
};

std::vector<GroupIndex> in_picture(const GroupBatches& batches, const Frustum& frustum,
                                   std::span<const GroupIndex> groups) {
  std::vector<GroupIndex> kept;
  for (const GroupIndex g : groups)
    if (frustum.may_show(batches.box(g))) kept.push_back(g);
  return kept;
}

/// The pictures of everything in view, and what is seen in the finest.
struct WholeFrame {
  std::array<Target, kPictureScales.size()> pictures;
  std::vector<std::uint8_t> group_seen;  // [groups + 1], the last for the orphans
  FrameTruth truth;
};

class Runner {
 public:
  Runner(const TinIndex& index, const GroupBatches& batches, std::vector<Contender>& contenders)
      : batches_(batches), contenders_(contenders), judge_(index), painter_(batches) {
    for (GroupIndex g = 0; g <= batches.groups(); ++g)
      for (const TriangleIndex t : batches.triangles(g)) {
        if (group_of_.size() <= t) group_of_.resize(t + 1);
        group_of_[t] = g;
      }
    for (GroupIndex g = 0; g < batches.groups(); ++g) all_groups_.push_back(g);
    is_triangle_drawn_.resize(group_of_.size());
  }

  WholeFrame draw_whole(const Shot& shot) {
    WholeFrame whole;
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    painter_.gather(in_picture(batches_, frustum, all_groups_));
    whole.truth.in_view = painter_.triangles();
    for (std::size_t s = 0; s < kPictureScales.size(); ++s)
      whole.pictures[s] = painter_.draw(shot, kPictureScales[s]);
    std::vector<std::uint8_t> seen(group_of_.size(), 0);
    whole.group_seen.assign(batches_.groups() + 1, 0);
    for (const std::uint32_t object : whole.pictures.back().object) {
      if (object == kNone || seen[object]) continue;
      seen[object] = 1;
      ++whole.truth.visible;
      whole.group_seen[group_of_[object]] = 1;
    }
    whole.group_seen.back() = 1;  // orphans are always drawn
    for (GroupIndex g = 0; g <= batches_.groups(); ++g)
      if (whole.group_seen[g]) whole.truth.in_visible_groups += batches_.triangles(g).size();
    return whole;
  }

  FrameCounts draw_by(std::size_t contender, const Shot& shot, const WholeFrame& whole,
                      Target& picture) {
    FrameCounts counts;
    const Stopwatch finding;
    const CullingAnswer answer = contenders_[contender].method->visible(camera_of(shot));
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    const std::vector<GroupIndex> groups = in_picture(batches_, frustum, answer.visible_groups);
    counts.find_ms = finding.ms();
    counts.groups = static_cast<std::uint32_t>(groups.size());
    const Stopwatch drawing;
    painter_.gather(groups);
    picture = painter_.draw(shot, kPictureScales[0]);
    counts.draw_ms = drawing.ms();
    counts.drawn = painter_.triangles();
    std::vector<std::uint8_t> is_drawn(batches_.groups() + 1, 0);
    for (const GroupIndex g : groups) is_drawn[g] = 1;
    for (GroupIndex g = 0; g < batches_.groups(); ++g)
      counts.missed_groups += whole.group_seen[g] && !is_drawn[g];
    is_drawn.back() = 1;
    for (std::size_t g = 0; g < group_of_.size(); ++g)
      is_triangle_drawn_[g] = is_drawn[group_of_[g]];
    count_wrong(0, shot, whole, picture, counts);
    for (std::size_t s = 1; s < kPictureScales.size(); ++s)
      count_wrong(s, shot, whole, painter_.draw(shot, kPictureScales[s]), counts);
    return counts;
  }

 private:
  void count_wrong(std::size_t scale, const Shot& shot, const WholeFrame& whole,
                   const Target& picture, FrameCounts& counts) const {
    const Target& truth = whole.pictures[scale];
    const Projection projection = look_at(shot.view, picture.width_px, picture.height_px);
    for (int y = 0; y < picture.height_px; ++y)
      for (int x = 0; x < picture.width_px; ++x) {
        const std::size_t i = picture.index(x, y);
        if (picture.object[i] == truth.object[i]) continue;
        ++counts.wrong_px[scale];
        counts.judged_wrong_px[scale] += judge_.is_wrong(shot.view.eye, projection, picture, x, y,
                                                         truth.object[i], is_triangle_drawn_);
      }
  }

  const GroupBatches& batches_;
  std::vector<Contender>& contenders_;
  PixelJudge judge_;
  Painter painter_;
  std::vector<std::uint8_t> is_triangle_drawn_;
  std::vector<GroupIndex> group_of_;  // [triangles], groups() for orphans
  std::vector<GroupIndex> all_groups_;
};

}  // namespace

Flight fly(const TinIndex& index, const GroupBatches& batches, const std::vector<Shot>& shots,
           std::vector<Contender>& contenders, const SeeFrame& see, const Progress& progress) {
  Runner runner(index, batches, contenders);
  Flight flight;
  flight.counts.resize(contenders.size());
  Target picture;
  for (std::size_t frame = 0; frame < shots.size(); ++frame) {
    const WholeFrame whole = runner.draw_whole(shots[frame]);
    flight.truth.push_back(whole.truth);
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      flight.counts[c].push_back(runner.draw_by(c, shots[frame], whole, picture));
      see(frame, c, whole.pictures[0], picture);
    }
    if (progress) progress(static_cast<double>(frame + 1) / static_cast<double>(shots.size()));
  }
  return flight;
}

}  // namespace scarp
