#include "cli/fly/flight.h"

#include <algorithm>

#include "cli/fly/pixel_judge.h"
#include "cli/stopwatch.h"
#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

/// The pictures of a frame at one scale: numbers of what is opaque, and of what is translucent
/// before it.
struct Pictures {
  Target opaque, translucent;  // translucent has a size only where there are such movers
};

/// Draws some groups, the orphans and some movers. Movers have numbers after those of triangles.
class Painter {
 public:
  Painter(const GroupBatches& batches, std::uint32_t triangles)
      : batches_(batches), first_mover_(triangles) {}

  void gather(std::span<const GroupIndex> groups) {
    for (GroupBatches::Drawing* drawing : {&opaque_, &translucent_}) {
      drawing->vertices.clear();
      drawing->triangles.clear();
      drawing->objects.clear();
    }
    for (const GroupIndex g : groups) batches_.add_to(g, opaque_);
    batches_.add_to(batches_.groups(), opaque_);
    ground_triangles_ = opaque_.triangles.size();
  }

  void add(std::uint32_t mover, const Bounds& box, bool is_translucent) {
    add_box(box, first_mover_ + mover, is_translucent ? translucent_ : opaque_);
  }

  /// Without movers.
  std::uint64_t triangles() const { return ground_triangles_; }
  std::uint32_t first_mover() const { return first_mover_; }

  Pictures draw(const Shot& shot, int scale, bool with_translucent) const {
    Pictures pictures;
    pictures.opaque = empty_target(shot.width_px * scale, shot.height_px * scale);
    const Projection projection =
        look_at(shot.view, pictures.opaque.width_px, pictures.opaque.height_px);
    const auto draw_into = [&](Target& target, const GroupBatches::Drawing& drawing) {
      rasterise(target, project_all(projection, drawing.vertices), drawing.triangles,
                drawing.objects);
    };
    draw_into(pictures.opaque, opaque_);
    if (!with_translucent) return pictures;
    // What is opaque hides it, and it hides nothing but others of its kind.
    pictures.translucent = pictures.opaque;
    std::fill(pictures.translucent.object.begin(), pictures.translucent.object.end(), kNone);
    draw_into(pictures.translucent, translucent_);
    return pictures;
  }

 private:
  const GroupBatches& batches_;
  const std::uint32_t first_mover_;
  GroupBatches::Drawing opaque_, translucent_;
  std::uint64_t ground_triangles_ = 0;
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
  std::array<Pictures, kPictureScales.size()> pictures;
  std::vector<std::uint8_t> group_seen;  // [groups + 1], the last for the orphans
  std::vector<Bounds> movers;            // [movers]
  std::vector<std::uint8_t> mover_seen;  // [movers]
  FrameTruth truth;
};

class Runner {
 public:
  Runner(const TinIndex& index, const GroupBatches& batches, const FlightPlan& plan,
         std::vector<Contender>& contenders)
      : index_(index),
        batches_(batches),
        plan_(plan),
        contenders_(contenders),
        judge_(index),
        painter_(batches, static_cast<std::uint32_t>(index.tin().triangles.size())),
        random_(plan.seed),
        group_of_(index.tin().triangles.size()),
        is_there_(batches.groups(), 1) {
    for (GroupIndex g = 0; g <= batches.groups(); ++g)
      for (const TriangleIndex t : batches.triangles(g)) group_of_[t] = g;
    for (const Mover& mover : plan.movers) has_translucent_ |= mover.is_translucent;
    list_groups();
    is_triangle_drawn_.resize(group_of_.size());
  }

  /// Takes groups away, or puts them back, and tells everybody.
  void change_scene() {
    for (std::uint32_t i = 0; i < plan_.changes; ++i) {
      std::uint8_t& there = is_there_[static_cast<std::size_t>(
          random_.unit() * static_cast<double>(is_there_.size()))];
      there = !there;
    }
    list_groups();
    std::vector<std::uint8_t> triangles(group_of_.size(), 1);
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (group_of_[t] < batches_.groups()) triangles[t] = is_there_[group_of_[t]];
    judge_.set_present(triangles);
    for (Contender& contender : contenders_) contender.method->set_present(is_there_);
  }

  WholeFrame draw_whole(std::size_t frame) {
    const Shot& shot = plan_.shots[frame];
    WholeFrame whole;
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    painter_.gather(in_picture(batches_, frustum, all_groups_));
    for (std::uint32_t m = 0; m < plan_.movers.size(); ++m) {
      whole.movers.push_back(box_at(plan_.movers[m], index_, frame));
      if (!frustum.may_show(whole.movers[m])) continue;
      ++whole.truth.movers;
      painter_.add(m, whole.movers[m], plan_.movers[m].is_translucent);
    }
    whole.truth.in_view = painter_.triangles();
    for (std::size_t s = 0; s < kPictureScales.size(); ++s)
      whole.pictures[s] = painter_.draw(shot, kPictureScales[s], has_translucent_);
    look(whole);
    return whole;
  }

  FrameCounts draw_by(std::size_t contender, std::size_t frame, const WholeFrame& whole,
                      Target& picture) {
    const Shot& shot = plan_.shots[frame];
    CullingMethod& method = *contenders_[contender].method;
    FrameCounts counts;
    const ProcessorStopwatch finding;
    const CullingAnswer answer = method.visible(camera_of(shot));
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    const std::vector<GroupIndex> groups = in_picture(batches_, frustum, answer.visible_groups);
    std::vector<std::uint8_t> draws_mover;
    for (const Bounds& box : whole.movers)
      draws_mover.push_back(frustum.may_show(box) && method.may_show(box));
    counts.find_ms = finding.ms();
    counts.groups = static_cast<std::uint32_t>(groups.size());
    const ProcessorStopwatch drawing;
    painter_.gather(groups);
    for (std::uint32_t m = 0; m < draws_mover.size(); ++m) {
      counts.missed_movers += whole.mover_seen[m] && !draws_mover[m];
      if (!draws_mover[m]) continue;
      ++counts.movers;
      painter_.add(m, whole.movers[m], plan_.movers[m].is_translucent);
    }
    Pictures pictures = painter_.draw(shot, kPictureScales[0], has_translucent_);
    counts.draw_ms = drawing.ms();
    counts.drawn = painter_.triangles();
    std::vector<std::uint8_t> is_drawn(batches_.groups() + 1, 0);
    for (const GroupIndex g : groups) is_drawn[g] = 1;
    for (GroupIndex g = 0; g < batches_.groups(); ++g)
      counts.missed_groups += whole.group_seen[g] && !is_drawn[g];
    is_drawn.back() = 1;
    for (std::size_t t = 0; t < group_of_.size(); ++t)
      is_triangle_drawn_[t] = is_drawn[group_of_[t]];
    count_wrong(0, shot, whole, pictures, counts);
    for (std::size_t s = 1; s < kPictureScales.size(); ++s)
      count_wrong(s, shot, whole, painter_.draw(shot, kPictureScales[s], has_translucent_), counts);
    if (plan_.see_groups) plan_.see_groups(frame, contender, groups);
    picture = std::move(pictures.opaque);
    return counts;
  }

 private:
  void list_groups() {
    all_groups_.clear();
    for (GroupIndex g = 0; g < batches_.groups(); ++g)
      if (is_there_[g]) all_groups_.push_back(g);
  }

  /// What is seen in the finest pictures.
  void look(WholeFrame& whole) const {
    std::vector<std::uint8_t> seen(group_of_.size(), 0);
    whole.group_seen.assign(batches_.groups() + 1, 0);
    whole.mover_seen.assign(whole.movers.size(), 0);
    const auto look_at_picture = [&](const Target& picture) {
      for (const std::uint32_t object : picture.object) {
        if (object == kNone) continue;
        if (object >= painter_.first_mover()) {
          whole.mover_seen[object - painter_.first_mover()] = 1;
        } else if (!seen[object]) {
          seen[object] = 1;
          ++whole.truth.visible;
          whole.group_seen[group_of_[object]] = 1;
        }
      }
    };
    look_at_picture(whole.pictures.back().opaque);
    look_at_picture(whole.pictures.back().translucent);
    for (const std::uint8_t is_seen : whole.mover_seen) whole.truth.visible_movers += is_seen;
    whole.group_seen.back() = 1;  // orphans are always drawn
    for (GroupIndex g = 0; g <= batches_.groups(); ++g)
      if (whole.group_seen[g]) whole.truth.in_visible_groups += batches_.triangles(g).size();
  }

  void count_wrong(std::size_t scale, const Shot& shot, const WholeFrame& whole,
                   const Pictures& drawn, FrameCounts& counts) const {
    const Pictures& truth = whole.pictures[scale];
    const Target& picture = drawn.opaque;
    const Projection projection = look_at(shot.view, picture.width_px, picture.height_px);
    const auto is_seen = [&](std::uint32_t object, int x, int y) {
      return object >= painter_.first_mover()
                 ? judge_.is_box_wrong(shot.view.eye, projection, picture, x, y,
                                       whole.movers[object - painter_.first_mover()])
                 : judge_.is_wrong(shot.view.eye, projection, picture, x, y, object,
                                   is_triangle_drawn_);
    };
    for (int y = 0; y < picture.height_px; ++y)
      for (int x = 0; x < picture.width_px; ++x) {
        const std::size_t i = picture.index(x, y);
        if (picture.object[i] != truth.opaque.object[i]) {
          ++counts.wrong_px[scale];
          counts.judged_wrong_px[scale] += is_seen(truth.opaque.object[i], x, y);
        } else if (has_translucent_ && drawn.translucent.object[i] != truth.translucent.object[i]) {
          ++counts.wrong_px[scale];
          counts.judged_wrong_px[scale] += is_seen(truth.translucent.object[i], x, y);
        }
      }
  }

  const TinIndex& index_;
  const GroupBatches& batches_;
  const FlightPlan& plan_;
  std::vector<Contender>& contenders_;
  PixelJudge judge_;
  Painter painter_;
  SplitMix64 random_;
  bool has_translucent_ = false;
  std::vector<GroupIndex> group_of_;  // [triangles], groups() for orphans
  std::vector<GroupIndex> all_groups_;
  std::vector<std::uint8_t> is_there_;           // [groups]
  std::vector<std::uint8_t> is_triangle_drawn_;  // [triangles] in the last picture
};

}  // namespace

Flight fly(const TinIndex& index, const GroupBatches& batches, const FlightPlan& plan,
           std::vector<Contender>& contenders, const SeeFrame& see, const Progress& progress) {
  Runner runner(index, batches, plan, contenders);
  Flight flight;
  flight.counts.resize(contenders.size());
  Target picture;
  for (std::size_t frame = 0; frame < plan.shots.size(); ++frame) {
    if (plan.changes > 0 && frame > 0 && frame % kChangeFrames == 0) runner.change_scene();
    const WholeFrame whole = runner.draw_whole(frame);
    flight.truth.push_back(whole.truth);
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      flight.counts[c].push_back(runner.draw_by(c, frame, whole, picture));
      see(frame, c, whole.pictures[0].opaque, picture);
    }
    if (progress) progress(static_cast<double>(frame + 1) / static_cast<double>(plan.shots.size()));
  }
  return flight;
}

}  // namespace scarp
